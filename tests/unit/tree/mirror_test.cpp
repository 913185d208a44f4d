// The edges' values that one forest reports, and that another one takes over.

#include <chrono>
#include <optional>
#include <string>
#include <vector>

#include "support/catch.hpp"
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

}  // namespace tfdude
