#include <cmath>
#include <utility>
#include <vector>

#include "math/mean_velocity.hpp"
#include "support/catch.hpp"
#include "support/consistency.hpp"
#include "support/drifting.hpp"
#include "support/random.hpp"
#include "support/random_walk.hpp"
#include "support/sampling.hpp"
#include "tree/over_fixed.hpp"

// An edge whose error is a random walk, beside a dense filter of odometry and a landmark.
namespace tfdude {
namespace {

using testing::Approx;
using testing::at;
using testing::Drifting;
using testing::kStep;
using testing::of_deviations;
using testing::outcome;
using testing::Random;
using testing::shift;
using testing::when;

// A chain of odometry, one axis: the joint covariance of base and object, in closed form.
struct Filter {
  double base = 0;
  double object = 1;
  double both = 0;

  void drive(double steps = 1) { base += 0.02 * 0.02 * steps * kStep; }
  void see(double variance) {
    const double S = base + object - 2 * both + variance;
    const double k_base = (both - base) / S;
    const double k_object = (object - both) / S;
    const double gain_base = both - base;
    const double gain_object = object - both;
    const double new_both = both - k_base * gain_object;
    base -= k_base * gain_base;
    object -= k_object * gain_object;
    both = new_both;
  }
  [[nodiscard]] double between() const { return std::sqrt(base + object - 2 * both); }
};

using Ends = std::pair<std::vector<EdgeFromFixed>, std::vector<EdgeFromFixed>>;

// The edge of the base at two instants.
Ends ends_of(const Forest& forest, int from, int to) {
  const auto first = edges_from_fixed(forest, "world", "base", when(from));
  const auto second = edges_from_fixed(forest, "world", "base", when(to));
  REQUIRE(first);
  REQUIRE(second);
  return {*first, *second};
}

StampedTransform over(const Ends& ends, int from, int to) {
  const StampedTransform X_FA{{ends.first[0].X_PC.pose, Covariance()}, at(from)};
  const StampedTransform X_FB{{ends.second[0].X_PC.pose, Covariance()}, at(to)};
  return over_fixed(X_FA, X_FB, ends.first, ends.second, Order::kSecond);
}

// Over one second.
MeanVelocity velocity_of(const Ends& ends) {
  const EdgeFromFixed& from = ends.first[0];
  const EdgeFromFixed& to = ends.second[0];
  const bool drifts = from.drifts && to.drifts && from.corrected == to.corrected;
  return mean_velocity({{from.X_PC, to.X_PC, ObservedEdge::Way::kDown, false, drifts}}, 1);
}

}  // namespace

TEST_CASE("drift: the error of an edge grows with time, and what it was observed with stays") {
  Drifting robot;
  Filter filter;
  const Covariance R = of_deviations(0.005, 1);  // translation only, so that one axis suffices
  robot.drive(0);
  for (int step = 1; step <= 30; ++step) {
    INFO("step " << step);
    robot.drive(step);
    filter.drive();
    REQUIRE(robot.see({Pose(), R}, step, "observed:" + std::to_string(step)));
    filter.see(0.005 * 0.005);
    CHECK(robot.sigma("world", "base", step) == Approx(std::sqrt(filter.base)).epsilon(2e-3));
    CHECK(robot.sigma("world", "object", step) == Approx(std::sqrt(filter.object)).epsilon(2e-3));
    CHECK(robot.sigma("base", "object", step) == Approx(filter.between()).epsilon(2e-3));
  }
}

TEST_CASE("drift: a correction of the past is that of all later values") {
  Drifting robot;
  robot.drive(0);
  for (int step = 1; step <= 10; ++step) {
    robot.G = shift(0.1 * step);
    robot.drive(step);
  }
  REQUIRE(robot.see({shift(2 - 0.5), of_deviations(1e-3, 1e-3)}, 5, "observed:a"));
  const auto before = robot.forest.lookup("world", "base", when(5));
  const auto later = robot.forest.lookup("world", "base", when(10));
  REQUIRE(before);
  REQUIRE(later);
  // The edge moves as it was told, from where it was found to be.
  CHECK(
      (later->pose.translation() - before->pose.translation() - Eigen::Vector3d(0.5, 0, 0)).norm() <
      1e-9);
  CHECK(robot.sigma("base", "object", 5) == Approx(1e-3).epsilon(1e-2));
  const double grown = std::sqrt(1e-6 + 5 * kStep * 0.02 * 0.02);
  CHECK(robot.sigma("base", "object", 10) == Approx(grown).epsilon(0.05));
  // So does the next value.
  robot.G = shift(1.2);
  robot.drive(11);
  const auto next = robot.forest.lookup("world", "base", when(11));
  REQUIRE(next);
  CHECK(next->pose.translation().x() - later->pose.translation().x() == Approx(0.2));
}

// What is left of the error before the correction is in both, and so is a part of what was added.
TEST_CASE("drift: two instants with a correction between them have a bound") {
  Drifting robot(of_deviations(0.02, 0));
  constexpr double kSensor = 0.01 * 0.01;
  constexpr double kAdded = 5 * kStep * 0.02 * 0.02;  // from one instant to the next
  double variance = 0;
  robot.drive(0);
  for (int step = 5; step <= 40; step += 5) {
    robot.drive(step);
    variance += kAdded;
    if (step % 10 != 0) continue;
    // The edge alone, as if many samples had followed what was observed before.
    const auto seen = robot.forest.lookup_segments({{"world", "base"}}, when(step), {}, true);
    REQUIRE(seen);
    const ObservedEdge edge{belief_of(seen->values[0], seen->correlations[0]),
                            ObservedEdge::Way::kDown};
    const Transform Z{Pose(), of_deviations(0.01, 1)};
    const auto found = observe({edge}, Z, "observed:" + std::to_string(step), {1.0, true});
    REQUIRE(found);
    const Belief& X = found->edges[0].X_PC;
    REQUIRE(robot.forest.revise({{"base", {X.pose, X.own}, {false, X.common_errors, {}}}}, at(step),
                                seen->commit));
    variance = variance * kSensor / (variance + kSensor);
  }
  robot.drive(45);
  const double before = variance + kAdded;  // at 25 as at 35 and 45, but for the first steps
  const double gain = (before + kAdded) / (before + kAdded + kSensor);
  const double right = gain * gain * (before + kSensor) + (1 - gain) * (1 - gain) * kAdded + kAdded;
  const auto ends = ends_of(robot.forest, 35, 45);
  const StampedTransform X = over(ends, 35, 45);
  CHECK(X.basis.bound);
  CHECK(X.basis.sources.empty());
  CHECK(X.covariance.of_specified().upper()[0] > 0.999 * right);
  const MeanVelocity velocity = velocity_of(ends);
  CHECK(velocity.bound);
  CHECK(velocity.sources.empty());
  CHECK(velocity.covariance.upper()[0] > 0.999 * right);
  // Within one interval there is none.
  const auto between = ends_of(robot.forest, 40, 45);
  CHECK_FALSE(over(between, 40, 45).basis.bound);
  CHECK(over(between, 40, 45).covariance.of_specified().upper()[0] == Approx(kAdded));
  CHECK(velocity_of(between).covariance.upper()[0] == Approx(kAdded));
}

TEST_CASE("drift: an edge that moves as it was told has one error at two instants") {
  Drifting robot{Covariance()};
  REQUIRE(robot.forest.update("base", {robot.G, of_deviations(0.1, 0)}, at(0)));
  for (const int step : {1, 2}) robot.drive(step);
  for (const int begin : {0, 1}) {
    INFO("from step " << begin);
    const auto ends = ends_of(robot.forest, begin, 2);
    const StampedTransform X = over(ends, begin, 2);
    CHECK_FALSE(X.basis.bound);
    CHECK(X.covariance.of_specified().matrix().cwiseAbs().maxCoeff() < 1e-15);
    CHECK(velocity_of(ends).covariance.matrix().cwiseAbs().maxCoeff() < 1e-15);
  }
}

// The source is one error for all time, moved along with the edge.
TEST_CASE("drift: a source that is said later is an error of all samples that follow") {
  const auto supply = [](double size) {
    Loading F = Loading::Zero(6, 1);
    F(0, 0) = size;
    return Correlation{false, {{"supply", false, F}}, {}};
  };
  const bool observed = GENERATE(false, true);
  INFO((observed ? "observed" : "not observed"));
  Drifting robot{Covariance()};
  REQUIRE(robot.forest.update("base", {Pose(), of_deviations(observed ? 1 : 0, 0)}, at(0)));
  for (const int step : {1, 2}) robot.drive(step);
  double left = 0;
  if (observed) {
    left = 1e-3 / std::sqrt(1 + 1e-6);
    const auto seen = robot.forest.lookup_segments({{"world", "base"}}, when(1), {}, true).value();
    const Covariance own = of_deviations(left, 0);
    REQUIRE(robot.forest.revise({{"base", {Pose(), own}, {}}}, at(1), seen.commit));
  }
  REQUIRE(robot.forest.correlate("base", supply(0.1)));
  robot.drive(3);
  for (const int step : {1, 2, 3}) {
    INFO("step " << step);
    CHECK(robot.sigma("world", "base", step) == Approx(std::hypot(0.1, left)));
  }
  // Another size, then none.
  REQUIRE(robot.forest.correlate("base", supply(0.2)));
  robot.drive(4);
  CHECK(robot.sigma("world", "base", 4) == Approx(std::hypot(0.2, left)));
  REQUIRE(robot.forest.correlate("base", {}));
  robot.drive(5);
  for (const int step : {1, 3, 5}) {
    INFO("step " << step);
    CHECK(robot.sigma("world", "base", step) == Approx(left).margin(1e-12));
  }
  // What is seen late corrects the later samples, which have the source, too.
  REQUIRE(robot.forest.correlate("base", supply(0.1)));
  const auto late = robot.forest.lookup_segments({{"world", "base"}}, when(3), {}, true).value();
  const Correlation there{false, late.correlations[0].common_errors, {}};
  REQUIRE(robot.forest.revise({{"base", late.values[0], there}}, at(3), late.commit));
  robot.drive(6);
  CHECK(robot.sigma("world", "base", 6) == Approx(std::hypot(0.1, left)));
}

// A camera's stamps are rarely those of the odometry.
TEST_CASE("drift: what is seen between two samples corrects all later ones") {
  Drifting robot;
  Filter filter;
  const Covariance R = of_deviations(0.005, 1);  // translation only, so that one axis suffices
  robot.drive(0);
  const auto is_close = [](double found, double expected) {
    CHECK(found > 0.998 * expected);
    CHECK(found < 1.01 * expected);
  };
  for (int step = 1; step <= 30; ++step) {
    INFO("step " << step);
    robot.drive(step);
    const Time seen = at(step) - std::chrono::milliseconds(70);
    const auto X = robot.forest.lookup("base", "object", when(seen));
    REQUIRE(X);
    const Pose Z = step == 1 ? shift(0.4) : X->pose;
    REQUIRE(robot.see({Z, R}, seen, "observed:" + std::to_string(step)));
    filter.drive(0.3);
    filter.see(0.005 * 0.005);
    const auto corrected = robot.forest.lookup("world", "base", when(seen));
    const auto later = robot.forest.lookup("world", "base", when(step));
    REQUIRE(corrected);
    REQUIRE(later);
    CHECK((later->pose.translation() - corrected->pose.translation()).norm() < 1e-9);
    is_close(std::sqrt(robot.forest.lookup("base", "object", when(seen))
                           ->covariance.of_specified()
                           .upper()[0]),
             filter.between());
    filter.drive(0.7);
    is_close(robot.sigma("world", "base", step), std::sqrt(filter.base));
    is_close(robot.sigma("world", "object", step), std::sqrt(filter.object));
    is_close(robot.sigma("base", "object", step), filter.between());
  }
}

TEST_CASE("drift: a pose that comes late for the stamp of an observation is taken") {
  Drifting robot;
  Filter filter;
  const Covariance R = of_deviations(0.005, 1);
  robot.drive(0);
  robot.drive(2);
  REQUIRE(robot.see({shift(0.4), R}, at(1), "observed:1"));
  const auto seen = robot.forest.lookup("base", "object", when(1)).value();
  const auto later = robot.forest.lookup("world", "base", when(2)).value();
  REQUIRE(robot.forest.update("base", Transform::exact(shift(0.35)), at(1)));
  const auto twice = robot.forest.update("base", Transform::exact(shift(0.35)), at(1));
  REQUIRE_FALSE(twice);
  CHECK(twice.error().code == Errc::kStampTaken);
  const auto same = [&](const char* a, const char* b, int step, const StampedTransform& before) {
    const auto X = robot.forest.lookup(a, b, when(step)).value();
    CHECK((X.pose.matrix() - before.pose.matrix()).norm() < 1e-12);
    CHECK(X.covariance.of_specified().matrix().isApprox(before.covariance.of_specified().matrix()));
  };
  same("base", "object", 1, seen);
  same("world", "base", 2, later);
  // From there on it is on the way that was given.
  const auto here = robot.forest.lookup("world", "base", when(1)).value();
  const auto further =
      robot.forest.lookup("world", "base", when(at(1) + std::chrono::milliseconds(50))).value();
  CHECK(further.pose.translation().x() == Approx(here.pose.translation().x() - 0.175));
  // What is seen later goes on from there.
  robot.drive(3);
  filter.drive(1);
  filter.see(0.005 * 0.005);
  filter.drive(2);
  CHECK(robot.sigma("world", "base", 3) == Approx(std::sqrt(filter.base)).epsilon(0.01));
  CHECK(robot.sigma("base", "object", 3) == Approx(filter.between()).epsilon(0.01));
}

TEST_CASE("drift: the object in the map and in the base is as certain as is right in 200 runs") {
  Random random(4301);
  INFO("seed " << random.seed());
  testing::Consistency in_map;
  testing::Consistency in_base;
  for (int run = 0; run < 200; ++run) {
    Drifting robot;
    const Pose object = random.pose();
    REQUIRE(robot.forest.update("object",
                                {object * exp(random.twist(0.3, 0.1)), of_deviations(0.5, 0.3)}));
    Pose truth;
    const Pose forward = exp((Twist() << 0.3, 0, 0, 0, 0, 0.2).finished());
    const Covariance R = of_deviations(0.005, 0.005);
    const testing::Gaussian drift(Covariance::trusted(
        Matrix6d(testing::walked_in_steps(robot.Q.matrix(), log(forward), kStep))));
    const testing::Gaussian seen(R);
    robot.drive(0);
    for (int step = 1; step <= 30; ++step) {
      robot.G = robot.G * forward;
      truth = truth * forward * exp(Twist(drift(random)));
      robot.drive(step);
      const Pose Z = truth.inverse() * object * exp(Twist(seen(random)));
      REQUIRE(robot.see({Z, R}, step, "observed:" + std::to_string(step)));
    }
    in_map.add(*robot.forest.lookup("world", "object", when(30)), object);
    in_base.add(*robot.forest.lookup("base", "object", when(30)), truth.inverse() * object);
  }
  CHECK_CONSISTENT(in_map);
  CHECK_CONSISTENT(in_base);
}

TEST_CASE("drift: after a restart it goes on from where an observation has found it") {
  Drifting robot;
  Drifting restarted;
  const Covariance R = of_deviations(0.005, 0.005);
  for (int step = 0; step <= 3; ++step) {
    robot.G = shift(0.1 * step);
    robot.drive(step);
  }
  REQUIRE(robot.see({shift(2 - 0.3), R}, 2, "observed:1"));
  REQUIRE(robot.see({shift(2.1 - 0.4), R}, 3, "observed:2"));
  for (const char* id : {"base", "object"}) {
    const auto kept = robot.forest.kept(id);
    REQUIRE(kept);
    REQUIRE(restarted.forest.update(id, kept->X_PC));
    REQUIRE(restarted.forest.resume(id, kept->correlation, kept->time));
  }
  // As a configuration that is read again.
  EdgeTiming timing;
  timing.drifts = true;
  timing.process_noise = robot.Q;
  REQUIRE(restarted.forest.set_timing("base", timing));
  for (Drifting* one : {&robot, &restarted}) {
    one->G = shift(0.4);
    one->drive(4);
    REQUIRE(one->see({shift(2.2 - 0.5), R}, 4, "observed:3"));
    one->G = shift(0.5);
    one->drive(5);
  }
  for (const auto& [a, b] : {std::pair("world", "base"), std::pair("base", "object")}) {
    const auto expected = robot.forest.lookup(a, b, when(5));
    const auto found = restarted.forest.lookup(a, b, when(5));
    REQUIRE(expected);
    REQUIRE(found);
    const Matrix6d sigma = expected->covariance.of_specified().matrix();
    CHECK((found->pose.translation() - expected->pose.translation()).norm() < 1e-12);
    CHECK((found->covariance.of_specified().matrix() - sigma).norm() < 1e-9 * sigma.norm());
  }
  // Of an earlier instant, a value belongs to another clock.
  Drifting again;
  const auto kept = robot.forest.kept("base");
  REQUIRE(kept);
  REQUIRE(again.forest.resume("base", kept->correlation, kept->time));
  again.G = shift(0.2);
  again.drive(2);
  const auto X = again.forest.lookup("world", "base", when(2));
  REQUIRE(X);
  CHECK(X->pose.translation().x() == Approx(0.2));
}

TEST_CASE("drift: between a sample and a corrected one there is a bound") {
  Drifting robot;
  for (int step = 0; step < 3; ++step) {
    robot.G = robot.G * shift(0.3);
    robot.drive(step);
  }
  REQUIRE(robot.see({robot.G.inverse(), of_deviations(0.01, 0.01)}, 2, "observed:1"));
  const Time half = at(2) - std::chrono::milliseconds(50);
  const auto X = robot.forest.lookup("world", "base", when(half));
  REQUIRE(X);
  CHECK(X->pose.translation().x() == Approx(0.75).epsilon(1e-3));
  CHECK(X->covariance.complete());
  const double before = robot.sigma("world", "base", 1);
  CHECK(std::sqrt(X->covariance.of_specified().upper()[0]) > before);
}

TEST_CASE("drift: the pose does not jump where the edge alone was observed, once and again") {
  Drifting robot;
  for (int step = 0; step < 5; ++step) {
    robot.G = shift(0.3 * step);
    robot.drive(step);
    if (step != 2 && step != 4) continue;
    const auto seen = robot.forest.lookup_segments({{"world", "base"}}, when(step), {}, true);
    REQUIRE(seen);
    const ObservedEdge edge{belief_of(seen->values[0], seen->correlations[0]),
                            ObservedEdge::Way::kDown};
    const Transform Z{robot.G * shift(0.02 * step), of_deviations(1e-3, 1e-3)};
    const auto found = observe({edge}, Z, "observed:" + std::to_string(step), {1.0, true});
    REQUIRE(found);
    const Belief& X = found->edges[0].X_PC;
    REQUIRE(robot.forest.revise({{"base", {X.pose, X.own}, {false, X.common_errors, {}}}}, at(step),
                                seen->commit));
  }
  for (const int step : {2, 4}) {
    const auto there = robot.forest.lookup("world", "base", when(step));
    REQUIRE(there);
    for (const int ms : {1, 50, 99}) {
      CAPTURE(step, ms);
      const Query then = when(at(step) - std::chrono::milliseconds(ms));
      const auto X = robot.forest.lookup("world", "base", then);
      REQUIRE(X);
      if (ms == 1) CHECK((X->pose.inverse() * there->pose).translation().norm() < 5e-3);
      // The share of each sample's error, as if these were independent.
      const double s = 1 - 0.01 * ms;
      const double until = (1 - s) * robot.sigma("world", "base", step - 1);
      const double since = s * robot.sigma("world", "base", step);
      CHECK(std::sqrt(X->covariance.of_specified().upper()[0]) >= std::hypot(until, since));
    }
  }
}

TEST_CASE("drift: beyond the newest sample the error goes on from there") {
  Drifting robot;
  for (int step = 0; step < 3; ++step) {
    robot.G = robot.G * shift(0.3);
    robot.drive(step);
  }
  REQUIRE(robot.see({robot.G.inverse(), of_deviations(0.01, 0.01)}, 2, "observed:1"));
  const auto newest = robot.forest.lookup("world", "base", when(2));
  REQUIRE(newest);
  Query ahead = when(3);
  ahead.extrapolate = std::chrono::seconds(1);
  const auto X = robot.forest.lookup("world", "base", ahead);
  REQUIRE(X);
  REQUIRE(X->covariance.complete());
  // As long again as the interval of the samples. What it drifted then counts twice: 4 times its
  // variance, of which the newest sample has one.
  const Matrix6d expected =
      newest->covariance.of_specified().transported(shift(0.3).inverse()).matrix() +
      3 * testing::walked_in_steps(robot.Q.matrix(), log(shift(0.3)), kStep);
  const Matrix6d found = X->covariance.of_specified().matrix();
  CHECK((found - expected).norm() < 1e-9 * expected.norm());
  CHECK(X->pose.translation().x() == Approx(newest->pose.translation().x() + 0.3));
}

TEST_CASE("drift: a pose from before an observation is as certain late as in time") {
  Drifting late;
  Drifting in_time;
  const auto drive = [](Drifting& robot, int step) {
    robot.G = shift(0.1 * step);
    robot.drive(step);
  };
  constexpr int kLate = 5;
  for (int step = 0; step <= 10; ++step) {
    if (step != kLate) drive(late, step);
    drive(in_time, step);
  }
  const Covariance R = of_deviations(1e-3, 1e-3);
  for (Drifting* robot : {&late, &in_time}) {
    REQUIRE(robot->forest.update("object", {shift(2), R}));
    REQUIRE(robot->see({shift(1.1), R}, 10, "observed:a"));
  }
  drive(late, kLate);
  for (int step = 0; step <= 10; ++step) {
    INFO("step " << step);
    for (const auto& [a, b] : {std::pair("world", "base"), std::pair("base", "object")}) {
      CHECK(late.sigma(a, b, step) == Approx(in_time.sigma(a, b, step)));
      const auto X = late.forest.lookup(a, b, when(step)).value();
      const auto Y = in_time.forest.lookup(a, b, when(step)).value();
      CHECK((X.pose.translation() - Y.pose.translation()).norm() < 1e-12);
    }
  }
}

TEST_CASE("drift: a pose from before the first one is less certain than that") {
  Drifting robot;
  for (const int step : {2, 3}) robot.drive(step);
  const double first = robot.sigma("world", "base", 2);
  robot.drive(1);
  CHECK(robot.sigma("world", "base", 1) == Approx(std::hypot(first, 0.02 * std::sqrt(kStep))));
}

}  // namespace tfdude
