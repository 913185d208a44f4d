// The limits of what others can make a Node keep.

#include <chrono>
#include <string>
#include <vector>

#include "tfdude/client/node.hpp"
#include "tfdude/client/watch.hpp"
#include "tfdude/transport/loopback.hpp"

#include "support/captured_log.hpp"
#include "support/catch.hpp"

namespace tfdude {
namespace {

using testing::ContainsSubstring;

Time at(int milliseconds) { return Time(std::chrono::milliseconds(1'000'000 + milliseconds)); }

struct Pair {
  explicit Pair(const PartitionLimits& limits, bool shared_memory = true) {
    Options common;
    common.shared_memory = shared_memory;
    NodeOptions options = common;
    options.limits = limits;
    node.emplace(*Node::open(network.join(), "arm",
                             {{"root", "", {}}, {"a", "root", {}}, {"b", "root", {}}}, options));
    client.emplace(*Client::open(network.join(), common));
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
  // Nothing is pushed to watchers that read memory.
  Pair pair(limits, false);
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

TEST_CASE("limits: the oldest samples of all histories make room for new ones") {
  PartitionLimits limits;
  limits.history_bytes = 20'000;
  Pair pair(limits);
  const testing::CapturedLog log;
  const auto samples_of = [&](const char* frame) {
    return pair.client->history(frame)->at(0).samples;
  };
  for (int i = 0; i < 400; ++i) REQUIRE(pair.client->update("a", {}, at(i)));
  const std::size_t alone = samples_of("a");
  CHECK(alone > 100);
  CHECK(alone < 250);
  // The samples of the other edge are newer.
  for (int i = 400; i < 500; ++i) REQUIRE(pair.client->update("b", {}, at(i)));
  CHECK(samples_of("b") == 100);
  CHECK(samples_of("a") < alone - 50);
  for (int i = 500; i < 900; ++i) REQUIRE(pair.client->update("b", {}, at(i)));
  CHECK(samples_of("a") == 2);
  CHECK(pair.client->lookup("root", "a")->pose.translation().x() == 0);
  CHECK(pair.node->refused().dropped_samples == 400 + 500 - 2 - samples_of("b"));
  CHECK(log.count("--max-history") == 1);
  CHECK_THAT(log.text(), ContainsSubstring("'arm'") && ContainsSubstring("20000 bytes"));
}

}  // namespace
}  // namespace tfdude
