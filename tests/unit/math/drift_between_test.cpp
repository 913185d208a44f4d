// What a drift adds between two instants, beside values that are computed sample by sample: each
// has the error of the one before, and Q Δt.

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>

#include "tfdude/math/perturbation.hpp"

#include "math/drift.hpp"
#include "support/catch.hpp"
#include "support/random.hpp"
#include "support/sampling.hpp"

namespace tfdude {
namespace {

using testing::Random;

constexpr double kInterval = 0.1;  // [s] between samples

// A base that drives evenly, from a start that is known exactly.
struct Drive {
  Twist velocity = Twist::Zero();
  Matrix6d Q = Matrix6d::Zero();  // per second

  [[nodiscard]] Matrix6d carried(const Matrix6d& sigma, double seconds) const {
    const Matrix6d A = adjoint(exp(-seconds * velocity));
    return A * sigma * A.transpose();
  }
  [[nodiscard]] Belief at(double t) const {
    Matrix6d sigma = Matrix6d::Zero();
    double since = t;
    for (; since >= kInterval; since -= kInterval) {
      sigma = (carried(sigma, kInterval) + kInterval * Q).eval();
    }
    sigma = (carried(sigma, since) + since * Q).eval();
    Belief X;
    X.pose = exp(t * velocity);
    X.own = Covariance::trusted(Matrix6d(0.5 * (sigma + sigma.transpose())));
    return X;
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

// The smallest share that `got` has of `wanted`, in any direction in which that is not nothing.
double smallest_share(const Matrix6d& got, const Matrix6d& wanted, Random& random) {
  double least = 1e9;
  for (int k = 0; k < 200; ++k) {
    Twist v;
    for (double& one : v) one = random.normal();
    const double of_wanted = v.dot(wanted * v);
    if (of_wanted > 0) least = std::min(least, v.dot(got * v) / of_wanted);
  }
  return least;
}

}  // namespace

TEST_CASE("drift between: noise on some axes only seldom has a bound, and no less than it adds") {
  Random random(8101);
  INFO("seed " << random.seed());
  Drive drive;
  const Twist noises[] = {deviations(0.06, 0, 0.03), deviations(0, 0, 0.03),
                          deviations(0.06, 0.06, 0.03)};
  for (const Twist& noise : noises) {
    drive.Q = of_deviations(noise);
    for (const double turns : {0.0, 0.5, 2.0}) {
      drive.velocity << 1, 0, 0, 0, 0, turns;
      int bounds = 0;
      for (int round = 0; round < 200; ++round) {
        // From the start of the history, and later; within one interval, and beyond.
        const double first = random.uniform(0, round % 2 == 0 ? 0.3 : 5);
        const double over = round % 3 == 0 ? 0.5 : 0.02;
        INFO("noise " << noise.transpose() << ", turns " << turns << ", " << over << " s from "
                      << first);
        const Belief earlier = drive.at(first);
        const Belief later = drive.at(first + over);
        const auto drift = drift_between(earlier, later);
        if (!drift) {
          CHECK(first < 3 * kInterval);
          ++bounds;
          continue;
        }
        const Matrix6d added = drift->added.matrix();
        const Matrix6d least =
            later.own.matrix() - drift->F * earlier.own.matrix() * drift->F.transpose();
        CHECK(testing::domination(added + 1e-12 * Matrix6d::Identity(), least) > -1e-6);
        for (const Eigen::Index axis : {0, 5}) {
          if (noise[axis] == 0) continue;
          CHECK(std::sqrt(added(axis, axis)) < 1.3 * noise[axis] * std::sqrt(over));
        }
        const bool within = std::floor(first / kInterval) == std::floor((first + over) / kInterval);
        if (within) CHECK(smallest_share(added, over * drive.Q, random) > 0.95);
      }
      INFO("noise " << noise.transpose() << ", turns " << turns);
      CHECK(bounds < 30);
    }
  }
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
        // A small correction may be taken for a lever. The covariance is then hardly too small.
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
          CHECK(got > 0.98 * right);
        }
      }
    }
  }
}

}  // namespace tfdude
