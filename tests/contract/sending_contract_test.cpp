// Streamed values: they reach the reachable ones of several owners, and arrive although their
// sender ends. Over each transport.

#include <optional>
#include <string>
#include <vector>

#include "tfdude/client/client.hpp"
#include "tfdude/client/node.hpp"

#include "support/catch.hpp"
#include "support/forest_support.hpp"
#include "support/networks.hpp"
#include "support/process.hpp"
#include "support/tip_nodes.hpp"

namespace tfdude {
namespace {

using testing::along_x;
using testing::ContainsSubstring;
using testing::eventually;
using testing::is_at;
using testing::Join;
using testing::joined_by;
using testing::open_with_tip;
using testing::outcome;

}  // namespace

TEST_CASE("publish: reachable owners get their edges and the error names the unreachable one") {
  const Join join = joined_by(GENERATE(from_range(testing::networks())));
  Node a = open_with_tip(join, "a");
  Node b = open_with_tip(join, "b");
  std::optional<Node> gone = open_with_tip(join, "gone");
  auto client = Client::open(join("")).value();
  const auto edges = [](double x) {
    return std::vector<EdgeUpdate>{
        {"gone_tip", along_x(x)}, {"a_tip", along_x(x)}, {"b_tip", along_x(x)}};
  };
  REQUIRE(eventually([&] { return outcome(client.publish(edges(1))) == "ok"; }));
  REQUIRE(eventually([&] { return is_at(*gone, "gone_base", "gone_tip", 1); }));
  gone.reset();
  REQUIRE(eventually([&] {
    const auto updated = client.update("gone_tip", along_x(1));
    return !updated && updated.error().code == Errc::kUnreachable;
  }));
  const auto published = client.publish(edges(2));
  REQUIRE_FALSE(published);
  CHECK(published.error().code == Errc::kUnreachable);
  CHECK_THAT(published.error().message, ContainsSubstring("'gone'"));
  CHECK(eventually([&] { return is_at(a, "a_base", "a_tip", 2); }));
  CHECK(eventually([&] { return is_at(b, "b_base", "b_tip", 2); }));
}

TEST_CASE("publish: sent values arrive although the client ends at once") {
  const Join join = joined_by(GENERATE(from_range(testing::networks())));
  Node a = open_with_tip(join, "a");
  for (int run = 1; run <= 10; ++run) {
    INFO("run " << run);
    {
      auto client = Client::open(join("")).value();
      REQUIRE(outcome(client.publish({{"a_tip", along_x(run)}})) == "ok");
    }
    // The value has arrived when the client has ended; the owner may still have to apply it.
    CHECK(eventually([&] { return is_at(a, "a_base", "a_tip", run); }));
  }
}

TEST_CASE("flush: succeeds when all owners have acknowledged") {
  const Join join = joined_by(GENERATE(from_range(testing::networks())));
  Node a = open_with_tip(join, "a");
  auto client = Client::open(join("")).value();
  CHECK(outcome(client.flush(Milliseconds(0))) == "ok");
  REQUIRE(outcome(client.publish({{"a_tip", along_x(1)}})) == "ok");
  CHECK(outcome(client.flush(Milliseconds(5000))) == "ok");
  CHECK(eventually([&] { return is_at(a, "a_base", "a_tip", 1); }));
  CHECK(outcome(client.flush(Milliseconds::max())) == "ok");
}

}  // namespace tfdude
