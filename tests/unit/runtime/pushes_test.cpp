#include "runtime/pushes.hpp"

#include <chrono>
#include <map>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "base/loop.hpp"
#include "support/catch.hpp"
#include "support/forest_support.hpp"
#include "support/process.hpp"

namespace tfdude {
namespace {

using namespace std::chrono_literals;
using testing::along_x;
using testing::eventually;
using testing::outcome;

Time ms(std::int64_t milliseconds) { return Time(Milliseconds(milliseconds)); }

const PathEnds kArm{"base", "arm"};
const PathEnds kHand{"arm", "hand"};

// An owner of two frames, and all that it pushed.
struct PushingOwner final : Pushes::Sink {
  PushingOwner() {
    REQUIRE(forest.add("base", "", along_x(0)));
    REQUIRE(forest.add("arm", "base", along_x(0)));
    REQUIRE(forest.add("hand", "arm", along_x(0)));
  }
  void push(const PushedValues& values) override {
    const std::lock_guard lock(mutex);
    open.insert(values.group);
    for (const PushedValue& entry : values.entries) pushed[values.group].push_back(entry.stamp);
  }
  std::size_t count(std::uint64_t group) {
    const std::lock_guard lock(mutex);
    return pushed[group].size();
  }

  Forest forest;
  std::mutex mutex;
  std::map<std::uint64_t, std::vector<std::optional<Time>>> pushed;
  std::set<std::uint64_t> open;  // groups for which the transport would have a writer
  std::set<std::uint64_t> writers() {
    const std::lock_guard lock(mutex);
    return open;
  }
  void end(std::uint64_t group) override {
    const std::lock_guard lock(mutex);
    open.erase(group);
  }
  void wake() override { job.ask(); }
  ~PushingOwner() override { pusher.stop(); }
  Loop loop{"push"};
  Pushes pusher{forest, 1000, *this};
  Loop::Job job{loop, [this] { return pusher.run(); }};
};

}  // namespace

// Each group costs a DDS writer, which all participants discover.
TEST_CASE("pushes: one watcher cannot begin groups without end, others still can") {
  PushingOwner owner;
  const PeerId greedy{1};
  const PeerId honest{2};
  std::size_t begun = 0;
  std::string why;
  const auto start = Pushes::Clock::now();
  for (std::uint64_t group = 1; group <= 1000; ++group) {
    const auto watched = owner.pusher.watch(group, {{kHand}}, greedy);
    begun += watched ? 1U : 0U;
    if (!watched) why = watched.error().message;
    if (!watched) CHECK(watched.error().code == Errc::kTooMuch);
  }
  const std::chrono::duration<double> time = Pushes::Clock::now() - start;
  CHECK(begun >= static_cast<std::size_t>(Pushes::kNewAtOnce));
  CHECK(static_cast<double>(begun) <=
        Pushes::kNewAtOnce + 1 + time.count() * Pushes::kNewPerSecond);
  CHECK(begun <= 500);
  CHECK(why.find("this participant") != std::string::npos);
  CHECK(owner.pusher.refused() == 1000 - begun);
  CHECK(owner.pusher.watch(1, {{kHand}}, greedy));     // renewed
  CHECK(owner.pusher.watch(5000, {{kHand}}, honest));  // another one
  CHECK(owner.pusher.watch(5001, {{kHand}}));          // this process
}

TEST_CASE("pushes: the edges of all groups together are bounded") {
  PushingOwner owner;
  std::size_t edges = 0;
  bool refused = false;
  for (std::uint64_t group = 1; group <= 100 && !refused; ++group) {
    const WatchRequest request{std::vector<PathEnds>(kMaxItems, kHand)};
    const auto watched = owner.pusher.watch(group, request);
    if (watched) edges += kMaxItems;
    refused = !watched && watched.error().code == Errc::kTooMuch;
  }
  CHECK(refused);
  CHECK(edges <= Pushes::kMostEdges);
  CHECK(edges > Pushes::kMostEdges / 2);
}

TEST_CASE("pushes: every sample of a watched edge is pushed and nothing of other edges") {
  PushingOwner owner;
  for (int t = 1; t <= 100; ++t) REQUIRE(owner.forest.update("hand", along_x(t), ms(t)));
  REQUIRE(owner.pusher.watch(1, {{kHand}}));
  // Only the newest: nobody watched when the earlier ones were written.
  REQUIRE(eventually([&] { return owner.count(1) == 1; }));
  CHECK(owner.pushed[1].at(0) == ms(100));
  for (int t = 101; t <= 200; ++t) REQUIRE(owner.forest.update("hand", along_x(t), ms(t)));
  REQUIRE(owner.forest.update("arm", along_x(1), ms(1)));
  REQUIRE(eventually([&] { return owner.count(1) == 101; }));
  const auto stamps = owner.pushed[1];
  for (std::size_t i = 0; i < stamps.size(); ++i) {
    CHECK(stamps[i] == ms(100 + static_cast<std::int64_t>(i)));
  }
  CHECK(owner.pushed.size() == 1);
  REQUIRE(owner.pusher.watch(2, {{kArm}}));
  REQUIRE(eventually([&] { return owner.count(2) == 1; }));
  CHECK(owner.count(1) == 101);
}

TEST_CASE("pushes: a group is pushed no faster than its rate and ends with the newest sample") {
  PushingOwner owner;
  REQUIRE(owner.pusher.watch(1, {{kHand}, false, false, 50ms}));
  REQUIRE(eventually([&] { return owner.count(1) == 1; }));
  const auto start = std::chrono::steady_clock::now();
  std::int64_t t = 0;
  while (std::chrono::steady_clock::now() - start < 300ms) {
    REQUIRE(owner.forest.update("hand", along_x(1), ms(++t)));
    std::this_thread::sleep_for(1ms);
  }
  REQUIRE(eventually([&] {
    const std::lock_guard lock(owner.mutex);
    return owner.pushed[1].back() == ms(t);
  }));
  const auto over = std::chrono::steady_clock::now() - start;
  CHECK(owner.count(1) <= static_cast<std::size_t>(over / 50ms) + 3);
}

TEST_CASE("pushes: a watch of an edge that is not owned is rejected and opens no group") {
  PushingOwner owner;
  CHECK(outcome(owner.pusher.watch(1, {{{"arm", "nobody"}}})) == "not_owner");
  REQUIRE(owner.forest.update("hand", along_x(1), ms(1)));
  REQUIRE(owner.pusher.watch(2, {{kHand}}));
  REQUIRE(eventually([&] { return owner.count(2) == 1; }));
  CHECK(owner.count(1) == 0);
}

TEST_CASE("pushes: a group ends with its frame even while it is being pushed to") {
  PushingOwner owner;
  for (int i = 0; i < 100; ++i) {
    REQUIRE(owner.pusher.watch(1, {{kHand}}));
    if (i % 2 == 0) REQUIRE(eventually([&] { return owner.writers().count(1) == 1; }));
    REQUIRE(owner.forest.remove("hand"));
    CHECK(outcome(owner.pusher.watch(1, {{kHand}})) == "not_owner");
    REQUIRE(eventually([&] { return owner.writers().empty(); }));
    REQUIRE(owner.forest.add("hand", "arm", along_x(0)));
  }
}

TEST_CASE("pushes: no writer is left of a thousand groups that nobody renews") {
  PushingOwner owner;
  for (std::uint64_t group = 1; group <= 1000; ++group) {
    REQUIRE(owner.pusher.watch(group, {{kHand}}));
  }
  REQUIRE(eventually([&] { return owner.writers().size() > 500; }));
  REQUIRE(eventually([&] { return owner.writers().empty(); }));
}

TEST_CASE("pushes: a watcher that matches late gets all values again") {
  PushingOwner owner;
  REQUIRE(owner.pusher.watch(1, {{kArm, kHand}}));
  REQUIRE(eventually([&] { return owner.count(1) == 2; }));
  owner.pusher.tell_all(1);
  owner.pusher.tell_all(2);  // a group that does not exist
  REQUIRE(eventually([&] { return owner.count(1) == 4; }));
  CHECK(owner.count(2) == 0);
}

TEST_CASE("pushes: a period above the maximum is rejected") {
  PushingOwner owner;
  CHECK(outcome(owner.pusher.watch(1, {{kHand}, false, false, std::chrono::nanoseconds::max()})) ==
        "invalid_input");
  REQUIRE(owner.pusher.watch(1, {{kHand}, false, false, kMaxWatchPeriod}));
  REQUIRE(eventually([&] { return owner.count(1) == 1; }));
}

TEST_CASE("pushes: what was written before histories are cleared is pushed, too") {
  struct Stamps final : Pushes::Sink {
    void push(const PushedValues& values) override {
      for (const PushedValue& entry : values.entries) {
        if (entry.stamp) all.push_back(*entry.stamp);
      }
    }
    void end(std::uint64_t) override {}
    void wake() override {}
    std::vector<Time> all;
  } sink;
  Forest forest;
  REQUIRE(forest.add("base", "", along_x(0)));
  REQUIRE(forest.add("arm", "base", along_x(0)));
  Pushes pushes(forest, 10, sink);
  const auto rounds = GENERATE(1, 3);
  REQUIRE(pushes.watch(1, {{kArm}}));
  REQUIRE(pushes.watch(2, {{kArm}, false, false, 1h}));
  (void)pushes.run();
  std::vector<Time> expected;
  for (int round = 0; round < rounds; ++round) {
    for (const int at : {10, 20, 30}) {
      REQUIRE(forest.update("arm", along_x(at + round), ms(at + round)));
      expected.push_back(ms(at + round));
    }
    pushes.keep_pending();
    CHECK(forest.clear_histories(ms(0)) == 1);
  }
  (void)pushes.run();
  CHECK(sink.all == expected);
  pushes.stop();
}

}  // namespace tfdude
