// Errors of lookups carry what they are about as data.

#include <algorithm>
#include <string>
#include <utility>

#include "tfdude/client/client.hpp"
#include "tfdude/client/node.hpp"
#include "tfdude/math/conversions.hpp"

#include "support/catch.hpp"
#include "support/forest_support.hpp"
#include "support/networks.hpp"
#include "support/process.hpp"

namespace tfdude {
namespace {

using testing::along_x;
using testing::ContainsSubstring;
using testing::eventually;

Time at(int ms) { return Time(std::chrono::seconds(1'000'000)) + Milliseconds(ms); }

Query query_at(int ms) {
  Query query;
  query.at = at(ms);
  return query;
}

// world -> base -> arm -> hand, of two partitions; base and hand are sampled.
struct World {
  explicit World(testing::Join joined)
      : join(std::move(joined)),
        body(Node::open(join("body"), "body", {{"world", "", {}}, {"base", "world", {}}}).value()),
        arm(Node::open(join("arm"), "arm", {{"arm", "base", {}}, {"hand", "arm", {}}}).value()),
        client(Client::open(join("")).value()) {
    for (const int t : {0, 1000, 2000}) REQUIRE(body.update("base", along_x(t), at(t)));
    for (const int t : {500, 1500, 2500}) REQUIRE(arm.update("hand", along_x(t), at(t)));
    REQUIRE(eventually([&] { return client.lookup("world", "hand").has_value(); }));
  }

  testing::Join join;
  Node body;
  Node arm;
  Client client;
};

Error error_of(const Result<StampedTransform>& X) {
  REQUIRE_FALSE(X);
  return X.error();
}

}  // namespace

TEST_CASE("errors: an owner says which edge lacks data, and when all have it") {
  World world(testing::join_loopback());
  REQUIRE(world.arm.add("tool", "hand", along_x(1)));
  for (const int t : {1000, 3000}) REQUIRE(world.arm.update("tool", along_x(t), at(t)));
  const Error late = error_of(world.arm.lookup("arm", "tool", query_at(4000)));
  CHECK(late.code == Errc::kNotYet);
  CHECK(late.frame == "hand");  // which ends first
  CHECK(late.available == Interval{at(1000), at(2500)});
  const Error early = error_of(world.arm.lookup("arm", "tool", query_at(700)));
  CHECK(early.code == Errc::kTooOld);
  CHECK(early.frame == "tool");  // which begins last
  CHECK(early.available == Interval{at(1000), at(2500)});
}

TEST_CASE("errors: without an instant in common there is no interval") {
  World world(testing::join_loopback());
  REQUIRE(world.arm.add("tool", "hand", along_x(1)));
  REQUIRE(world.arm.update("tool", along_x(1), at(5000)));
  const Error apart = error_of(world.arm.lookup("arm", "tool", query_at(5000)));
  CHECK(apart.frame == "hand");
  CHECK_FALSE(apart.available);
}

TEST_CASE("errors: those of other owners name frame and partition") {
  World world(testing::joined_by(GENERATE(from_range(testing::networks()))));
  const Error late = error_of(world.client.lookup("world", "hand", query_at(2200)));
  CHECK(late.code == Errc::kNotYet);
  CHECK(late.frame == "base");
  CHECK(late.partition == "body");
  const Error early = error_of(world.client.lookup("world", "hand", query_at(100)));
  CHECK(early.code == Errc::kTooOld);
  CHECK(early.frame == "hand");
  CHECK(early.partition == "arm");
}

TEST_CASE("errors: a frame that nobody has, and a partition that is gone, are named") {
  World world(testing::joined_by(GENERATE(from_range(testing::networks()))));
  const Error start = error_of(world.client.lookup("nowhere", "hand", Query{}));
  CHECK(start.code == Errc::kUnknownStart);
  CHECK(start.frame == "nowhere");
  const Error end = error_of(world.client.lookup("hand", "nowhere", Query{}));
  CHECK(end.code == Errc::kUnknownEnd);
  CHECK(end.frame == "nowhere");
  REQUIRE(world.client.add("island", "", along_x(1), "body"));
  const Error apart = error_of(world.client.lookup("hand", "island", Query{}));
  CHECK(apart.code == Errc::kNotConnected);
  CHECK(apart.frame == "hand");
  const Node sea = Node::open(world.join("sea"), "sea", {{"pole", "raft", {}}}).value();
  REQUIRE(eventually([&] { return world.client.exists("pole"); }));
  const Error waits = error_of(world.client.lookup("hand", "pole", Query{}));
  CHECK(waits.code == Errc::kNotConnected);
  CHECK(waits.frame == "raft");
  CHECK_THAT(waits.message, ContainsSubstring("'pole' waits for its parent 'raft'"));
  { const Node gone = std::move(world.arm); }
  Result<StampedTransform> lost = tl::unexpected(Error{Errc::kNotYet, {}});
  CHECK(eventually([&] {
    lost = world.client.lookup("world", "hand", Query{});
    return !lost && lost.error().code == Errc::kUnreachable;
  }));
  CHECK(lost.error().partition == "arm");
}

TEST_CASE("errors: as exceptions they keep their data") {
  World world(testing::join_loopback());
  try {
    (void)value_or_throw(world.client.lookup("world", "nowhere", Query{}));
    FAIL("nothing was thrown");
  } catch (const ErrorException& thrown) {
    CHECK(thrown.code() == Errc::kUnknownEnd);
    CHECK(thrown.error().frame == "nowhere");
  }
}

}  // namespace tfdude
