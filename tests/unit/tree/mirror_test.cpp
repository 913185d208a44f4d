// The edges' values that one forest reports, and that another one takes over.

#include <chrono>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "support/catch.hpp"
#include "support/drifting.hpp"
#include "support/forest_support.hpp"
#include "support/pose_diff.hpp"
#include "support/random.hpp"
#include "tree/forest.hpp"

namespace tfdude {
namespace {

using namespace std::chrono_literals;
using testing::along_x;
using testing::outcome;
using testing::Random;
using testing::x_of;

Time at(std::int64_t milliseconds) { return Time(Milliseconds(milliseconds)); }

// world -> arm -> hand, at an owner and at its watcher.
struct Followed {
  Followed() {
    for (Forest* forest : {&owner, &mirror}) {
      REQUIRE(forest->add("world", "", {}));
      REQUIRE(forest->add("other", "", {}));
      REQUIRE(forest->add("arm", "world", along_x(0)));
      REQUIRE(forest->add("hand", "arm", along_x(0)));
    }
    for (const char* id : {"arm", "hand"}) edges.push_back(*mirror.find(id));
  }
  PushedCommit values_since(const PushedQuery& query = {}) {
    return owner.values_since(cursors, query);
  }
  // @return how many values that were
  std::size_t follow(const PushedQuery& query = {}) {
    const PushedCommit told = values_since(query);
    mirror.take(edges, told.values);
    return told.values.size();
  }
  std::string difference(std::optional<Time> t) const {
    Query query;
    query.at = t;
    const auto expected = owner.lookup("world", "hand", query);
    const auto actual = mirror.lookup("world", "hand", query);
    if (!expected || !actual) return outcome(expected) == outcome(actual) ? "" : "one fails";
    if (expected->stamp != actual->stamp) return "another instant";
    return testing::transform_diff(*actual, *expected, 1e-12);
  }

  Forest owner;
  Forest mirror;
  std::vector<EdgeCursor> cursors{{"arm", "world"}, {"hand", "arm"}};
  std::vector<Handle> edges;
};

// world -> base at a watcher.
struct BaseMirror {
  BaseMirror() {
    REQUIRE(forest.add("world", "", {}));
    REQUIRE(forest.add("base", "world", {}));
    edges.push_back(*forest.find("base"));
  }
  void follow(const Forest& owner) {
    forest.take(edges, owner.values_since(cursors, {false, at(0), true, true}).values);
  }

  Forest forest;
  std::vector<EdgeCursor> cursors{{"base", "world"}};
  std::vector<Handle> edges;
};

// Drives and observes at random instants: late ones, between samples, and beyond them. A pose that
// comes late for the stamp of an observation is left out: watchers are not told of it.
struct RandomDrive {
  RandomDrive(std::uint64_t seed, bool noisy)
      : random(seed), robot(noisy ? testing::of_deviations(0.02, 0.01) : Covariance()) {}

  void step(int number) {
    const auto t = static_cast<std::int64_t>(1000 * random.index(10));
    const std::size_t action = number < 2 ? 0 : random.index(3);
    if (action == 0 && seen.count(t) == 0) {
      const Transform X{exp(random.twist(1.0)), testing::of_deviations(0.01, 0.02)};
      if (robot.forest.update("base", X, at(t))) done += " update " + std::to_string(t);
    } else if (action != 0) {
      const std::int64_t then = action == 1 ? t : t + 500;
      const Transform Z{exp(0.1 * random.twist(1.0)), testing::of_deviations(0.01, 0.01)};
      const std::string source = std::string(kObservedPrefix) + std::to_string(number);
      if (!robot.see(Z, at(then), source)) return;
      seen.insert(then);
      done += " see " + std::to_string(then);
    }
  }

  Random random;
  testing::Drifting robot;
  std::set<std::int64_t> seen;
  std::string done = "done:";
};

Query until_a_second_after(std::int64_t t) {
  Query query;
  query.at = at(t);
  query.extrapolate = 1s;
  return query;
}

}  // namespace

TEST_CASE("a mirror has late samples and replaced ones and process noise") {
  Random random(901);
  INFO("seed " << random.seed());
  Followed robot;
  EdgeTiming noisy;
  noisy.process_noise = random.transform().covariance.of_specified();
  REQUIRE(robot.owner.set_timing("hand", noisy));
  REQUIRE(robot.follow() == 2);
  for (const int t : {1000, 2000, 1500, 3000, 1200, 2999}) {
    REQUIRE(robot.owner.update("arm", random.transform(), at(t)));
    REQUIRE(robot.owner.update("hand", random.transform(), at(t + 100)));
    REQUIRE(robot.follow() == 2);
    for (int then = 1100; then <= 3100; then += 100) CHECK(robot.difference(at(then)) == "");
  }
  const auto seen = robot.owner.lookup_segments({{"world", "arm"}}, {}, std::nullopt, true);
  REQUIRE(robot.owner.revise({{"arm", random.transform(), {}}}, at(1500), seen->commit));
  CHECK(robot.follow() == 1);
  CHECK(robot.difference(at(1500)) == "");
  CHECK(robot.follow() == 0);
}

TEST_CASE("a new watcher gets the newest values or all since an instant") {
  Followed robot;
  for (int t = 1; t <= 9; ++t) REQUIRE(robot.owner.update("arm", along_x(t), at(10 * t)));
  auto cursors = robot.cursors;
  CHECK(robot.owner.values_since(cursors, {}).values.size() == 2);
  cursors = robot.cursors;
  CHECK(robot.owner.values_since(cursors, {false, at(65)}).values.size() ==
        5);  // the hand; 60, 70, 80, 90
  cursors = robot.cursors;
  CHECK(robot.owner.values_since(cursors, {false, at(1)}).values.size() == 10);
  CHECK(robot.owner.values_since(cursors, {false, at(1)}).values.empty());
}

TEST_CASE("a move or a removal or a reset begins a history with a higher number") {
  Followed robot;
  const auto history = [&] {
    auto cursors = robot.cursors;
    const auto values = robot.owner.values_since(cursors, {}).values;
    for (const PushedValue& value : values) {
      if (value.index == 1) return value.history;
    }
    return std::uint64_t{0};
  };
  std::uint64_t before = history();
  const auto is_another = [&] { return std::exchange(before, history()) < before; };
  REQUIRE(robot.owner.update("hand", along_x(1)));
  REQUIRE(robot.owner.update("hand", along_x(1), at(1)));
  REQUIRE(robot.owner.move("arm", "other"));  // its children stay what they are to it
  CHECK_FALSE(is_another());
  REQUIRE(robot.owner.move("hand", "other", along_x(2)));
  CHECK(robot.values_since().values.empty());  // what hangs elsewhere is not told
  REQUIRE(robot.owner.move("hand", "arm", along_x(3)));
  CHECK(is_another());
  REQUIRE(robot.owner.remove("hand"));
  CHECK(history() == 0);
  REQUIRE(robot.owner.add("hand", "arm", along_x(4)));
  CHECK(is_another());
  REQUIRE(robot.owner.set_timing("hand", {}));
  CHECK(is_another());
}

TEST_CASE("a new history leaves nothing of the previous one") {
  Followed robot;
  for (int t = 1; t <= 5; ++t) REQUIRE(robot.owner.update("hand", along_x(t), at(t)));
  REQUIRE(robot.follow({false, at(1)}) == 6);
  CHECK(x_of(robot.mirror.lookup("world", "hand")) == 5);
  REQUIRE(robot.owner.move("hand", "arm", along_x(50)));
  REQUIRE(robot.follow() == 1);
  CHECK(x_of(robot.mirror.lookup("world", "hand")) == 50);
  // Several samples of a history that began since the last push.
  REQUIRE(robot.owner.move("hand", "arm", along_x(60)));
  for (int t = 3; t <= 6; ++t) REQUIRE(robot.owner.update("hand", along_x(-t), at(t)));
  REQUIRE(robot.follow() == 4);
  for (int t = 1; t <= 7; ++t) CHECK(robot.difference(at(t)) == "");
}

TEST_CASE("readers of the mirror see each push as one commit") {
  Followed robot;
  robot.follow();
  REQUIRE(robot.owner.update({{"arm", along_x(1)}, {"hand", along_x(-1)}}));
  REQUIRE(robot.owner.update("arm", along_x(5), at(5)));
  int commits = 0;
  robot.mirror.on_commit([&] { ++commits; });
  robot.follow();
  CHECK(commits == 1);
  CHECK(x_of(robot.mirror.lookup("world", "hand")) == 4);
  // Twice the same says nothing new.
  auto cursors = robot.cursors;
  for (EdgeCursor& cursor : cursors) cursor.commit = 0;
  auto again = robot.owner.values_since(cursors, {}).values;
  REQUIRE(again.size() == 2);
  robot.mirror.take(robot.edges, again);
  CHECK(commits == 1);
  again[0].index = 7;  // of none
  robot.mirror.take(robot.edges, again);
  CHECK(commits == 1);
}

TEST_CASE("a mirror of an edge that drifts has the values of its owner at all instants") {
  constexpr std::uint64_t kSeed = 6701;
  for (std::uint64_t run = 0; run < 100; ++run) {
    INFO("seed " << kSeed + run);
    RandomDrive drive(kSeed + run, run % 2 == 0);
    BaseMirror mirror;
    for (int step = 0; step < 12; ++step) {
      drive.step(step);
      mirror.follow(drive.robot.forest);
      INFO(drive.done);
      for (std::int64_t then = 0; then <= 11000; then += 250) {
        INFO("at " << then);
        const Query query = until_a_second_after(then);
        const auto expected = drive.robot.forest.lookup("world", "base", query);
        const auto actual = mirror.forest.lookup("world", "base", query);
        REQUIRE(outcome(expected) == outcome(actual));
        if (expected) CHECK(testing::transform_diff(*actual, *expected, 1e-9) == "");
      }
    }
  }
}

// Such a watcher was never told how a sample was given that had been corrected.
TEST_CASE("a mirror of an edge that drifts is not more certain than its owner if it begins late") {
  constexpr std::uint64_t kSeed = 6901;
  for (std::uint64_t run = 0; run < 100; ++run) {
    INFO("seed " << kSeed + run);
    RandomDrive drive(kSeed + run, run % 2 == 0);
    BaseMirror mirror;
    for (int step = 0; step < 12; ++step) {
      drive.step(step);
      if (step < 6) continue;
      mirror.follow(drive.robot.forest);
      INFO(drive.done);
      for (std::int64_t then = 0; then <= 11000; then += 250) {
        INFO("at " << then);
        const Query query = until_a_second_after(then);
        const auto expected = drive.robot.forest.lookup("world", "base", query);
        const auto actual = mirror.forest.lookup("world", "base", query);
        if (!expected) continue;
        REQUIRE(actual);
        const Twist least = expected->covariance.of_specified().matrix().diagonal();
        const Twist found = actual->covariance.of_specified().matrix().diagonal();
        CHECK((found.array() >= (1.0 - 1e-6) * least.array()).all());
      }
    }
  }
}

}  // namespace tfdude
