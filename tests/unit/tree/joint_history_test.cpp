// Histories of edges that joints move: a sample is a position.

#include <chrono>
#include <cmath>
#include <string>
#include <vector>

#include "support/catch.hpp"
#include "support/forest_support.hpp"
#include "support/joint_frames.hpp"
#include "support/pose_diff.hpp"
#include "support/random.hpp"
#include "tree/forest.hpp"

namespace tfdude {
namespace {

using namespace std::chrono_literals;
using testing::along_x;
using testing::Approx;
using testing::outcome;
using testing::transform_diff;
using testing::yaw;

Time at(std::int64_t milliseconds) { return Time(Milliseconds(milliseconds)); }

Query query(std::int64_t milliseconds, std::chrono::nanoseconds beyond = 0ns) {
  return {at(milliseconds), beyond, {}};
}

// base -> arm, which turns about the z axis, a metre along x.
struct Turning {
  explicit Turning(const StatedCovariance& of_origin = StatedCovariance::exact()) {
    Transform origin = along_x(1);
    origin.covariance = of_origin;
    joint = revolute_joint(origin, {0, 0, 1});
    REQUIRE(forest.add("base", "", {}));
    REQUIRE(forest.add("arm", "base", joint_transform(joint, 0, 0)));
    arm = *forest.find("arm");
  }
  CorrelatedUpdate update(double position, double variance) const {
    return {arm,
            joint_transform(joint, position, variance),
            nullptr,
            {&joint, {position, variance}, period}};
  }
  void turn(double position, std::int64_t milliseconds, double variance = 0.01) {
    REQUIRE(forest.update_correlated({update(position, variance)}, at(milliseconds)));
  }
  Result<StampedTransform> lookup(const Query& when) const {
    return forest.lookup("base", "arm", when);
  }
  std::string difference(const Query& when, double position, double variance) const {
    const auto X = lookup(when);
    if (!X) return X.error().message;
    return transform_diff(*X, joint_transform(joint, position, variance), 1e-12);
  }

  Joint joint;
  double period = 0;
  Forest forest;
  Handle arm;
};

constexpr double kTurn = 2 * 3.14159265358979323846;

}  // namespace

TEST_CASE("between positions more than half a turn apart the joint moves the long way") {
  Turning robot;
  robot.turn(-2, 1000, 0.01);
  robot.turn(2, 2000, 0.03);
  for (const double s : {0.0, 0.1, 0.25, 0.5, 0.75, 1.0}) {
    const auto when = query(1000 + static_cast<std::int64_t>(1000 * s));
    CHECK(robot.difference(when, -2 + 4 * s, 0.01 + 0.02 * s) == "");
  }
  CHECK(yaw(robot.lookup(query(1500))) == Approx(0).margin(1e-12));
  robot.turn(100, 3000, 0.03);
  CHECK(robot.difference(query(2750), 2 + 0.75 * 98, 0.03) == "");
}

TEST_CASE("a joint with a period takes the shorter way between positions and beyond them") {
  Turning wheel;
  wheel.period = kTurn;
  wheel.turn(3.1, 10'000, 0.01);
  wheel.turn(-3.1, 10'100, 0.03);
  const double step = kTurn - 6.2;
  CHECK(std::abs(yaw(wheel.lookup(query(10'050)))) == Approx(kTurn / 2));
  CHECK(wheel.difference(query(10'025), 3.1 + 0.25 * step, 0.015) == "");
  CHECK(wheel.difference(query(10'100), -3.1, 0.03) == "");
  const double beyond = yaw(wheel.lookup(query(10'150, 1s)));
  CHECK(std::remainder(beyond, kTurn) == Approx(-3.1 + 0.5 * step));
  // Back again, and over several turns.
  wheel.turn(3.1, 10'200, 0.03);
  CHECK(wheel.difference(query(10'150), -3.1 - 0.5 * step, 0.03) == "");
  wheel.turn(3.1 - 3 * kTurn + 1, 10'300, 0.03);
  CHECK(wheel.difference(query(10'250), 3.6, 0.03) == "");
  // Half a turn and less is as before.
  wheel.turn(0, 10'400);
  wheel.turn(3, 10'500);
  CHECK(wheel.difference(query(10'450), 1.5, 0.01) == "");
}

TEST_CASE("a joint whose period is no whole turn jumps after a sample, and goes on from the next") {
  Turning mimic;
  Turning watcher;
  mimic.period = 0.5 * kTurn;  // half of what a continuous joint turns
  std::vector<EdgeCursor> cursors{{"arm", "base"}};
  const double step = 0.5 * (kTurn - 6.2);
  mimic.turn(1.55, 1000);
  watcher.forest.take({watcher.arm}, mimic.forest.values_since(cursors, {}).values);
  mimic.turn(-1.55, 1100);
  watcher.forest.take({watcher.arm}, mimic.forest.values_since(cursors, {}).values);
  CHECK(mimic.difference(query(1000), 1.55, 0.01) == "");
  CHECK(mimic.difference(query(1050), -1.55 - 0.5 * step, 0.01) == "");
  CHECK(yaw(mimic.lookup(query(1110, 1s))) == Approx(-1.55 + 0.1 * step));
  for (const int t : {1000, 1025, 1050, 1100, 1110}) {
    const auto X = mimic.lookup(query(t, 1s));
    const auto Y = watcher.lookup(query(t, 1s));
    REQUIRE(X);
    REQUIRE(Y);
    CHECK(testing::pose_diff(Y->pose, X->pose, 1e-7) == "");
  }
}

TEST_CASE("a pose without covariance is that of the position, too") {
  Turning robot;
  REQUIRE(robot.forest.add("hand", "arm", along_x(0)));
  robot.turn(-2, 1000);
  robot.turn(2, 2000);
  // Its stamps are others, so the arm is looked up between its samples.
  REQUIRE(robot.forest.update("hand", along_x(0), at(1250)));
  const auto X = robot.forest.lookup_pose("base", "hand");
  REQUIRE(X);
  CHECK(testing::pose_diff(*X, joint_transform(robot.joint, -1, 0).pose, 1e-12) == "");
}

TEST_CASE("the covariance of a joint's origin is that of the position in between") {
  testing::Random random(811);
  Turning robot(random.transform().covariance);
  robot.turn(-2, 1000, 0);
  robot.turn(2, 2000, 0.04);
  CHECK(robot.difference(query(1500), 0, 0.02) == "");
  CHECK(robot.difference(query(2500, 1s), 4, 2 * (1.5 * 0.04)) == "");
}

TEST_CASE("beyond its newest sample a joint goes on by its speed") {
  Turning robot;
  robot.turn(-2, 1000, 0.01);
  robot.turn(2, 2000, 0.03);
  CHECK(outcome(robot.lookup(query(2250))) == "not_yet");
  CHECK(robot.difference(query(2250, 1s), 3, 1.5 * (1.25 * 0.03 + 0.25 * 0.01)) == "");
}

TEST_CASE("process noise is added to a joint's covariance") {
  Turning robot;
  EdgeTiming timing;
  timing.process_noise = *Covariance::from_stddev({2, 0, 0, 0, 0, 0});
  REQUIRE(robot.forest.set_timing("arm", timing));
  robot.turn(-2, 1000);
  robot.turn(2, 2000);
  const auto variance = [&](const Query& when) {
    return robot.lookup(when)->covariance.of_specified().upper()[0];
  };
  CHECK(variance(query(1500)) == Approx(0.25 * 4));
  // The twist is wrong by what the random walk moved within the second before.
  CHECK(variance(query(2500, 1s)) == Approx(0.5 * (1 + 0.5) * 4));
  CHECK(variance({at(1500), 0ns, at(1600)}) == Approx((0.25 + 0.1) * 4));
  CHECK(variance({std::nullopt, 0ns, at(3000)}) == Approx(4));
}

TEST_CASE("a joint whose origin is unspecified makes the edge unspecified at any instant") {
  Turning robot(StatedCovariance::unspecified());
  robot.turn(-2, 1000);
  robot.turn(2, 2000);
  for (const auto& when : {query(1000), query(1500), query(2000), query(2500, 1s)}) {
    const auto X = robot.lookup(when);
    REQUIRE(X);
    CHECK(X->basis.unspecified == std::vector<std::string>{"arm"});
  }
}

TEST_CASE("a late position changes what lies between its neighbours") {
  Turning robot;
  robot.turn(-2, 1000);
  robot.turn(2, 2000);
  robot.turn(3, 1500);
  CHECK(robot.difference(query(1250), 0.5, 0.01) == "");
  CHECK(robot.difference(query(1750), 2.5, 0.01) == "");
  CHECK(robot.difference(query(2000), 2, 0.01) == "");
  CHECK(outcome(robot.forest.update_correlated({robot.update(0, 0)}, at(1500))) == "stamp_taken");
}

TEST_CASE("a sample that is written as an edge is a pose between positions") {
  Turning robot;
  robot.turn(-2, 1000);
  REQUIRE(robot.forest.update("arm", along_x(5), at(2000)));
  robot.turn(1, 3000);
  robot.turn(-1, 4000);
  CHECK(robot.lookup(query(2000))->pose.translation().x() == 5);
  CHECK(robot.lookup(query(1500))->pose.translation().x() > 1);
  CHECK(robot.difference(query(3000), 1, 0.01) == "");
  CHECK(robot.difference(query(3250), 0.5, 0.01) == "");
  REQUIRE(robot.forest.revise({{"arm", along_x(7), {}}}, at(3000), UINT64_MAX));
  CHECK(robot.lookup(query(3000))->pose.translation().x() == 7);
  CHECK(robot.difference(query(4000), -1, 0.01) == "");
}

TEST_CASE("the history of a joint restarts and is dropped like any other") {
  Turning robot;
  robot.turn(-2, 100'000);
  for (int i = 1; i <= 5; ++i) {
    const auto old = robot.forest.update_correlated({robot.update(3 * i, 0.01)}, at(100 * i));
    CHECK(outcome(old) == (i < 5 ? "too_old" : "ok"));
  }
  robot.turn(11, 600);
  CHECK(robot.difference(query(550), 13, 0.01) == "");
  REQUIRE(robot.forest.move("arm", ""));
  CHECK(robot.forest.histories("arm").empty());
}

TEST_CASE("a sample takes at most 120 bytes if its neighbour has the same covariance") {
  constexpr int kSamples = 10'000;
  testing::Random random(812);
  Turning robot;
  for (const char* id : {"same", "unspecified", "other"}) {
    REQUIRE(robot.forest.add(id, "base", {}));
  }
  const auto bytes = [&](const char* id) {
    const HistoryInfo history = robot.forest.histories(id).at(0);
    CHECK(history.samples == kSamples);
    return static_cast<double>(history.bytes) / kSamples;
  };
  const StatedCovariance covariance = random.covariance();
  for (int i = 1; i <= kSamples; ++i) {
    robot.turn(0.001 * i, i, 0.0001 * i);
    const Pose pose = along_x(i).pose;
    REQUIRE(robot.forest.update({{"same", {pose, covariance}},
                                 {"unspecified", {pose, StatedCovariance::unspecified()}},
                                 {"other", {pose, *Covariance::from_stddev({1.0 * i})}}},
                                at(i)));
  }
  CHECK(bytes("arm") <= 120);
  CHECK(bytes("same") <= 120);
  CHECK(bytes("unspecified") <= 120);
  CHECK(bytes("other") <= 336);
  CHECK(bytes("other") > 200);
}

// ---- watchers get poses only

TEST_CASE("a watcher computes the same between poses of a joint that turns far") {
  Turning robot;
  Turning watcher;
  std::vector<EdgeCursor> cursors{{"arm", "base"}};
  const auto follow = [&](const PushedQuery& how = {}) {
    const auto told = robot.forest.values_since(cursors, how).values;
    watcher.forest.take({watcher.arm}, told);
    return told.size();
  };
  const auto difference = [&](std::int64_t milliseconds) {
    const auto X = robot.lookup(query(milliseconds));
    const auto Y = watcher.lookup(query(milliseconds));
    return X && Y ? transform_diff(*Y, *X, 1e-9) : outcome(X) + " and " + outcome(Y);
  };
  robot.turn(-2, 1000);
  CHECK(follow() == 1);
  robot.turn(2, 2000, 0.05);
  CHECK(follow() == 2);
  robot.turn(3, 3000, 0.05);
  CHECK(follow() == 1);
  robot.turn(11, 4000, 0.01);
  robot.turn(30, 5000, 0.01);
  CHECK(follow() == 2 + 3 + 9);
  for (int t = 1000; t <= 5000; t += 10) REQUIRE(difference(t) == "");
  // Late ones change what was told between their neighbours.
  robot.turn(0, 4500, 0.02);
  robot.turn(-5, 4600, 0.02);
  robot.turn(1, 1500, 0.02);
  (void)follow();
  for (int t = 1000; t <= 5000; t += 10) REQUIRE(difference(t) == "");
  CHECK(follow() == 0);
  // At a lower rate, the positions in between are those of the samples that were told.
  robot.turn(40, 6000);
  robot.turn(60, 7000);
  CHECK(follow({true}) == 1 + 14);
  CHECK(yaw(watcher.lookup(query(6000))) == Approx(std::remainder(45, 2 * std::acos(-1.0))));
}

TEST_CASE("a segment that is sent as one transform has instants between far positions") {
  Turning robot;
  for (int t = 1; t <= 3; ++t) robot.turn(4 * t, 1000 * t);
  SeenSegments seen{0, at(1000), false};
  const auto all = robot.forest.segments_since({{"base", "arm"}}, seen, 100);
  REQUIRE(all);
  CHECK(all->size() == 4);
  for (const SegmentValues& one : *all) {
    const double position = 4e-9 * static_cast<double>(nanoseconds(*one.stamp));
    CHECK(transform_diff(one.values[0], joint_transform(robot.joint, position, 0.01), 1e-12) == "");
  }
}

}  // namespace tfdude
