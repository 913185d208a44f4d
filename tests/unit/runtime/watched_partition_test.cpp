#include "runtime/watched_partition.hpp"

#include <chrono>
#include <functional>
#include <future>
#include <map>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "base/loop.hpp"
#include "partition/directory.hpp"
#include "support/catch.hpp"
#include "support/forest_support.hpp"
#include "support/process.hpp"
#include "tree/forest.hpp"

namespace tfdude {
namespace {

using namespace std::chrono_literals;
using testing::along_x;
using testing::eventually;

long ms(Time time) { return static_cast<long>(nanoseconds(time) / 1'000'000); }

// An owner, and a watch of its partition in the same process.
struct WatchedOwner {
  WatchedOwner() {
    REQUIRE(forest.add("base", "", {}));
    REQUIRE(forest.add("arm", "base", along_x(0)));
    REQUIRE(forest.update("arm", along_x(0), Time(1s)));
  }
  // A round of the watch, and the owner's side of the group that it asks for.
  WatchedGroup plan() {
    REQUIRE(watch.plan({forest, directory, 1}));
    const Watched::Plan plan = watch.adopt(now);
    REQUIRE(plan.groups.size() == 1);
    return {plan.groups[0].id, std::get<WatchRequest>(plan.groups[0].part.request.body)};
  }
  void answer(WatchedGroup& group) {
    const std::optional<Time> from = watch.lacks_from();
    const PushedValues all = group.snapshot(forest, from, true).value();
    group.begin(all);
    (void)watch.take(all, now);
    if (from) watch.on_told_from(*from, now);
  }
  // [ms]
  std::vector<long> told() {
    const std::lock_guard lock(mutex);
    return stamps;
  }

  bool has(std::uint32_t frame, long stamp) {
    const std::lock_guard lock(mutex);
    return values_at.count({frame, stamp}) > 0;
  }
  // What was told last.
  double told_at(std::uint32_t frame, long stamp) {
    const std::lock_guard lock(mutex);
    return values_at.at({frame, stamp});
  }

  Forest forest;
  Directory directory{forest, "arm"};
  Watched::Clock::time_point now{1h};
  std::function<void(const PartitionNews&)> heard;
  std::mutex mutex;
  std::vector<long> stamps;
  std::map<std::pair<std::uint32_t, long>, double> values_at;  // by frame and stamp [ms]
  Loop loop{"test"};
  Callbacks callbacks{loop};
  WatchedPartition watch{
      "arm", 0,
      [this](const PartitionNews& news) {
        if (heard) heard(news);
        const auto* values = std::get_if<ValuesNews>(&news.what);
        if (values == nullptr) return;
        const std::lock_guard lock(mutex);
        for (const WatchedValue& value : values->values) {
          if (!value.stamp) continue;
          stamps.push_back(ms(*value.stamp));
          values_at[{value.frame, ms(*value.stamp)}] = value.X_PC.pose.translation().x();
        }
      },
      callbacks.line()};
};

// While the frames change, the groups before and after are both pushed. If the machine is busy, a
// message has several samples.
TEST_CASE("watched partition: samples that two groups push are told once") {
  WatchedOwner owner;
  WatchedGroup before = owner.plan();
  owner.answer(before);
  (void)owner.watch.take(before.next_push(owner.forest), owner.now);
  REQUIRE(owner.forest.add("lamp", "arm", along_x(1)));
  WatchedGroup after = owner.plan();
  owner.answer(after);
  const bool settled = GENERATE(false, true);
  if (settled) owner.now += WatchedPartition::kSettle + 100ms;
  (void)owner.watch.groups(owner.now);
  std::vector<long> written{1000};
  const auto write = [&] {
    for (int i = 0; i < 3; ++i) {
      written.push_back(written.back() + 10);
      REQUIRE(owner.forest.update("arm", along_x(i), Time(Milliseconds(written.back()))));
    }
    const bool turned = GENERATE(false, true);
    WatchedGroup& first = turned ? after : before;
    WatchedGroup& second = turned ? before : after;
    (void)owner.watch.take(first.next_push(owner.forest), owner.now);
    (void)owner.watch.take(second.next_push(owner.forest), owner.now);
  };
  write();
  write();
  CHECK(eventually([&] { return owner.told().size() >= written.size(); }));
  // Only late ones are left to the group after.
  owner.now += WatchedPartition::kKeepBefore + WatchedPartition::kSettle;
  (void)owner.watch.groups(owner.now);
  REQUIRE(owner.forest.update("arm", along_x(9), Time(1s) + 5ms));
  (void)owner.watch.take(after.next_push(owner.forest), owner.now);
  written.push_back(1005);
  CHECK(eventually([&] { return owner.told().size() >= written.size(); }));
  CHECK(owner.told() == written);
}

// Answers and pushes come on different ways, and may overtake each other.
TEST_CASE("watched partition: an answer of before takes nothing back") {
  WatchedOwner owner;
  WatchedGroup group = owner.plan();
  owner.answer(group);
  (void)owner.watch.take(group.next_push(owner.forest), owner.now);
  REQUIRE(owner.watch.lacks_from() == Time(1s));
  REQUIRE(owner.forest.update("arm", along_x(1), Time(1s) + 10ms));
  REQUIRE(owner.forest.update("arm", along_x(2), Time(1s) + 20ms));
  const PushedValues before = group.snapshot(owner.forest, owner.watch.lacks_from(), true).value();
  // Two samples are corrected: the newest one, and a late one.
  Correlation seen{false, {{"observed:1", false, Loading::Ones(6, 1) * 1e-3}}, {"arm", "lamp"}};
  const auto correct = [&](Time at, double x) {
    REQUIRE(owner.forest.revise({{"arm", along_x(x), seen}}, at, UINT64_MAX));
  };
  correct(Time(1s) + 10ms, 1);
  correct(Time(1s) + 20ms, 2);
  (void)owner.watch.take(group.next_push(owner.forest), owner.now);
  CHECK(eventually([&] { return owner.told().size() >= 3; }));
  const auto told = owner.told();
  CHECK(told == std::vector<long>{1000, 1010, 1020});
  (void)owner.watch.take(before, owner.now);
  REQUIRE(owner.forest.update("arm", along_x(3), Time(1s) + 30ms));
  (void)owner.watch.take(group.next_push(owner.forest), owner.now);
  CHECK(eventually([&] { return owner.told().size() >= 4; }));
  CHECK(owner.told() == std::vector<long>{1000, 1010, 1020, 1030});
}

TEST_CASE("watched partition: what an answer shows to be lost is asked for") {
  WatchedOwner owner;
  WatchedGroup group = owner.plan();
  owner.answer(group);
  (void)owner.watch.take(group.next_push(owner.forest), owner.now);
  (void)owner.watch.groups(owner.now);
  owner.now += WatchedPartition::kSettle + 100ms;
  owner.answer(group);
  REQUIRE(owner.forest.update("arm", along_x(1), Time(1s) + 5ms));
  (void)owner.watch.take(group.next_push(owner.forest), owner.now);
  REQUIRE_FALSE(owner.watch.lacks(owner.now));
  for (const auto at : {10ms, 20ms}) {
    REQUIRE(owner.forest.update("arm", along_x(1), Time(1s) + at));
    (void)group.next_push(owner.forest);  // lost
  }
  owner.answer(group);
  CHECK(owner.watch.lacks(owner.now));
  const std::optional<Time> from = owner.watch.lacks_from();
  REQUIRE(from == Time(1s) + 5ms);
  owner.answer(group);
  CHECK_FALSE(owner.watch.lacks(owner.now));
  CHECK(eventually([&] { return owner.told().size() >= 4; }));
  CHECK(owner.told() == std::vector<long>{1000, 1005, 1020, 1010});
}

TEST_CASE("watched partition: lists of frames that wait for a slow listener are bounded") {
  constexpr int kFrames = 500;
  constexpr int kChanges = 400;
  static_assert(kFrames * kChanges > 3 * WatchedPartition::kMostWaiting / 2);
  WatchedOwner owner;
  std::promise<void> go;
  const auto held = go.get_future().share();
  int lists = 0;
  std::size_t newest = 0;
  owner.heard = [&](const PartitionNews& news) {
    held.wait();
    const auto* frames = std::get_if<FramesNews>(&news.what);
    if (frames == nullptr) return;
    const std::lock_guard lock(owner.mutex);
    ++lists;
    newest = frames->frames.size();
  };
  for (int i = 0; i < kFrames; ++i) {
    REQUIRE(owner.forest.add("f" + std::to_string(i), "base", along_x(1)));
  }
  for (int i = 0; i < kChanges; ++i) {
    REQUIRE(owner.forest.move("f0", i % 2 == 0 ? "arm" : "base", along_x(1)));
    WatchedGroup group = owner.plan();
    owner.answer(group);
  }
  REQUIRE(owner.forest.add("last", "base", along_x(1)));
  go.set_value();
  // The newest list comes, and then the values; the samples of the arm among them.
  std::size_t left = 0;
  CHECK(eventually([&] {
    WatchedGroup group = owner.plan();
    owner.answer(group);
    const std::lock_guard lock(owner.mutex);
    left = newest;
    return newest == kFrames + 3 && !owner.stamps.empty();
  }));
  CHECK(left == kFrames + 3);
  const std::lock_guard lock(owner.mutex);
  CHECK(static_cast<std::size_t>(lists) <= WatchedPartition::kMostWaiting / kFrames + 2);
}

TEST_CASE("watched partition: an owner that denies the watch is not called reachable in between") {
  WatchedOwner owner;
  std::vector<bool> reached;
  owner.heard = [&](const PartitionNews& news) {
    const std::lock_guard lock(owner.mutex);
    if (const auto* reach = std::get_if<ReachNews>(&news.what)) reached.push_back(reach->reachable);
  };
  const auto hears = [&](std::size_t count) {
    return eventually([&] {
      const std::lock_guard lock(owner.mutex);
      return reached.size() >= count;
    });
  };
  const bool is_deaf = GENERATE(false, true);
  for (int i = 0; i < 3; ++i) {
    (void)owner.plan();
    const Error why{Errc::kNotPermitted, "not for you"};
    CHECK((is_deaf ? owner.watch.on_deaf(why) : owner.watch.on_denied({}, &why)));
  }
  REQUIRE(hears(2));
  WatchedGroup group = owner.plan();
  // Another group of the request may still be denied.
  owner.answer(group);
  owner.watch.on_complete();
  REQUIRE(hears(3));
  const std::lock_guard lock(owner.mutex);
  CHECK(reached == std::vector<bool>{true, false, true});
}

TEST_CASE("watched partition: one that was forgotten has no frames, and returns as a new one") {
  WatchedOwner owner;
  std::vector<std::size_t> frames;
  owner.heard = [&](const PartitionNews& news) {
    const std::lock_guard lock(owner.mutex);
    if (const auto* all = std::get_if<FramesNews>(&news.what)) frames.push_back(all->frames.size());
  };
  WatchedGroup group = owner.plan();
  owner.answer(group);
  CHECK(owner.watch.on_no_plan({Errc::kUnreachable, "it is lost"}, owner.now));
  CHECK(owner.watch.on_no_plan({Errc::kUnknownPartition, "no such partition"}, owner.now));
  CHECK(owner.watch.on_no_plan({Errc::kUnknownPartition, "no such partition"}, owner.now));
  (void)owner.watch.take(group.snapshot(owner.forest, {}).value(), owner.now);
  group = owner.plan();
  owner.answer(group);
  CHECK(eventually([&] { return owner.told().size() >= 2; }));
  CHECK(owner.told() == std::vector<long>{1000, 1000});
  const std::lock_guard lock(owner.mutex);
  CHECK(frames == std::vector<std::size_t>{2, 0, 2});
}

// An owner of two edges; the first pushes of the watch were taken.
struct SettledOwner : WatchedOwner {
  SettledOwner() {
    REQUIRE(forest.add("lamp", "base", along_x(1)));
    group.emplace(plan());
    answer(*group);
    push();
    (void)watch.groups(now);
    now += WatchedPartition::kSettle + 100ms;
    answer(*group);
    write("arm", 5ms);
    push();
    REQUIRE_FALSE(watch.lacks(now));
  }
  void write(const char* id, Milliseconds at) {
    REQUIRE(forest.update(id, along_x(1), Time(1s) + at));
  }
  void push() { (void)watch.take(group->next_push(forest), now); }
  void lose() { (void)group->next_push(forest); }
  // What a round does if something is missing.
  void ask() {
    REQUIRE(watch.lacks(now));
    answer(*group);
  }
  std::optional<WatchedGroup> group;
};

constexpr std::uint32_t kArm = 0;
constexpr std::uint32_t kLamp = 2;

TEST_CASE("watched partition: first samples of an edge that were lost are asked for") {
  SettledOwner owner;
  owner.write("lamp", 10ms);
  owner.lose();
  const bool is_noticed = GENERATE(false, true);
  owner.write("lamp", 20ms);
  owner.write("arm", 20ms);
  if (is_noticed) {
    owner.push();
  } else {
    owner.lose();
    owner.answer(*owner.group);
  }
  owner.ask();
  CHECK(eventually([&] { return owner.has(kLamp, 1010) && owner.has(kLamp, 1020); }));
  CHECK_FALSE(owner.watch.lacks(owner.now));
}

TEST_CASE("watched partition: a correction that was lost comes with the answer") {
  SettledOwner owner;
  owner.write("lamp", 5ms);
  for (const auto at : {10ms, 20ms}) owner.write("arm", at);
  owner.push();
  REQUIRE(owner.forest.revise({{"arm", along_x(2), {}}}, Time(1s) + 10ms, UINT64_MAX));
  owner.lose();
  owner.write("arm", 30ms);
  owner.push();
  owner.ask();
  CHECK(eventually([&] { return owner.has(kArm, 1030) && owner.told_at(kArm, 1010) == 2; }));
}

TEST_CASE("watched partition: an answer that leaves edges out takes nothing back") {
  SettledOwner owner;
  for (const auto at : {10ms, 20ms}) {
    owner.write("lamp", at);
    owner.write("arm", at);
  }
  owner.push();
  const std::vector<EdgeSample> past{{Time(1s) + 10ms, along_x(3)}};
  REQUIRE(owner.forest.rewrite("lamp", {Time(1s) + 10ms, Time(1s) + 10ms}, past));
  owner.push();
  const PushedValues before = owner.group->snapshot(owner.forest, {}, true).value();
  REQUIRE(before.after == before.commit);
  REQUIRE(owner.forest.revise({{"arm", along_x(2), {}}}, Time(1s) + 20ms, UINT64_MAX));
  owner.push();
  owner.write("arm", 30ms);
  owner.push();
  (void)owner.watch.take(before, owner.now);
  owner.write("arm", 40ms);
  owner.push();
  REQUIRE(eventually([&] { return owner.has(kArm, 1040); }));
  CHECK(owner.told_at(kArm, 1020) == 2);
}

TEST_CASE("watched partition: an answer brings no earlier value of a sample back") {
  WatchedOwner owner;
  REQUIRE(owner.forest.add("tool", "arm", along_x(0)));
  REQUIRE(owner.forest.update("arm", along_x(1), Time(1s) + 20ms));
  REQUIRE(owner.forest.update("tool", along_x(1), Time(1s) + 18ms));
  REQUIRE(owner.forest.update("tool", along_x(1), Time(1s) + 28ms));
  constexpr std::uint32_t kTool = 2;
  WatchedGroup group = owner.plan();
  owner.answer(group);
  (void)owner.watch.take(group.next_push(owner.forest), owner.now);
  // The answer has the tool's last sample of before, too.
  REQUIRE(owner.watch.lacks_from() == Time(1s) + 20ms);
  const PushedValues before = group.snapshot(owner.forest, Time(1s) + 20ms, true).value();
  REQUIRE(owner.forest.revise({{"tool", along_x(2), {}}}, Time(1s) + 18ms, UINT64_MAX));
  (void)owner.watch.take(group.next_push(owner.forest), owner.now);
  (void)owner.watch.take(before, owner.now);
  REQUIRE(owner.forest.update("arm", along_x(3), Time(1s) + 30ms));
  (void)owner.watch.take(group.next_push(owner.forest), owner.now);
  REQUIRE(eventually([&] {
    const auto told = owner.told();
    return !told.empty() && told.back() == 1030;
  }));
  CHECK(owner.told_at(kTool, 1018) == 2);
}

}  // namespace
}  // namespace tfdude
