// What a process writes it can read: rows of all tables, with the extremes of what messages can
// bring.

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "math/flat.hpp"
#include "partition/counters.hpp"
#include "store/sqlite_store.hpp"
#include "support/catch.hpp"
#include "support/forest_support.hpp"
#include "support/process.hpp"
#include "support/random.hpp"
#include "support/storing_owner.hpp"

namespace tfdude {
namespace {

using testing::outcome;
using testing::Random;
using testing::TemporaryDirectory;

template <class T>
T one_of(Random& random, std::vector<T> all) {
  return all[random.index(all.size())];
}

std::uint64_t any_count(Random& random, std::uint64_t last = kLastCounter) {
  return one_of<std::uint64_t>(
      random, {0, 1, 1'795'000'000'000'000'000, (1ULL << 62U) + 1, last - 1, last});
}

std::string any_id(Random& random, std::size_t number) {
  return one_of<std::string>(random, {"a", "\xc3\xa4'\"%_", std::string(200, 'x'), " b", "\\0"}) +
         std::to_string(number);
}

// A computed pose may be beyond what can be stated.
Pose any_pose(Random& random) {
  const Pose pose = random.pose(one_of<double>(random, {1e-300, 1.0, 9e8}));
  return random.index(2) == 0 ? pose : pose * random.pose(9e8);
}

Transform any_transform(Random& random) {
  const Pose pose = any_pose(random);
  if (random.index(3) == 0) return {pose, StatedCovariance::unspecified()};
  Covariance covariance;
  if (random.index(2) == 0) covariance = random.transform().covariance.of_specified();
  return {pose, covariance};
}

std::int64_t any_stamp(Random& random) {
  return one_of<std::int64_t>(
      random, {0, 1, 1'795'000'000'000'000'000, std::numeric_limits<std::int64_t>::max()});
}

StateChange any_change(Random& random) {
  StateChange change;
  change.epoch = any_count(random);
  change.configured.emplace();
  change.absent.emplace();
  for (std::size_t i = 0; i < 20; ++i) {
    StoredFrame frame{any_id(random, i), random.index(2) == 0 ? "" : any_id(random, 100),
                      any_transform(random), any_count(random)};
    if (random.index(2) == 0) frame.time = {time_of(any_stamp(random)), false};
    if (random.index(5) == 0) frame.time = {std::nullopt, true};
    if (random.index(3) == 0) {
      frame.correlation.said = {
          true,
          {{any_id(random, 7), false,
            Loading::Constant(6, 2, one_of<double>(random, {0.0, -1e9, 1e9, 5e-324}))}},
          {any_id(random, 8)}};
    }
    if (random.index(3) == 0) {
      frame.correlation.observed = {
          false, {{any_id(random, 9), false, Loading::Constant(6, 1, 1e-9)}}, {any_id(random, 10)}};
      if (random.index(2) == 0) frame.correlation.given = any_pose(random);
    }
    change.configured->push_back({frame.id, frame.parent, frame.X_PC});
    change.frames.push_back(std::move(frame));
    change.tombstones.push_back({any_id(random, 50 + i), any_count(random),
                                 static_cast<Tombstone::Kind>(1 + random.index(3)),
                                 random.index(2) == 0 ? "" : "rival"});
    change.joints.push_back({any_id(random, i), one_of<double>(random, {0.0, -1e9, 1e9, 5e-324}),
                             random.index(2) == 0 ? std::nullopt : std::optional(1e-300)});
    change.absent->push_back(
        {"partition " + std::to_string(i),
         one_of<std::int64_t>(random,
                              {0, -1, any_stamp(random), std::numeric_limits<std::int64_t>::min()}),
         static_cast<Absent::Kind>(1 + random.index(3)), any_count(random, kLastIncarnation)});
  }
  return change;
}

}  // namespace

TEST_CASE("whatever rows a process writes, it can read them again") {
  Random random(0x5704);
  INFO("seed " << random.seed());
  for (int run = 0; run < 20; ++run) {
    const TemporaryDirectory directory;
    const std::string file = state_file(directory.path(), 7, "arms");
    const StateChange change = any_change(random);
    {
      const auto store = open_sqlite_store(file, "arms");
      REQUIRE(store);
      REQUIRE(outcome((*store)->save(change)) == "ok");
    }
    const auto store = open_sqlite_store(file, "arms");
    REQUIRE(store);
    const auto state = (*store)->load();
    INFO((state ? "" : state.error().message));
    REQUIRE(state);
    CHECK(state->epoch == change.epoch);
    CHECK(state->frames.size() == change.frames.size());
    CHECK(state->tombstones.size() == change.tombstones.size());
    CHECK(state->configured.size() == change.configured->size());
    CHECK(state->joints.size() == change.joints.size());
    REQUIRE(state->absent.size() == change.absent->size());
    for (const StoredFrame& read : state->frames) {
      const auto written =
          std::find_if(change.frames.begin(), change.frames.end(),
                       [&](const StoredFrame& frame) { return frame.id == read.id; });
      REQUIRE(written != change.frames.end());
      CHECK(read.parent == written->parent);
      CHECK(read.lamport_time == written->lamport_time);
      CHECK(read.time.stamp == written->time.stamp);
      CHECK(read.time.cleared == written->time.cleared);
      CHECK(read.correlation.said == written->correlation.said);
      CHECK(read.correlation.observed == written->correlation.observed);
      REQUIRE(read.correlation.given.has_value() == written->correlation.given.has_value());
      // The quaternion is normalized once more.
      const Flat a = to_flat(read.X_PC);
      const Flat b = to_flat(written->X_PC);
      for (std::size_t i = 0; i < a.size(); ++i) {
        CHECK(std::abs(a[i] - b[i]) <= 1e-15 * std::max(1.0, std::abs(b[i])));
      }
    }
  }
}

// One message once made the state files of all daemons unreadable that changed something later.
TEST_CASE("after any Lamport time that a message can bring, the state can be read again") {
  const std::uint64_t brought = GENERATE(kLastCounter - 1, kLastCounter);
  testing::MemoryStore kept;
  testing::StoringOwner owner("arms", &kept);
  owner.start({{"arm", "", {}}, {"hand", "arm", {}}, {"tool", "arm", {}}});
  CHECK(owner.ask("hand", MoveRequest{"tool", {}, brought}) == "ok");
  CHECK(owner.ask("hand", MoveRequest{"arm", {}, brought}) == "ok");
  CHECK(owner.ask("lamp", AddRequest{"arm", {}, 0}) == "ok");
  CHECK(owner.ask("tool", RemoveRequest{{"tool"}, brought}) == "ok");
  const StoredState state = kept.load().value();
  StateChange change;
  change.epoch = state.epoch;
  change.frames = state.frames;
  change.tombstones = state.tombstones;
  const TemporaryDirectory directory;
  const std::string file = state_file(directory.path(), 7, "arms");
  REQUIRE(outcome(open_sqlite_store(file, "arms").value()->save(change)) == "ok");
  const auto read = open_sqlite_store(file, "arms").value()->load();
  INFO((read ? "" : read.error().message));
  REQUIRE(read);
  CHECK(read->frames.size() == 3);
}

}  // namespace tfdude
