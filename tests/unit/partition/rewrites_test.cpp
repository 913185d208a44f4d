// What owners and watchers do while the past of an edge is rewritten.

#include "partition/rewrites.hpp"

#include <algorithm>
#include <vector>

#include "partition/watching.hpp"
#include "support/catch.hpp"
#include "support/forest_support.hpp"
#include "support/random.hpp"

namespace tfdude {
namespace {

using namespace std::chrono_literals;
using testing::along_x;
using testing::outcome;
using testing::Random;

constexpr PeerId kPeer{1};
constexpr Time kNow{1000s};

// The parts of so many samples, each of which says its place.
std::vector<RewriteRequest> parts_of(std::uint32_t total, std::uint32_t each,
                                     std::uint64_t number = 1) {
  std::vector<RewriteRequest> parts;
  for (std::uint32_t first = 0; first < total; first += each) {
    RewriteRequest part{number, {Time(0s), Time(100s)}, total, first, {}};
    for (std::uint32_t i = first; i < std::min(first + each, total); ++i) {
      part.samples.push_back({time_of(i), along_x(i)});
    }
    parts.push_back(std::move(part));
  }
  return parts;
}

bool is_whole(const std::vector<EdgeSample>& samples, std::size_t total) {
  if (samples.size() != total) return false;
  for (std::size_t i = 0; i < total; ++i) {
    if (samples[i].stamp != time_of(static_cast<std::int64_t>(i))) return false;
  }
  return true;
}

TEST_CASE("a rewrite is whole with its last part, after the others in any order, and twice") {
  Random random(5);
  INFO("seed " << random.seed());
  for (int round = 0; round < 50; ++round) {
    Rewrites rewrites;
    const auto total = static_cast<std::uint32_t>(1 + random.index(2000));
    auto parts = parts_of(total, 1 + static_cast<std::uint32_t>(random.index(256)));
    const RewriteRequest last = parts.back();
    parts.pop_back();
    std::shuffle(parts.begin(), parts.end(), random.engine());
    for (const RewriteRequest& part : parts) {
      for (std::size_t times = 1 + random.index(2); times > 0; --times) {
        const auto all = rewrites.add(kPeer, "odom", part, kNow);
        REQUIRE(all);
        REQUIRE_FALSE(*all);
      }
    }
    const auto all = rewrites.add(kPeer, "odom", last, kNow);
    REQUIRE(all);
    REQUIRE(*all);
    CHECK(is_whole(**all, total));
  }
}

TEST_CASE("rewrites of different senders and numbers do not mix") {
  Rewrites rewrites;
  const auto one = parts_of(4, 2, 1);
  const auto two = parts_of(2, 1, 2);
  CHECK_FALSE(*rewrites.add(kPeer, "odom", one[0], kNow));
  CHECK_FALSE(*rewrites.add({2}, "odom", two[0], kNow));
  CHECK_FALSE(*rewrites.add(kPeer, "odom", two[0], kNow));
  CHECK(is_whole(**rewrites.add(kPeer, "odom", one[1], kNow), 4));
  CHECK(is_whole(**rewrites.add({2}, "odom", two[1], kNow), 2));
}

TEST_CASE("what an owner keeps of unfinished rewrites is limited, in number, size and time") {
  Rewrites rewrites;
  RewriteRequest large = parts_of(1, 1)[0];
  large.total = kMaxRewritten + 1;
  CHECK(outcome(rewrites.add(kPeer, "odom", large, kNow)) == "too_much");
  for (std::uint8_t i = 0; i < Rewrites::kMost; ++i) {
    CHECK(rewrites.add(i == 0 ? kPeer : PeerId{2, i}, "odom", parts_of(2, 1)[0], kNow));
  }
  const RewriteRequest more = parts_of(2, 1, 77)[0];
  CHECK(outcome(rewrites.add(kPeer, "odom", more, kNow)) == "too_much");
  CHECK(is_whole(**rewrites.add(kPeer, "odom", parts_of(2, 1)[1], kNow), 2));
  CHECK(rewrites.add(kPeer, "odom", more, kNow));
  CHECK(outcome(rewrites.add(kPeer, "odom", parts_of(2, 1, 78)[0], kNow)) == "too_much");
  rewrites.forget_idle(kNow + 1s);
  CHECK(outcome(rewrites.add(kPeer, "odom", parts_of(2, 1, 78)[0], kNow)) == "too_much");
  rewrites.forget_idle(kNow + Rewrites::kIdle + 1s);
  CHECK_FALSE(*rewrites.add(kPeer, "odom", parts_of(2, 1, 78)[0], kNow));
  rewrites.forget(kPeer, 78);
  // A sender of all parts must not believe that it is done.
  CHECK(outcome(rewrites.add(kPeer, "odom", parts_of(2, 1, 78)[1], kNow)) == "changed_meanwhile");
  CHECK(outcome(rewrites.add(kPeer, "odom", parts_of(2, 1, 77)[1], kNow)) == "changed_meanwhile");
}

TEST_CASE("one sender's rewrites leave room for those of others") {
  Rewrites rewrites;
  const auto begin = [&](std::uint8_t peer, std::uint64_t number, Time now = kNow) {
    return rewrites.add(PeerId{peer}, "odom", parts_of(2, 1, number)[0], now);
  };
  const auto end = [&](std::uint8_t peer, std::uint64_t number) {
    return outcome(rewrites.add(PeerId{peer}, "odom", parts_of(2, 1, number)[1], kNow));
  };
  CHECK(begin(1, 1, kNow + 1s));
  CHECK(begin(1, 2));
  const auto third = begin(1, 3);
  REQUIRE(outcome(third) == "too_much");
  CHECK(third.error().message ==
        "frame 'odom': this participant has begun 2 other rewrites here, its share of the limit");
  CHECK(begin(1, 2));  // again
  CHECK(begin(2, 1, kNow + 2s));
  CHECK(begin(2, 2, kNow + 3s));
  // The least recent of who has two makes room.
  CHECK(begin(3, 1));
  CHECK(end(1, 2) == "changed_meanwhile");
  CHECK(begin(4, 1));
  CHECK(end(2, 1) == "changed_meanwhile");
  // Now each has one, and none of these makes room.
  CHECK(outcome(begin(5, 1)) == "too_much");
  CHECK(outcome(begin(4, 2)) == "too_much");
  CHECK(end(1, 1) == "ok");
  CHECK(end(2, 2) == "ok");
  CHECK(end(3, 1) == "ok");
  CHECK(end(4, 1) == "ok");
}

TEST_CASE("a part that does not fit the others ends its rewrite") {
  const auto wrong = GENERATE(0, 1, 2, 3, 4, 5);
  Rewrites rewrites;
  const auto parts = parts_of(6, 2);
  REQUIRE(rewrites.add(kPeer, "odom", parts[0], kNow));
  RewriteRequest part = parts[1];
  if (wrong == 0) part.total = 7;
  if (wrong == 1) part.interval.to = Time(101s);
  if (wrong == 2) part.first = 5;
  if (wrong == 3) part.first = 4'000'000'000U;
  if (wrong == 4) part.samples.clear();
  CHECK(outcome(rewrites.add(kPeer, wrong == 5 ? "other" : "odom", part, kNow)) == "invalid_input");
  CHECK_FALSE(*rewrites.add(kPeer, "odom", parts[1], kNow));
  CHECK_FALSE(*rewrites.add(kPeer, "odom", parts[0], kNow));
  CHECK(is_whole(**rewrites.add(kPeer, "odom", parts[2], kNow), 6));
}

TEST_CASE("no answer comes before the push that tells of a rewritten past") {
  Forest forest;
  REQUIRE(forest.add("map", "", {}));
  REQUIRE(forest.add("odom", "map", along_x(0)));
  REQUIRE(forest.add("camera", "map", along_x(0)));
  REQUIRE(forest.update("odom", along_x(1), Time(1s)));
  WatchRequest request;
  request.segments = {{"map", "odom"}, {"map", "camera"}};
  WatchedGroup group(7, request);
  const auto told = [&](bool is_answer) {
    std::vector<std::uint32_t> edges;
    const auto all = group.snapshot(forest, {}, is_answer);
    REQUIRE(all);
    for (const PushedValue& one : all->entries) edges.push_back(one.index);
    std::sort(edges.begin(), edges.end());
    return edges;
  };
  using Edges = std::vector<std::uint32_t>;
  group.begin(*group.snapshot(forest, {}));
  REQUIRE(forest.update("odom", along_x(2), Time(2s)));
  CHECK(group.next_push(forest).entries.size() == 2);
  group.arrived();
  CHECK(told(true) == Edges{0, 1});
  REQUIRE(forest.rewrite("odom", {Time(2s), Time(3s)}, {{Time(2s), along_x(9)}}));
  CHECK(told(true) == Edges{1});
  CHECK(told(false) == Edges{1});
  CHECK(group.next_push(forest).entries.size() ==
        2);  // where the history before ends, and the next
  CHECK(group.has_rewritten());
  CHECK(told(true) == Edges{1});
  // What is pushed keeps its order.
  CHECK(told(false) == Edges{0, 1});
  CHECK(group.snapshot(forest, {}, true)->after == forest.newest_commit());
  group.arrived();
  CHECK(told(true) == Edges{0, 1});
}

// The push of the new value of a static edge was lost. An answer that leaves out what another push
// is about to tell does not replace it.
TEST_CASE("an answer that leaves an edge out follows on nothing that a watcher lacks") {
  Forest forest;
  REQUIRE(forest.add("map", "", {}));
  REQUIRE(forest.add("odom", "map", along_x(0)));
  REQUIRE(forest.add("arm", "map", along_x(0)));
  REQUIRE(forest.add("tip", "arm", along_x(0)));
  REQUIRE(forest.update("odom", along_x(1), Time(1s)));
  WatchRequest request;
  request.segments = {{"map", "odom"}, {"map", "arm"}, {"arm", "tip"}};
  WatchedGroup group(7, request);
  ReceivedGroup watcher(request.segments.size());
  PushedValues first = *group.snapshot(forest, {}, true);
  group.begin(first);
  REQUIRE(watcher.place(first).follows_on);
  PushedValues pushed = group.next_push(forest);
  REQUIRE(watcher.place(pushed).is_old);
  group.arrived();
  REQUIRE(forest.update({{"arm", along_x(3)}, {"tip", along_x(-3)}}));
  (void)group.next_push(forest);  // lost
  group.arrived();

  REQUIRE(forest.move("arm", "map", along_x(3)));
  PushedValues moved = *group.snapshot(forest, {}, true);
  CHECK(moved.entries.size() == 3);
  REQUIRE(forest.rewrite("odom", {Time(1s), Time(2s)}, {{Time(1s), along_x(9)}}));
  PushedValues less = *group.snapshot(forest, {}, true);
  CHECK(less.entries.size() == 2);
  CHECK_FALSE(watcher.place(less).follows_on);
  CHECK(watcher.lacks());
  PushedValues next = group.next_push(forest);
  CHECK_FALSE(watcher.place(next).follows_on);
  group.arrived();
  PushedValues whole = *group.snapshot(forest, {}, true);
  CHECK(watcher.place(whole).follows_on);
  CHECK_FALSE(watcher.lacks());
}

}  // namespace
}  // namespace tfdude
