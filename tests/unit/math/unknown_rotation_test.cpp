// Measurements whose rotation says nothing, or nothing about some axes: a GNSS receiver's position,
// an object without an orientation.

#include <cmath>

#include <Eigen/Cholesky>
#include <Eigen/LU>

#include "tfdude/math/fusion.hpp"
#include "tfdude/math/observation.hpp"
#include "tfdude/math/perturbation.hpp"

#include "support/catch.hpp"
#include "support/random.hpp"
#include "support/sampling.hpp"

namespace tfdude {
namespace {

using testing::Approx;
using testing::Gaussian;
using testing::Random;
using testing::squared_distance;

constexpr double kNothing = 100;  // [rad²]

Eigen::Matrix3d semidefinite(Random& random, double sigma) {
  const Eigen::Matrix3d A = Eigen::Matrix3d::NullaryExpr([&] { return sigma * random.normal(); });
  return A * A.transpose();
}

Covariance blocks(const Eigen::Matrix3d& translation, const Eigen::Matrix3d& rotation) {
  Matrix6d sigma = Matrix6d::Zero();
  sigma.topLeftCorner<3, 3>() = translation;
  sigma.bottomRightCorner<3, 3>() = rotation;
  return Covariance::trusted(sigma);
}

// With the covariance of the translation in A's axes.
Transform only_position(const Eigen::Vector3d& at, const Eigen::Matrix3d& in_A, const Pose& turned,
                        const Eigen::Matrix3d& rotation) {
  const Eigen::Matrix3d R = turned.rotation().toRotationMatrix();
  return {Pose::trusted(turned.rotation(), at), blocks(R.transpose() * in_A * R, rotation)};
}

// Of the position, in A's axes.
Eigen::Matrix3d of_position(const Transform& X_AB) {
  const Eigen::Matrix3d R = X_AB.pose.rotation().toRotationMatrix();
  return R * X_AB.covariance.of_specified().matrix().topLeftCorner<3, 3>() * R.transpose();
}

void check_kalman(const Transform& found, const Eigen::Vector3d& before, const Eigen::Matrix3d& P,
                  const Eigen::Vector3d& seen, const Eigen::Matrix3d& R) {
  const Eigen::Matrix3d gain = P * (P + R).inverse();
  const Eigen::Vector3d expected = before + gain * (seen - before);
  const Eigen::Matrix3d posterior = P - gain * P;
  CHECK((found.pose.translation() - expected).norm() < 1e-4 * std::sqrt(P.trace()));
  CHECK((of_position(found) - posterior).norm() < 1e-4 * posterior.norm());
}

}  // namespace

TEST_CASE("A position without a rotation corrects a position as a Kalman filter of positions") {
  Random random(0x9051);
  INFO("seed " << random.seed());
  for (int i = 0; i < 300; ++i) {
    const Pose X_AB = random.pose();
    // The rotation is nearly known, and nothing couples it with the position.
    const Eigen::Matrix3d turns = Eigen::Matrix3d::Identity() * 1e-12;
    const Eigen::Matrix3d P_B = semidefinite(random, 1);
    const Transform prior{X_AB, blocks(P_B, turns)};
    const Eigen::Matrix3d P = of_position(prior);
    const Eigen::Matrix3d R = semidefinite(random, 0.3);
    const Eigen::Vector3d seen =
        X_AB.translation() + Eigen::LLT<Eigen::Matrix3d>(P + R).matrixL() * random.vector(1);
    const double nothing = random.index(2) == 0 ? kNothing : 1e18;
    INFO("nothing " << nothing);
    const Transform Z =
        only_position(seen, R, random.pose(), Eigen::Matrix3d::Identity() * nothing);
    const auto one = observe({{{X_AB, prior.covariance.of_specified(), {}, {}}}}, Z, "seen", {});
    REQUIRE(one);
    CHECK(one->accepted);
    CHECK(one->dimensions == 3);
    const Belief& found = one->edges.front().X_PC;
    check_kalman({found.pose, found.own}, X_AB.translation(), P, seen, R);
    const auto fused =
        fuse({only_position(seen, R, random.pose(), turns * kNothing * 1e12), prior});
    REQUIRE(fused);
    check_kalman(fused->X, X_AB.translation(), P, seen, R);
  }
}

TEST_CASE("A measurement that knows nothing of some rotations is consistent in 2000 runs") {
  Random random(0x9052);
  INFO("seed " << random.seed());
  const int unknown = GENERATE(1, 2, 3);
  INFO(unknown << " axes");
  double sum = 0;
  constexpr int kRuns = 2000;
  for (int run = 0; run < kRuns; ++run) {
    Matrix6d P = Matrix6d::Identity();
    P.topLeftCorner<3, 3>() = semidefinite(random, 0.5);
    P.bottomRightCorner<3, 3>() = semidefinite(random, 0.02);
    const Covariance prior = Covariance::trusted(P);
    const Pose X_AB = random.pose();
    const Pose truth = X_AB * exp(Gaussian(prior)(random));
    // In the axes of the rotation that it has by chance.
    const double sigma = 0.1;
    const double turn = 0.01;
    Eigen::Matrix3d turns = Eigen::Matrix3d::Identity() * turn * turn;
    Twist noise = Twist::Zero();
    Twist turned = Twist::Zero();
    Eigen::Vector3d chance = Eigen::Vector3d::Zero();
    for (int axis = 0; axis < 3; ++axis) {
      noise[axis] = sigma * random.normal();
      turned[3 + axis] = turn * random.normal();
      if (axis < 3 - unknown) continue;
      turns(axis, axis) = kNothing;
      // Towards half a turn across a known axis, nothing is known about that any more.
      chance[axis] = random.uniform(-1, 1) * (unknown == 2 ? 1.0 : 3.1 / std::sqrt(unknown));
      turned[3 + axis] = 0;
    }
    Twist by_chance = Twist::Zero();
    by_chance.tail<3>() = chance;
    const Pose seen = truth * exp(noise) * exp(by_chance) * exp(turned);
    const Eigen::Matrix3d translation = Eigen::Matrix3d::Identity() * sigma * sigma;
    const Transform Z{seen, blocks(translation, turns)};
    ObserveOptions options;
    options.gate = 1;
    const auto one = observe({{{X_AB, prior, {}, {}}}}, Z, "seen", options);
    REQUIRE(one);
    const Belief& found = one->edges.front().X_PC;
    const Twist e = log(found.pose.inverse() * truth);
    sum += squared_distance(e, found.own.matrix());
  }
  // 4 standard deviations of the mean of χ² with 6 dimensions.
  CHECK(std::abs(sum / kRuns - 6) < 4 * std::sqrt(12.0 / kRuns));
}

TEST_CASE("How little is said of unknown axes does not change what is said of the others") {
  Random random(0x1e9);
  INFO("seed " << random.seed());
  for (int i = 0; i < 300; ++i) {
    const Transform prior{random.pose(), blocks(0.01 * Eigen::Matrix3d::Identity(),
                                                0.0025 * Eigen::Matrix3d::Identity())};
    const Pose Z_AB =
        prior.pose * exp(Twist(0.02 * Twist::NullaryExpr([&] { return random.normal(); })));
    // About one to three axes nothing is known, and perhaps nothing of z.
    const auto unknown = static_cast<Eigen::Index>(1 + random.index(3));
    const bool without_z = random.index(2) == 0;
    const auto fused = [&](double sigma) {
      Twist deviations;
      deviations << 0.002, 0.003, without_z ? sigma : 0.004, 0.007, 0.006, 0.005;
      deviations.segment(3, unknown).setConstant(sigma);
      const Transform Z{Z_AB, Covariance::trusted(Matrix6d(deviations.cwiseAbs2().asDiagonal()))};
      return fuse({prior, Z}).value();
    };
    const Transform expected = fused(1e3).X;
    const Twist deviations = expected.covariance.of_specified().matrix().diagonal().cwiseSqrt();
    for (const double sigma : {1e5, 1e7, 1e9}) {
      INFO(unknown << " unknown axes, z " << !without_z << ", sigma " << sigma);
      const Transform found = fused(sigma).X;
      const Twist off = log(expected.pose.inverse() * found.pose).cwiseQuotient(deviations);
      CHECK(off.cwiseAbs().maxCoeff() < 5e-3);
      const Twist ratio =
          found.covariance.of_specified().matrix().diagonal().cwiseSqrt().cwiseQuotient(deviations);
      CHECK(ratio.maxCoeff() < 1 + 1e-3);
      CHECK(ratio.minCoeff() > 1 - 1e-3);
    }
  }
}

}  // namespace tfdude
