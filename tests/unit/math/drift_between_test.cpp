// What a drift adds between two instants, beside values that are computed sample by sample: each
// has the error of the one before, and what the walk has added on the way.

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>

#include "tfdude/math/perturbation.hpp"

#include "math/drift.hpp"
#include "math/random_walk.hpp"
#include "support/catch.hpp"
#include "support/random.hpp"
#include "support/random_walk.hpp"
#include "support/sampling.hpp"

namespace tfdude {
namespace {

using testing::Random;

constexpr double kInterval = 0.1;  // [s] between samples

// A base that drives evenly, from a start that is known exactly.
struct Drive {
  Twist velocity = Twist::Zero();
  Matrix6d Q = Matrix6d::Zero();  // per second

  [[nodiscard]] Belief at(double t) const {
    Belief X;
    double since = t;
    for (; since >= kInterval; since -= kInterval) move(X, kInterval);
    move(X, since);
    return X;
  }
  void move(Belief& X, double seconds) const {
    const Pose step = exp(Twist(seconds * velocity));
    X.pose = X.pose * step;
    X.own = X.own.transported(step.inverse()) + walked(Covariance::trusted(Q), step, seconds);
  }
};

Matrix6d of_deviations(const Twist& stddev) { return stddev.cwiseAbs2().asDiagonal(); }

Twist deviations(double x, double y, double yaw) {
  Twist stddev = Twist::Zero();
  stddev[0] = x;
  stddev[1] = y;
  stddev[5] = yaw;
  return stddev;
}

// Sample by sample, in small steps.
Matrix6d added_between(const Drive& drive, double from, double to) {
  Matrix6d sum = Matrix6d::Zero();
  for (double t = from; t < to;) {
    const double over = std::min(kInterval, to - t);
    const Matrix6d A = testing::adjoint_of_exp(Twist(-over * drive.velocity));
    sum = (A * sum * A.transpose() +
           testing::walked_in_steps(drive.Q, Twist(over * drive.velocity), over))
              .eval();
    t += over;
  }
  return sum;
}

// In units of the deviations along the axes.
void check_added(const Drive& drive, double first, double over) {
  INFO("velocity " << drive.velocity.transpose() << ", noise "
                   << drive.Q.diagonal().cwiseSqrt().transpose() << ", " << over << " s from "
                   << first);
  const Belief later = drive.at(first + over);
  const auto drift = drift_between(drive.at(first), later);
  REQUIRE(drift);
  const Matrix6d expected = added_between(drive, first, first + over);
  const Matrix6d difference = drift->added.matrix() - expected;
  // A difference of what has been added since the start has its rounding.
  const Twist sum = 1e-8 * later.own.matrix().diagonal();
  for (Eigen::Index i = 0; i < 6; ++i) {
    for (Eigen::Index j = 0; j < 6; ++j) {
      const double size = std::sqrt(expected(i, i) * expected(j, j));
      CHECK(std::abs(difference(i, j)) <= 1e-5 * size + std::sqrt(sum[i] * sum[j]));
    }
  }
  const Matrix6d allowed = (1e-6 * expected.diagonal() + sum).asDiagonal();
  CHECK(testing::domination(drift->added.matrix() + allowed, expected) > -1e-12);
}

}  // namespace

TEST_CASE("drift between: of a base with noise on some axes it is what the walk adds") {
  Random random(8101);
  INFO("seed " << random.seed());
  Drive drive;
  const Twist noises[] = {deviations(0.06, 0, 0.03), deviations(0, 0, 0.03),
                          deviations(0.06, 0.06, 0.03)};
  for (const Twist& noise : noises) {
    drive.Q = of_deviations(noise);
    for (const double turns : {0.0, 0.5, 2.0, 10.0, 30.0}) {
      drive.velocity << 1, 0, 0, 0, 0, turns;
      for (int round = 0; round < 20; ++round) {
        // From the start of the history, and later; within one interval, and beyond.
        const double first = random.uniform(0, round % 2 == 0 ? 0.3 : 5);
        check_added(drive, first, round % 3 == 0 ? 0.5 : 0.02);
      }
    }
  }
}

TEST_CASE("drift between: of any motion, with turns of up to half a turn from sample to sample") {
  Random random(8103);
  INFO("seed " << random.seed());
  for (const double turn : {0.0, 0.3, 1.0, 3.1}) {
    for (int round = 0; round < 50; ++round) {
      Drive drive;
      drive.velocity << random.vector(3), turn / kInterval * random.direction();
      Twist noise;
      for (double& one : noise) one = random.index(2) == 0 ? 0.0 : random.uniform(0.001, 0.1);
      drive.Q = of_deviations(noise);
      check_added(drive, random.uniform(0, 2), random.uniform(0.01, 0.5));
    }
  }
}

// A pose that comes late tells another way to the later value than that from which it was computed.
TEST_CASE("drift between: what is missing for want of a late pose is made up for") {
  Random random(8104);
  INFO("seed " << random.seed());
  Drive drive;
  drive.Q = of_deviations(deviations(0.06, 0, 0.03));
  drive.velocity << 1, 0, 0, 0, 0, 0.5;
  const Belief earlier = drive.at(2);
  Belief later = drive.at(2.02);
  Matrix6d missing = Matrix6d::Zero();
  missing(1, 1) = 2e-3 * later.own.matrix()(1, 1);
  later.own = Covariance::trusted(Matrix6d(later.own.matrix() - missing));
  const auto drift = drift_between(earlier, later);
  REQUIRE(drift);
  const Matrix6d rest = later.own.matrix() - drift->F * earlier.own.matrix() * drift->F.transpose();
  CHECK(testing::domination(drift->added.matrix() + 1e-15 * Matrix6d::Identity(), rest) > -1e-9);
  CHECK(drift->added.matrix()(1, 1) > 5 * missing(1, 1));
}

TEST_CASE("drift between: a correction of the later value alone leaves no drift") {
  Random random(8102);
  INFO("seed " << random.seed());
  Drive drive;
  drive.Q = of_deviations(deviations(0.06, 0.06, 0.03));
  drive.velocity << 1, 0, 0, 0, 0, 0.5;
  for (const double first : {0.53, 2.03, 9.03}) {
    for (const double over : {0.02, 0.5, 2.0, 8.0}) {
      INFO(over << " s from " << first);
      const Belief earlier = drive.at(first);
      const Belief predicted = drive.at(first + over);
      REQUIRE(drift_between(earlier, predicted));
      const Matrix6d sigma = predicted.own.matrix();
      Belief later = predicted;
      later.own = {};
      CHECK_FALSE(drift_between(earlier, later));
      if (over > first) continue;  // most of the error has been added since
      // What was seen of one direction.
      for (const Eigen::Index axis : {0, 1, 5}) {
        INFO("axis " << axis);
        const Twist seen = sigma.col(axis);
        later.own = Covariance::trusted(
            Matrix6d(sigma - 0.9 / sigma(axis, axis) * seen * seen.transpose()));
        const auto drift = drift_between(earlier, later);
        if (!drift) continue;
        // A small correction may not be told from a late pose. The covariance is hardly too small.
        Matrix6d left = Matrix6d::Identity();
        left.col(axis) -= 0.9 / sigma(axis, axis) * seen;
        const Matrix6d carried = drift->F * earlier.own.matrix();
        for (int k = 0; k < 200; ++k) {
          Twist before;
          Twist after;
          for (Twist* v : {&before, &after}) {
            for (double& one : *v) one = random.normal();
          }
          const double right = before.dot(earlier.own.matrix() * before) +
                               2 * after.dot(left * carried * before) +
                               after.dot(later.own.matrix() * after);
          const Twist both = before + drift->F.transpose() * after;
          const double got =
              both.dot(earlier.own.matrix() * both) + after.dot(drift->added.matrix() * after);
          CHECK(got > 0.999 * right);
        }
      }
    }
  }
}

}  // namespace tfdude
