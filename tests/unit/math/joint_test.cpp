#include "tfdude/math/joint.hpp"

#include <cmath>
#include <vector>

#include "math/joint_state.hpp"
#include "support/catch.hpp"
#include "support/pose_diff.hpp"
#include "support/random.hpp"
#include "support/sampling.hpp"

namespace {

using tfdude::Covariance;
using tfdude::Joint;
using tfdude::Matrix6d;
using tfdude::PreparedJoint;
using tfdude::StatedCovariance;
using tfdude::Transform;
using tfdude::Twist;
using tfdude::testing::pose_diff;
using tfdude::testing::Random;
using tfdude::testing::transform_diff;

// Rodrigues's formula: I + sin q K + (1 - cos q) K².
Eigen::Matrix3d turned(const Eigen::Vector3d& axis, double q) {
  Eigen::Matrix3d K;
  K << 0, -axis.z(), axis.y(), axis.z(), 0, -axis.x(), -axis.y(), axis.x(), 0;
  return Eigen::Matrix3d::Identity() + std::sin(q) * K + (1 - std::cos(q)) * K * K;
}

Transform exact(const Transform& X) { return {X.pose, Covariance()}; }

double difference(const Matrix6d& a, const Matrix6d& b) { return (a - b).cwiseAbs().maxCoeff(); }

}  // namespace

TEST_CASE("joint: a revolute joint turns about its axis, a prismatic one shifts along it") {
  Random random(1);
  INFO("seed " << random.seed());
  for (int run = 0; run < 500; ++run) {
    const Transform X_PJ = random.transform();
    const Eigen::Vector3d axis = random.direction();
    const double q = random.uniform(-10, 10);
    Eigen::Matrix4d moved = Eigen::Matrix4d::Identity();
    moved.topLeftCorner<3, 3>() = turned(axis, q);
    const auto X_turned = tfdude::joint_transform(revolute_joint(X_PJ, axis), q, 0).pose;
    REQUIRE((X_turned.matrix() - X_PJ.pose.matrix() * moved).cwiseAbs().maxCoeff() < 1e-14);
    moved.setIdentity();
    moved.topRightCorner<3, 1>() = q * axis;
    const auto X_shifted = tfdude::joint_transform(prismatic_joint(X_PJ, axis), q, 0).pose;
    REQUIRE((X_shifted.matrix() - X_PJ.pose.matrix() * moved).cwiseAbs().maxCoeff() < 1e-13);
  }
}

TEST_CASE("joint: at zero the child has the pose of the origin") {
  Random random(2);
  INFO("seed " << random.seed());
  const Transform X_PJ = random.transform();
  const auto X = tfdude::joint_transform(revolute_joint(X_PJ, random.direction()), 0, 0);
  CHECK((X.pose.matrix() - X_PJ.pose.matrix()).cwiseAbs().maxCoeff() < 1e-15);
  CHECK(difference(X.covariance.of_specified().matrix(), X_PJ.covariance.of_specified().matrix()) <
        1e-17);
}

TEST_CASE("joint: the position's variance gives a covariance of rank one along the twist") {
  Random random(3);
  INFO("seed " << random.seed());
  for (int run = 0; run < 100; ++run) {
    const Eigen::Vector3d axis = random.direction();
    const double q = random.uniform(-4, 4);
    const Transform X_PJ = exact(random.transform());
    for (const Joint& joint : {revolute_joint(X_PJ, axis), prismatic_joint(X_PJ, axis)}) {
      const Matrix6d sigma =
          tfdude::joint_transform(joint, q, 0.25).covariance.of_specified().matrix();
      REQUIRE(difference(sigma, 0.25 * joint.S * joint.S.transpose()) < 1e-16);
      const Twist eigen = tfdude::testing::eigenvalues(sigma);
      REQUIRE(eigen[5] == tfdude::testing::Approx(0.25));
      REQUIRE(eigen.head<5>().cwiseAbs().maxCoeff() < 1e-15);
    }
  }
}

TEST_CASE("joint: the origin's error is transported to the child") {
  Random random(4);
  INFO("seed " << random.seed());
  for (int run = 0; run < 100; ++run) {
    const Transform X_PJ = random.transform();
    const Joint joint = revolute_joint(X_PJ, random.direction());
    const double q = random.uniform(-4, 4);
    const Transform X = tfdude::joint_transform(joint, q, 0.01);
    const Transform X_JC =
        tfdude::joint_transform(revolute_joint(Transform::exact({}), joint.S.tail<3>()), q, 0.01);
    const Transform composed = tfdude::compose(X_PJ, X_JC);
    REQUIRE(difference(X.covariance.of_specified().matrix(),
                       composed.covariance.of_specified().matrix()) < 1e-15);
  }
}

TEST_CASE("joint: the covariance is that of samples of position and origin") {
  Random random(5);
  INFO("seed " << random.seed());
  constexpr int kSamples = 20000;
  constexpr double kSigma = 2e-3;
  for (int run = 0; run < 4; ++run) {
    const Transform X_PJ = random.transform(2.0, 1e-3, 1e-3);
    const Eigen::Vector3d axis = random.direction();
    const Joint joint = run % 2 == 0 ? revolute_joint(X_PJ, axis) : prismatic_joint(X_PJ, axis);
    const double q = random.uniform(-3, 3);
    const Transform X = tfdude::joint_transform(joint, q, kSigma * kSigma);
    const tfdude::testing::Gaussian origin(X_PJ.covariance);
    const auto sample = [&] {
      Joint off = joint;
      off.X_PJ.pose = X_PJ.pose * tfdude::exp(Twist(origin(random)));
      const auto X_off = tfdude::joint_transform(off, q + kSigma * random.normal(), 0);
      return tfdude::log(X.pose.inverse() * X_off.pose);
    };
    const Matrix6d sampled = tfdude::testing::second_moment(kSamples, sample);
    const auto wrong =
        tfdude::testing::moment_diff(sampled, X.covariance.of_specified().matrix(), kSamples, 1e-4);
    CHECK(wrong == "");
  }
}

TEST_CASE("joint: a position's error is exact however large it is") {
  const Eigen::Vector3d axis = Eigen::Vector3d(1, 2, 2) / 3;
  const Joint joint = revolute_joint(Transform::exact({}), axis);
  const auto off = tfdude::joint_transform(joint, 0.5, 0).pose.inverse() *
                   tfdude::joint_transform(joint, 3.0, 0).pose;
  CHECK((tfdude::log(off) - 2.5 * joint.S).norm() < 1e-14);
}

TEST_CASE("joint: a prepared joint gives the values of joint_transform") {
  Random random(409);
  INFO("seed " << random.seed());
  const Transform unspecified{random.pose(), StatedCovariance::unspecified()};
  for (const Transform& X_PJ : {exact(random.transform()), random.transform(), unspecified}) {
    for (const Joint& joint : {tfdude::revolute_joint(X_PJ, random.direction()),
                               tfdude::prismatic_joint(X_PJ, random.direction()),
                               Joint{X_PJ, random.twist(1)}, Joint{X_PJ, random.twist(0.4, 0)}}) {
      const PreparedJoint prepared(joint);
      for (const double position : {0.0, 1e-9, -0.3, 3.2, -40.0}) {
        const Transform expected = tfdude::joint_transform(joint, position, 0.04);
        Transform X = unspecified;
        prepared.compute({position, 0.04}, X);
        CHECK(transform_diff(X, expected, 1e-12) == "");
        CHECK(pose_diff(prepared.pose(position), expected.pose, 1e-12) == "");
      }
    }
  }
}
