// A value that nobody has measured answers no instant: the configured one of an edge that is
// declared dynamic, and the last one of an earlier process.

#include <chrono>
#include <string>
#include <vector>

#include "support/catch.hpp"
#include "support/forest_support.hpp"
#include "support/random.hpp"
#include "tree/forest.hpp"

namespace tfdude {
namespace {

using namespace std::chrono_literals;
using testing::along_x;
using testing::ContainsSubstring;
using testing::outcome;
using testing::x_of;

Time ms(std::int64_t milliseconds) { return Time(Milliseconds(milliseconds)); }
Query at(std::int64_t milliseconds) { return {ms(milliseconds), 0ns, {}}; }

double x_of(const Result<StampedTransform>& X) {
  return X ? X->pose.translation().x() : std::numeric_limits<double>::quiet_NaN();
}

// world -> arm -> hand at 1 and 10 m. The hand is declared dynamic.
struct Robot {
  Robot() {
    REQUIRE(forest.add("world", "", {}));
    REQUIRE(forest.add("arm", "world", along_x(1)));
    REQUIRE(forest.add("hand", "arm", along_x(10)));
    moving.moving = true;
  }
  void declare() { REQUIRE(forest.set_timing("hand", moving)); }
  [[nodiscard]] Result<StampedTransform> hand(const Query& query = {}) const {
    return forest.lookup("world", "hand", query);
  }

  EdgeTiming moving;
  Forest forest{[] { return ms(9000); }};
};

// A forest that is told what another one has.
struct Mirror {
  Mirror() {
    REQUIRE(forest.add("world", "", {}));
    REQUIRE(forest.add("arm", "world", {}));
    REQUIRE(forest.add("hand", "arm", {}));
    for (const char* id : {"arm", "hand"}) edges.push_back(*forest.find(id));
  }
  void follow(const Forest& owner) { forest.take(edges, owner.values_since(cursors, {}).values); }

  Forest forest;
  std::vector<EdgeCursor> cursors{{"arm", "world"}, {"hand", "arm"}};
  std::vector<Handle> edges;
};

}  // namespace

TEST_CASE("a configured value of a dynamic edge is the newest, and that of no instant") {
  Robot robot;
  Mirror mirror;
  mirror.follow(robot.forest);
  robot.declare();
  mirror.follow(robot.forest);
  for (const Forest* forest : {&robot.forest, &mirror.forest}) {
    const auto newest = forest->lookup("world", "hand", Query{});
    CHECK(x_of(newest) == 11);
    CHECK_FALSE(newest.value().stamp);
    const auto then = forest->lookup("world", "hand", at(5000));
    REQUIRE(outcome(then) == "not_yet");
    CHECK_THAT(then.error().message, ContainsSubstring("'hand' has had no sample yet"));
    CHECK(outcome(forest->lookup("world", "hand", {ms(5000), 1h, {}})) == "not_yet");
    CHECK(x_of(forest->lookup("world", "arm", at(5000))) == 1);
  }
  // Beside an edge with samples the newest value is that at its newest sample, here as in a part
  // of a path that another participant asks for.
  for (const int t : {1000, 2000}) REQUIRE(robot.forest.update("arm", along_x(t), ms(t)));
  mirror.follow(robot.forest);
  for (const Forest* forest : {&robot.forest, &mirror.forest}) {
    CHECK(x_of(forest->lookup("world", "hand", Query{})) == 2010);
    CHECK(forest->lookup("world", "hand", Query{}).value().stamp == ms(2000));
    CHECK(outcome(forest->lookup("world", "hand", at(2000))) == "not_yet");
    const std::vector<PathEnds> path{{"world", "arm"}, {"arm", "hand"}};
    CHECK(forest->lookup_segments(path).value().stamp == ms(2000));
    CHECK(outcome(forest->lookup_segments(path, at(1000))) == "not_yet");
    const auto common = forest->lookup_segments(path, at(1000), ms(1000));
    CHECK(common.value().values[1].pose.translation().x() == 10);
  }
  // An update without a stamp is its first sample.
  REQUIRE(robot.forest.update("hand", along_x(20)));
  mirror.follow(robot.forest);
  for (const Forest* forest : {&robot.forest, &mirror.forest}) {
    CHECK(outcome(forest->lookup("arm", "hand", at(8999))) == "too_old");
    CHECK(x_of(forest->lookup("arm", "hand", at(9000))) == 20);
    CHECK(outcome(forest->lookup("arm", "hand", at(9001))) == "not_yet");
  }
}

TEST_CASE("an edge that had no sample yet can be observed, and named as unspecified") {
  Robot robot;
  robot.declare();
  const auto seen = robot.forest.lookup_segments({{"arm", "hand"}}, {}, std::nullopt, true);
  REQUIRE(robot.forest.revise({{"hand", along_x(12), {}}}, std::nullopt, seen.value().commit));
  CHECK(x_of(robot.hand()) == 13);
  CHECK(outcome(robot.hand(at(5000))) == "not_yet");
  CHECK(robot.hand().value().basis.unspecified.empty());
  EdgeTiming moving;
  moving.moving = true;
  REQUIRE(robot.forest.add("tool", "hand", {along_x(5).pose, StatedCovariance::unspecified()}));
  REQUIRE(robot.forest.set_timing("tool", moving));
  REQUIRE(robot.forest.update("arm", along_x(2), ms(1000)));
  CHECK(robot.forest.lookup("world", "tool", Query{}).value().basis.unspecified ==
        std::vector<std::string>{"tool"});
}

TEST_CASE("the last sample of an earlier process is that of its stamp, and of no other instant") {
  Robot robot;
  const bool declared = GENERATE(false, true);
  CAPTURE(declared);
  Mirror mirror;
  REQUIRE(robot.forest.resume("hand", {}, {ms(3000), false}));
  // The configuration sets the timing after that.
  if (declared) robot.declare();
  mirror.follow(robot.forest);
  const std::vector<const Forest*> both{&robot.forest, &mirror.forest};
  for (const Forest* forest : both) {
    const auto newest = forest->lookup("world", "hand", Query{});
    CHECK(x_of(newest) == 11);
    CHECK(newest.value().stamp == ms(3000));
    CHECK(x_of(forest->lookup("world", "hand", at(3000))) == 11);
    CHECK(outcome(forest->lookup("world", "hand", at(3001))) == "not_yet");
    CHECK(outcome(forest->lookup("world", "hand", {ms(3001), 1h, {}})) == "not_yet");
    CHECK(outcome(forest->lookup("world", "hand", at(2999))) == "too_old");
  }
  CHECK(robot.forest.kept("hand").value().time.stamp == ms(3000));
  // The next sample begins a history: what was in between nobody knows. It may be older, as clocks
  // may have restarted with the process, or of the same stamp.
  const std::int64_t next = GENERATE(1000, 3000, 7000);
  CAPTURE(next);
  REQUIRE(robot.forest.update("hand", along_x(20), ms(next)));
  mirror.follow(robot.forest);
  for (const Forest* forest : both) {
    CHECK(x_of(forest->lookup("world", "hand", at(next))) == 21);
    CHECK(outcome(forest->lookup("world", "hand", at(next - 1))) == "too_old");
    CHECK(outcome(forest->lookup("world", "hand", at(next + 1))) == "not_yet");
  }
  // From now on as ever.
  REQUIRE(robot.forest.update("hand", along_x(40), ms(next + 1000)));
  mirror.follow(robot.forest);
  for (const Forest* forest : both) {
    CHECK(x_of(forest->lookup("world", "hand", at(next + 500))) == 31);
  }
}

TEST_CASE("an update without a stamp has the clock's time, whatever an earlier process had") {
  Robot robot;
  REQUIRE(robot.forest.resume("hand", {}, {ms(1'000'000), false}));
  REQUIRE(robot.forest.update("hand", along_x(20)));
  CHECK(robot.hand().value().stamp == ms(9000));
}

TEST_CASE("a cleared history of an earlier process is still one") {
  Robot robot;
  REQUIRE(robot.forest.update("hand", along_x(20), ms(1000)));
  REQUIRE(robot.forest.clear_history("hand"));
  const StoredTime left = robot.forest.kept("hand").value().time;
  CHECK(left.cleared);
  Robot next;
  REQUIRE(next.forest.resume("hand", {}, left));
  const bool declared = GENERATE(false, true);
  if (declared) next.declare();
  CHECK(outcome(next.hand()) == "not_yet");
  CHECK(outcome(next.hand(at(5000))) == "not_yet");
  CHECK(next.forest.kept("hand").value().time.cleared);
}

TEST_CASE("an observation of what an earlier process has left does not begin a history") {
  Robot robot;
  REQUIRE(robot.forest.resume("hand", {}, {ms(3000), false}));
  const auto seen = robot.forest.lookup_segments({{"arm", "hand"}}, {}, std::nullopt, true);
  REQUIRE(robot.forest.revise({{"hand", along_x(12), {}}}, ms(3000), seen.value().commit));
  CHECK(x_of(robot.hand()) == 13);
  REQUIRE(robot.forest.update("hand", along_x(20), ms(7000)));
  CHECK(outcome(robot.hand(at(5000))) == "too_old");
}

}  // namespace tfdude
