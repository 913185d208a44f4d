// Lookups that wait for frames or samples.

#include <algorithm>
#include <atomic>
#include <chrono>
#include <filesystem>
#include <future>
#include <iterator>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <type_traits>
#include <vector>

#include "tfdude/client/client.hpp"
#include "tfdude/client/node.hpp"
#include "tfdude/transport/loopback.hpp"

#include "support/catch.hpp"
#include "support/forest_support.hpp"
#include "support/joint_frames.hpp"
#include "support/process.hpp"
#include "support/relay.hpp"
#include "transport/port.hpp"

namespace tfdude {
namespace {

using namespace std::chrono_literals;
using testing::along_x;
using testing::Approx;
using testing::ContainsSubstring;
using testing::eventually;
using testing::outcome;
using Clock = std::chrono::steady_clock;

static_assert(!std::is_copy_constructible_v<PendingLookup>);
static_assert(!std::is_copy_assignable_v<PendingLookup>);
static_assert(std::is_nothrow_move_constructible_v<PendingLookup>);

constexpr Milliseconds kForEver = Milliseconds::max();

Query at(std::int64_t milliseconds) { return {Time(Milliseconds(milliseconds)), 0ns, {}}; }

std::size_t threads() {
  const std::filesystem::directory_iterator all("/proc/self/task");
  return static_cast<std::size_t>(std::distance(begin(all), end(all)));
}

/// The shortest time of several runs, because any run may take longer on a busy machine.
template <class Action>
Clock::duration quickest(Action action) {
  auto best = Clock::duration::max();
  for (int i = 0; i < 5; ++i) {
    const auto start = Clock::now();
    action();
    best = std::min(best, Clock::now() - start);
  }
  return best;
}

/// Requests may get lost, and are counted; the others may not all have been discovered.
class Deaf final : public testing::Relay {
 public:
  using Relay::Relay;
  using Relay::send;

  Result<void> send(const std::string& partition, const Request& request,
                    Deadline deadline) override {
    ++requests;
    return deaf ? Result<void>() : Relay::send(partition, request, deadline);
  }
  bool discovered() const override { return met_all; }

  std::atomic<bool> deaf{false};
  std::atomic<bool> met_all{true};
  std::atomic<int> requests{0};
};

/// world and base here; arm, hand and finger in a partition of their own; a client without frames.
struct Robot {
  explicit Robot(const Options& options = {}) {
    base.emplace(*Node::open(network.join(), "base", {{"world", "", {}}, {"base", "world", {}}}));
    arm.emplace(
        *Node::open(network.join(), "arm",
                    {{"arm", "base", {}},
                     {"hand", "arm", {}},
                     testing::moved_by("finger", "hand", testing::revolute_named("bend"))}));
    auto transport = std::make_unique<Deaf>(network.join());
    ear = transport.get();
    client.emplace(*Client::open(std::move(transport), options));
  }
  LoopbackNetwork network;
  std::optional<Node> base;
  std::optional<Node> arm;
  Deaf* ear = nullptr;
  std::optional<Client> client;
};

}  // namespace

TEST_CASE("lookups: a thousand waiting lookups need one thread and all are answered") {
  Robot robot;
  const std::size_t before = threads();
  std::vector<std::future<Result<StampedTransform>>> futures;
  std::vector<PendingLookup> pending;
  std::atomic<int> called{0};
  for (int i = 0; i < 500; ++i) {
    futures.push_back(robot.client->lookup_async("world", "later", {}, kForEver));
    pending.push_back(
        robot.client->lookup_async("later", "world", {}, kForEver, [&](const auto& X) {
          if (X) ++called;
        }));
  }
  CHECK(threads() <= before + 1);
  CHECK(futures.front().wait_for(20ms) == std::future_status::timeout);
  REQUIRE(robot.arm->add("later", "hand", along_x(1)));
  for (auto& future : futures) REQUIRE(future.get());
  CHECK(eventually([&] { return called == 500; }));
  // Besides those that call back, and that pass the memory of the owners that have answered.
  CHECK(eventually([&] { return threads() <= before + 6; }));
}

TEST_CASE("lookups: a write of the own process answers a waiting lookup") {
  Robot robot;
  REQUIRE(robot.base->update("base", along_x(1), Time(1s)));
  auto own = robot.base->lookup_async("world", "base", at(2000), kForEver);
  CHECK(own.wait_for(20ms) == std::future_status::timeout);
  REQUIRE(robot.base->update("base", along_x(3), Time(3s)));
  CHECK(own.get()->pose.translation().x() == Approx(2));
}

TEST_CASE("lookups: an owner without the requested sample is asked less and less often") {
  Robot robot;
  REQUIRE(robot.arm->update("arm", along_x(1), Time(1s)));
  REQUIRE(robot.arm->update("hand", along_x(1), Time(1s)));
  const int before = robot.ear->requests;
  CHECK(outcome(robot.client->lookup("arm", "hand", at(2000), 1000ms)) == "not_yet");
  // Every 1 ms at first and every 50 ms at last. A request is repeated if its reply is late.
  const int asked = robot.ear->requests - before;
  CHECK(asked > 10);
  CHECK(asked < 100);
  auto later = robot.client->lookup_async("arm", "hand", at(2000), kForEver);
  REQUIRE(robot.arm->update("hand", along_x(3), Time(3s)));
  CHECK(later.get()->pose.translation().x() == Approx(2));
}

TEST_CASE("lookups: owners are asked again for the instant that another owner determined") {
  Robot robot;
  auto transport = std::make_unique<Deaf>(robot.network.join());
  Deaf& ear = *transport;
  Node tool = *Node::open(std::move(transport), "tool", {{"tool", "arm", {}}});
  // The arm has nothing as new as what the tool has, and the tool nothing as old.
  REQUIRE(robot.arm->update("arm", along_x(1), Time(90s)));
  REQUIRE(tool.update("tool", along_x(1), Time(100s)));
  const int before = ear.requests;
  auto found = tool.lookup_async("base", "tool", {}, kForEver);
  // Own commits do not make it ask more often.
  const auto until = Clock::now() + 300ms;
  Time newest(100s);
  while (Clock::now() < until) {
    newest += 10us;
    REQUIRE(tool.update("tool", along_x(1), newest));
  }
  CHECK(ear.requests - before > 3);
  CHECK(ear.requests - before < 100);
  REQUIRE(robot.arm->update("arm", along_x(2), newest));
  REQUIRE(found.wait_for(10s) == std::future_status::ready);
  CHECK(outcome(found.get()) == "ok");
}

TEST_CASE("lookups: a lookup ends at its maximum wait although an owner does not respond") {
  Options options;
  options.timeout = Milliseconds(20000);
  Robot robot(options);
  robot.ear->deaf = true;
  Result<StampedTransform> found;
  CHECK(quickest([&] {
          found = robot.client->lookup("world", "hand", {}, 50ms);
          REQUIRE(outcome(found) == "timeout");
        }) < 70ms);
  CHECK_THAT(found.error().message, ContainsSubstring("partition 'arm' did not answer") ||
                                        ContainsSubstring("partition 'base' did not answer"));
  CHECK_THAT(found.error().message, ContainsSubstring("within 50 ms"));
  CHECK(quickest([&] {
          found = robot.client->lookup_async("world", "hand", {}, 50ms).get();
          REQUIRE(outcome(found) == "timeout");
        }) < 70ms);
  CHECK_THAT(found.error().message, ContainsSubstring("did not answer within 50 ms"));
  // Also if the wait is longer than the time-out of one request.
  options.timeout = Milliseconds(20);
  Robot hasty(options);
  hasty.ear->deaf = true;
  CHECK(quickest([&] {
          REQUIRE(outcome(hasty.client->lookup("world", "hand", {}, 70ms)) == "timeout");
        }) < 90ms);
  auto waits = hasty.client->lookup_async("world", "hand", {}, kForEver);
  CHECK(waits.wait_for(50ms) == std::future_status::timeout);
  hasty.ear->deaf = false;
  CHECK(waits.get());
}

TEST_CASE("lookups: a frame is not called unknown before all participants are discovered") {
  Robot robot;
  robot.ear->met_all = false;
  Result<StampedTransform> found;
  CHECK(quickest([&] {
          found = robot.client->lookup("world", "nobody", {}, 50ms);
          REQUIRE(outcome(found) == "timeout");
        }) < 70ms);
  CHECK_THAT(found.error().message, ContainsSubstring("'nobody'"));
  CHECK_THAT(found.error().message, ContainsSubstring("50 ms"));
  CHECK(outcome(robot.client->lookup_async("world", "nobody", {}, 50ms).get()) == "timeout");
  CHECK(outcome(robot.client->lookup("world", "hand", {}, 2000ms)) == "ok");
  robot.ear->met_all = true;
  CHECK(outcome(robot.client->lookup("world", "nobody", {}, 50ms)) == "unknown_end");
}

TEST_CASE("lookups: one without a wait asks once, and waits for nothing that is missing") {
  Robot robot;
  const auto now = [&](const char* b) {
    const auto begin = Clock::now();
    auto answer = robot.client->lookup_async("world", b, {}, 0ms).get();
    CHECK(Clock::now() - begin < 900ms);
    return outcome(answer);
  };
  CHECK(now("hand") == "ok");
  CHECK(now("nobody") == "unknown_end");
  Query future;
  future.at = time_of(INT64_MAX / 2);
  REQUIRE(robot.arm->update("hand", {}, time_of(1)));
  CHECK(outcome(robot.client->lookup_async("world", "hand", future, 0ms).get()) == "not_yet");
  // Frames that others may still announce are not called unknown.
  Robot fresh;
  fresh.ear->met_all = false;
  auto early = fresh.client->lookup_async("world", "nobody", {}, 0ms);
  CHECK(early.wait_for(50ms) == std::future_status::timeout);
  fresh.ear->met_all = true;
  CHECK(outcome(early.get()) == "unknown_end");
}

TEST_CASE("lookups: every call without a wait times out and never reports unknown too early") {
  Options options;
  options.timeout = Milliseconds(50);
  options.discovery = Milliseconds(0);
  const std::vector<PartialUpdate> raised{{"hand", {Eigen::Vector3d(0, 0, 1)}}};
  const auto of_new_client = [&](bool met_all, auto call) {
    std::string what;
    auto best = Clock::duration::max();
    // The computer may be busy, so only the fastest try counts.
    for (int i = 0; i < 10 && best >= 70ms; ++i) {
      Robot robot(options);
      robot.ear->met_all = met_all;
      robot.ear->deaf = true;
      const auto start = Clock::now();
      what = outcome(call(*robot.client));
      best = std::min(best, Clock::now() - start);
    }
    return best < 70ms ? what : what + ", late";
  };
  const auto early = [&](auto call) { return of_new_client(false, call); };
  CHECK(early([](Client& c) { return c.lookup("world", "nobody"); }) == "timeout");
  CHECK(early([](Client& c) { return c.find("nobody"); }) == "timeout");
  CHECK(early([](Client& c) { return c.frames(); }) == "timeout");
  CHECK(early([](Client& c) { return c.partitions(); }) == "timeout");
  CHECK(early([](Client& c) { return c.roots(); }) == "timeout");
  CHECK(early([](Client& c) { return c.children("world"); }) == "timeout");
  CHECK(early([](Client& c) { return c.remove("world"); }) == "timeout");
  CHECK(early([](Client& c) { return c.forget("arm"); }) == "timeout");
  CHECK(early([](Client& c) { return c.watch("world", "nobody"); }) == "timeout");
  CHECK(early([](Client& c) { return c.add("nobody", "nowhere", {}); }) == "timeout");
  CHECK(early([](Client& c) { return c.correlate("nobody", {}); }) == "timeout");
  CHECK(early([](Client& c) { return c.update_joints({"nobody"}, {1}, {0}); }) == "timeout");
  CHECK(early([](Client& c) { return c.joints("nowhere"); }) == "timeout");
  CHECK(early([](Client& c) { return c.history("nobody"); }) == "timeout");
  CHECK(early([](Client& c) { return c.histories("nowhere"); }) == "timeout");
  CHECK(early([&](Client& c) { return c.update_partial(raised); }) == "timeout");
  // One pair is not known to exist, and the owner of the other does not answer.
  CHECK(early([](Client& c) {
          return c.lookup_many("world", {"nobody", "hand"})[1];
        }) == "timeout");
  const auto deaf = [&](auto call) { return of_new_client(true, call); };
  CHECK(deaf([](Client& c) { return c.lookup_many("world", {"nobody", "hand"})[1]; }) == "timeout");
  CHECK(deaf([](Client& c) { return c.lookup_many("world", {"hand"}, {}, 50ms)[0]; }) == "timeout");
  CHECK(deaf([](Client& c) {
          const Explanation why = c.why("world", "hand", {});
          REQUIRE(why.cause);
          CHECK(why.cause->obstacle == Obstacle::kOwnerSilent);
          return Result<void>(tl::unexpected(why.cause->error));
        }) == "timeout");
  CHECK(deaf([](Client& c) { return c.lookup("world", "hand"); }) == "timeout");
  CHECK(deaf([](Client& c) { return c.update("hand", {}); }) == "timeout");
  CHECK(deaf([](Client& c) { return c.move("hand", "base"); }) == "timeout");
  CHECK(deaf([](Client& c) { return c.observe("world", "hand", {}); }) == "timeout");
  CHECK(deaf([](Client& c) { return c.fuse("hand", {}); }) == "timeout");
  CHECK(deaf([](Client& c) { return c.watch("world", "hand"); }) == "timeout");
  CHECK(deaf([](Client& c) { return c.add("tool", "hand", {}); }) == "timeout");
  CHECK(deaf([](Client& c) { return c.correlate("hand", {}); }) == "timeout");
  CHECK(deaf([](Client& c) { return c.update_joints({"bend"}, {1}, {0}); }) == "timeout");
  CHECK(deaf([](Client& c) { return c.joints("arm"); }) == "timeout");
  CHECK(deaf([](Client& c) { return c.history("hand"); }) == "timeout");
  CHECK(deaf([](Client& c) { return c.histories("arm"); }) == "timeout");
  CHECK(deaf([&](Client& c) { return c.update_partial(raised); }) == "timeout");
  CHECK(deaf([](Client& c) { return c.lookup("world", Query{}, "hand", Query{}, "arm"); }) ==
        "timeout");
  // Three time-outs after the start, the client answers from what it knows.
  Robot robot(options);
  robot.ear->met_all = false;
  CHECK_FALSE(robot.client->exists("nobody"));
  CHECK(eventually([&] { return outcome(robot.client->frames()) == "ok"; }));
  CHECK(outcome(robot.client->lookup("world", "nobody")) == "unknown_end");
}

TEST_CASE("lookups: cancelling takes no time and the callback does not run") {
  Robot robot;
  robot.ear->deaf = true;
  std::atomic<int> called{0};
  for (const char* frame : {"nobody", "hand"}) {
    CHECK(quickest([&] {
            auto pending = robot.client->lookup_async("world", frame, {}, kForEver,
                                                      [&](const auto&) { ++called; });
            pending.cancel();
          }) < 20ms);
  }
  robot.ear->deaf = false;
  REQUIRE(robot.arm->add("nobody", "hand", {}));
  REQUIRE(robot.client->lookup_async("world", "nobody", {}, kForEver).get());
  CHECK(called == 0);
}

TEST_CASE("lookups: a slow callback does not delay other lookups") {
  Robot robot;
  std::promise<void> held;
  const auto until = held.get_future().share();
  std::atomic<int> slow{0};
  std::vector<PendingLookup> pending;
  for (int i = 0; i < 3; ++i) {
    pending.push_back(robot.client->lookup_async("world", "hand", {}, kForEver, [&](const auto&) {
      ++slow;
      until.wait();
    }));
  }
  REQUIRE(eventually([&] { return slow == 3; }));
  CHECK(robot.client->lookup_async("world", "hand", {}, kForEver).get());
  std::promise<void> quick;
  pending.push_back(robot.client->lookup_async("world", "hand", {}, kForEver,
                                               [&](const auto&) { quick.set_value(); }));
  CHECK(quick.get_future().wait_for(20s) == std::future_status::ready);
  held.set_value();
}

TEST_CASE("lookups: a handle of one client is invalid for another") {
  Robot robot;
  for (Client* client : std::vector<Client*>{&*robot.base, &*robot.arm, &*robot.client}) {
    for (Client* other : std::vector<Client*>{&*robot.base, &*robot.arm, &*robot.client}) {
      if (client == other) continue;
      const auto frames = client->frames().value();
      for (const Frame& frame : frames) {
        const Handle own = *client->find(frame.id);
        const Handle world = *other->find("world");
        CHECK(outcome(client->lookup(own, own)) == "ok");
        CHECK(outcome(other->lookup(own, world)) == "unknown_start");
        CHECK(outcome(other->lookup(world, own)) == "unknown_end");
        CHECK(outcome(other->lookup(own, world, Query{})) == "unknown_start");
        CHECK(outcome(other->lookup_pose(own, world)) == "unknown_start");
        CHECK(outcome(other->update(own, {})) == "unknown_frame");
        CHECK(outcome(other->update({HandleUpdate{own, {}}})) == "unknown_frame");
      }
    }
  }
}

}  // namespace tfdude
