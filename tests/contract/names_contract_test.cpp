// Which process serves a name, what others hear of partitions that end, and what happens to their
// frames, over each transport.

#include <algorithm>
#include <array>
#include <atomic>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "tfdude/client/client.hpp"
#include "tfdude/client/node.hpp"

#include "support/catch.hpp"
#include "support/networks.hpp"

namespace tfdude {
namespace {

using testing::Join;
using testing::joined_by;
using Clock = std::chrono::steady_clock;

constexpr std::chrono::seconds kLong{20};

template <class Condition>
bool comes(Condition condition) {
  const auto end = Clock::now() + kLong;
  while (!condition()) {
    if (Clock::now() > end) return false;
    std::this_thread::sleep_for(Milliseconds(2));
  }
  return true;
}

std::string owner_of(Client& client, const std::string& id) {
  const auto frames = client.frames();
  for (const Frame& frame : frames.value()) {
    if (frame.id == id) return frame.partition;
  }
  return "nobody";
}

PartitionInfo info_of(Client& client, const std::string& name) {
  const auto partitions = client.partitions();
  for (const PartitionInfo& one : partitions.value()) {
    if (one.name == name) return one;
  }
  return {};
}

}  // namespace

// How many owners serve a name that two claim at the same time.
std::size_t served(const Join& join, const std::string& name) {
  std::array<std::optional<Node>, 2> nodes;
  std::atomic<int> ready{0};
  const auto claim = [&](std::size_t which) {
    ++ready;
    while (ready < 2) std::this_thread::yield();
    auto opened = Node::open(join(name), name, {});
    if (opened) nodes[which].emplace(*std::move(opened));
  };
  std::thread other([&] { claim(1); });
  claim(0);
  other.join();
  return std::size_t{nodes[0].has_value()} + std::size_t{nodes[1].has_value()};
}

// An owner that does not get the name waits for 1.5 s. So many pairs try at the same time; within
// one process each pair has its own network.
TEST_CASE("of two processes that claim a name at once exactly one serves it") {
  const int transport = GENERATE(from_range(testing::networks()));
  const int beside = transport == 0 ? 50 : 2;
  const int tries = transport == 0 ? 20 : 5;
  const Join shared = joined_by(transport);
  std::map<std::size_t, int> counts;
  std::mutex mutex;
  std::vector<std::thread> threads;
  for (int thread = 0; thread < beside; ++thread) {
    threads.emplace_back([&, thread] {
      const Join join = transport == 0 ? joined_by(0) : shared;
      for (int round = 0; round < tries; ++round) {
        const std::size_t serve = served(join, "arms_" + std::to_string(thread * tries + round));
        const std::lock_guard lock(mutex);
        ++counts[serve];
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  CHECK(counts == std::map<std::size_t, int>{{1, beside * tries}});
}

TEST_CASE("a stopped partition is reported as stopped and another can take over its frames") {
  const Join join = joined_by(GENERATE(from_range(testing::networks())));
  Node base = Node::open(join("base"), "base", {{"world", "", {}}}).value();
  Client client = Client::open(join("")).value();
  std::mutex mutex;
  std::vector<Change> heard;
  Subscription subscription = client.on_change([&](const Change& change) {
    const std::lock_guard lock(mutex);
    heard.push_back(change);
  });
  {
    Node arm = Node::open(join("arm"), "arm", {{"hand", "world", {}}}).value();
    REQUIRE(comes([&] { return owner_of(client, "hand") == "arm"; }));
  }
  REQUIRE(comes([&] { return !info_of(client, "arm").reachable; }));
  CHECK(info_of(client, "arm").stopped);
  const auto unreachable = client.lookup("world", "hand");
  REQUIRE_FALSE(unreachable);
  CHECK(unreachable.error().code == Errc::kUnreachable);
  CHECK_THAT(unreachable.error().message, testing::ContainsSubstring("it was stopped"));
  Node left = Node::open(join("left_arm"), "left_arm", {{"hand", "world", {}}}).value();
  CHECK(comes([&] { return owner_of(client, "hand") == "left_arm"; }));
  CHECK(comes([&] { return owner_of(base, "hand") == "left_arm"; }));
  CHECK(client.lookup("world", "hand"));
  const auto told = [&](ChangeKind kind, const std::string& partition) {
    const std::lock_guard lock(mutex);
    return std::any_of(heard.begin(), heard.end(), [&](const Change& one) {
      return one.kind == kind && one.partition == partition &&
             (kind != ChangeKind::kPartitionDown || one.stopped);
    });
  };
  CHECK(comes([&] { return told(ChangeKind::kPartitionDown, "arm"); }));
  CHECK(comes([&] { return told(ChangeKind::kFrameTakenOver, "left_arm"); }));
}

TEST_CASE("a partition can be forgotten only when it is unreachable and then by all") {
  const Join join = joined_by(GENERATE(from_range(testing::networks())));
  Node base = Node::open(join("base"), "base", {{"world", "", {}}}).value();
  Node head = Node::open(join("head"), "head", {{"neck", "world", {}}}).value();
  Client client = Client::open(join("")).value();
  std::optional<Node> arm(Node::open(join("arm"), "arm", {{"hand", "world", {}}}).value());
  REQUIRE(comes([&] { return client.exists("hand"); }));
  REQUIRE(comes([&] { return client.exists("neck"); }));
  const auto refused = client.forget("arm");
  REQUIRE_FALSE(refused);
  CHECK(refused.error().code == Errc::kPartitionTaken);
  CHECK(client.exists("hand"));
  CHECK_FALSE(base.forget("base"));
  CHECK(client.forget("leg").error().code == Errc::kUnknownPartition);
  arm.reset();
  REQUIRE(comes([&] { return !info_of(client, "arm").reachable; }));
  REQUIRE(comes([&] { return !info_of(base, "arm").reachable; }));
  REQUIRE(comes([&] { return !info_of(head, "arm").reachable; }));
  const auto forgotten = client.forget("arm");
  INFO((forgotten ? "" : forgotten.error().message));
  REQUIRE(forgotten);
  for (Client* one : std::array<Client*, 3>{&base, &head, &client}) {
    CHECK(comes([&] { return !one->exists("hand"); }));
    CHECK(comes([&] { return info_of(*one, "arm").name.empty(); }));
  }
  // After a restart it is as new.
  arm.emplace(Node::open(join("arm"), "arm", {{"hand", "world", {}}}).value());
  CHECK(comes([&] { return owner_of(client, "hand") == "arm"; }));
  CHECK(comes([&] { return client.lookup("world", "hand").has_value(); }));
}

}  // namespace tfdude
