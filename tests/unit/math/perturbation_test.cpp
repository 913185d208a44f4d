#include "tfdude/math/perturbation.hpp"

#include <cmath>
#include <functional>

#include "support/catch.hpp"
#include "support/jacobian.hpp"
#include "support/pose_diff.hpp"
#include "support/random.hpp"
#include "support/sampling.hpp"

namespace tfdude {
namespace {

using testing::covariance_diff;
using testing::Gaussian;
using testing::Random;

constexpr int kSamples = 100'000;

// A convention by which errors are sampled or measured.
struct Convention {
  const char* name;
  std::function<Pose(const Pose&, const Twist&)> perturb;
  std::function<Twist(const Pose&, const Pose&)> error;
  std::function<StatedCovariance(const Transform&)> of_right;
  std::function<Transform(const Pose&, const StatedCovariance&)> to_right;
};

const std::vector<Convention>& conventions() {
  static const std::vector<Convention> all = {
      {"right", [](const Pose& X, const Twist& xi) { return X * exp(xi); },
       [](const Pose& mean, const Pose& X) { return log(mean.inverse() * X); },
       [](const Transform& X) { return X.covariance; },
       [](const Pose& X, const StatedCovariance& S) {
         return Transform{X, S};
       }},
      {"left", [](const Pose& X, const Twist& xi) { return exp(xi) * X; },
       [](const Pose& mean, const Pose& X) { return log(X * mean.inverse()); }, left_covariance,
       from_left_covariance},
      // As in geometry_msgs/PoseWithCovariance: x, y, z, then turns about axes of the parent's
      // directions.
      {"ROS",
       [](const Pose& X, const Twist& xi) {
         const Eigen::Quaterniond turn =
             exp((Twist() << 0, 0, 0, xi.tail<3>()).finished()).rotation();
         return Pose::trusted(turn * X.rotation(), X.translation() + xi.head<3>());
       },
       [](const Pose& mean, const Pose& X) {
         const Pose turn =
             Pose::trusted(X.rotation() * mean.rotation().conjugate(), Eigen::Vector3d::Zero());
         return (Twist() << X.translation() - mean.translation(), log(turn).tail<3>()).finished();
       },
       ros_covariance, from_ros_covariance}};
  return all;
}

TEST_CASE("A covariance converted between conventions is that of samples") {
  Random random(601);
  INFO("seed " << random.seed());
  for (const Convention& drawn : conventions()) {
    for (const Convention& measured : conventions()) {
      INFO("drawn " << drawn.name << ", measured " << measured.name);
      const Pose mean = random.pose();
      const Covariance given = random.covariance(0.01, 0.004);
      const Gaussian gaussian(given);
      const Matrix6d sampled = testing::second_moment(
          kSamples, [&] { return measured.error(mean, drawn.perturb(mean, gaussian(random))); });
      const Transform right = drawn.to_right(mean, given);
      const Matrix6d computed = measured.of_right(right).of_specified().matrix();
      CHECK(testing::moment_diff(sampled, computed, kSamples, 1e-3) == "");
      // The samples tell conventions apart: of another, the same numbers do not pass.
      if (drawn.name != measured.name) {
        CHECK(testing::moment_diff(sampled, given.matrix(), kSamples, 1e-3) != "");
      }
    }
  }
}

TEST_CASE("Conversions between conventions are each other's inverse") {
  Random random(602);
  INFO("seed " << random.seed());
  for (int i = 0; i < 100; ++i) {
    const Transform X = random.transform(100.0);
    for (const Convention& one : conventions()) {
      INFO(one.name);
      const Transform back = one.to_right(X.pose, one.of_right(X));
      CHECK(covariance_diff(back.covariance, X.covariance, 1e-9) == "");
    }
  }
}

TEST_CASE("ROS's covariance of a camera that looks along x is along the parent's axes") {
  // A quarter turn about z: the child's x is the parent's y.
  const Pose X = Pose::trusted(from_rpy(0, 0, M_PI / 2), {5, 0, 0});
  const auto along_x = Covariance::from_stddev({0.1, 0, 0, 0.01, 0, 0});
  REQUIRE(along_x);
  const auto ros = ros_covariance({X, *along_x}).of_specified().stddev();
  CHECK(ros[0] == testing::Approx(0).margin(1e-12));
  CHECK(ros[1] == testing::Approx(0.1));
  CHECK(ros[3] == testing::Approx(0).margin(1e-12));
  CHECK(ros[4] == testing::Approx(0.01));
}

TEST_CASE("Deviations beside coordinates are those of sampled coordinates") {
  Random random(604);
  INFO("seed " << random.seed());
  const Transform X{random.pose(), random.covariance(0.01, 0.004)};
  const Covariance given = *X.covariance.if_complete();
  const Gaussian gaussian(given);
  Eigen::Vector3d squares = Eigen::Vector3d::Zero();
  for (int i = 0; i < kSamples; ++i) {
    const Pose drawn = X.pose * exp(gaussian(random));
    squares += (drawn.translation() - X.pose.translation()).cwiseAbs2();
  }
  const auto s = stddev_in_parent(X);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double sampled = std::sqrt(squares[static_cast<Eigen::Index>(axis)] / kSamples);
    CHECK(s[axis] == testing::Approx(sampled).epsilon(0.01));
    CHECK(s[axis + 3] == given.stddev()[axis + 3]);
  }
}

TEST_CASE("The right Jacobian is the derivative of the exponential") {
  Random random(603);
  INFO("seed " << random.seed());
  for (const double angle : {0.0, 1e-9, 0.1, 1.5, 3.0, M_PI, 4.0, 20.0}) {
    INFO("angle " << angle);
    const Twist xi = random.twist(angle);
    const Matrix6d numeric =
        testing::numeric_jacobian([&](const Twist& delta) { return exp(xi + delta); });
    CHECK((right_jacobian(xi) - numeric).cwiseAbs().maxCoeff() < 1e-6);
    CHECK((right_jacobian(xi) * xi - xi).cwiseAbs().maxCoeff() < 1e-12);
  }
}

}  // namespace
}  // namespace tfdude
