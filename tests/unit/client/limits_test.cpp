// The limits of what others can make a Node keep.

#include <chrono>
#include <string>
#include <vector>

#include "tfdude/client/node.hpp"
#include "tfdude/client/watch.hpp"
#include "tfdude/transport/loopback.hpp"

#include "support/catch.hpp"

namespace tfdude {
namespace {

using testing::ContainsSubstring;

Time at(int milliseconds) { return Time(std::chrono::milliseconds(1'000'000 + milliseconds)); }

struct Pair {
  explicit Pair(const PartitionLimits& limits) {
    Options options;
    options.limits = limits;
    node.emplace(*Node::open(network.join(), "arm",
                             {{"root", "", {}}, {"a", "root", {}}, {"b", "root", {}}}, options));
    client.emplace(*Client::open(network.join(), options));
  }

  LoopbackNetwork network;
  std::optional<Node> node;
  std::optional<Client> client;
};

TEST_CASE("limits: no more frames than allowed are added, and those that are there stay") {
  PartitionLimits limits;
  limits.frames = 4;
  Pair pair(limits);
  CHECK(pair.client->add("c", "root", {}));
  const auto refused = pair.client->add("d", "root", {});
  REQUIRE_FALSE(refused);
  CHECK(refused.error().code == Errc::kTooMuch);
  CHECK_THAT(refused.error().message,
             ContainsSubstring("'d'") && ContainsSubstring("'arm'") && ContainsSubstring("4"));
  CHECK(pair.node->refused().frames == 1);
  CHECK(pair.client->remove("c"));
  CHECK(pair.client->add("d", "root", {}));
  CHECK(pair.client->lookup("root", "d"));
}

TEST_CASE("limits: no more groups of watchers than allowed") {
  PartitionLimits limits;
  limits.watches = 1;
  Pair pair(limits);
  const auto first = pair.client->watch("root", "a");
  REQUIRE(first);
  const auto same = pair.client->watch("root", "a");
  CHECK(same);
  const auto other = pair.client->watch("root", "b");
  REQUIRE_FALSE(other);
  CHECK(other.error().code == Errc::kTooMuch);
  CHECK_THAT(other.error().message, ContainsSubstring("'arm'"));
  CHECK(pair.node->refused().watches > 0);
  CHECK(first->lookup(Query{}));
}

TEST_CASE("limits: the memory of histories is limited, and a dynamic edge goes on") {
  PartitionLimits limits;
  limits.history_bytes = 20'000;
  Pair pair(limits);
  int samples = 0;
  for (; samples < 200; ++samples) {
    REQUIRE(pair.client->update("a", {}, at(samples)));
  }
  const auto history = pair.client->history("a");
  REQUIRE(history);
  CHECK(history->at(0).samples < 100);
  CHECK(history->at(0).samples >= 2);
  const auto refused = pair.client->update("b", {}, at(0));
  REQUIRE_FALSE(refused);
  CHECK(refused.error().code == Errc::kTooMuch);
  CHECK_THAT(refused.error().message, ContainsSubstring("'b'"));
  CHECK(pair.node->refused().samples == 1);
  CHECK(pair.client->update("b", {}));  // a value for all times needs no history
  CHECK(pair.client->update("a", {}, at(samples)));
}

}  // namespace
}  // namespace tfdude
