// What the gate promises: right measurements are rejected as often as it says, however curved the
// path is.

#include <cmath>
#include <string>
#include <vector>

#include "tfdude/math/fusion.hpp"
#include "tfdude/math/joint.hpp"
#include "tfdude/math/observation.hpp"

#include "support/catch.hpp"
#include "support/random.hpp"
#include "support/sampling.hpp"

namespace tfdude {
namespace {

using testing::Gaussian;
using testing::Random;

constexpr auto kDown = ObservedEdge::Way::kDown;
const std::string kSource = "observed:once";

Covariance isotropic(double metres, double radians) {
  return *Covariance::from_stddev({metres, metres, metres, radians, radians, radians});
}

// Joints half a metre apart, whose positions are known to sigma.
struct Arm {
  std::vector<Joint> joints;
  std::vector<double> positions;
  std::vector<ObservedEdge> edges;

  Arm(int count, double sigma) {
    const std::vector<int> axes = {2, 1, 2, 0, 1, 2};
    const std::vector<double> at = {0.3, 0.7, -0.4, 0.5, 0.9, 0.1};
    Pose link;
    for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i) {
      joints.push_back(revolute_joint(Transform::exact(link), Eigen::Vector3d::Unit(axes[i])));
      positions.push_back(at[i]);
      const Transform X = joint_transform(joints[i], at[i], sigma * sigma);
      edges.push_back({{X.pose, X.covariance.of_specified(), std::nullopt, {}}, kDown});
      link = Pose::trusted(Eigen::Quaterniond::Identity(), {0.5, 0, 0});
    }
    edges.push_back({{link, {}, std::nullopt, {}}, kDown});
  }

  [[nodiscard]] Pose moved(double sigma, Random& random) const {
    Pose X;
    for (std::size_t i = 0; i < joints.size(); ++i) {
      X = X * joint_transform(joints[i], positions[i] + sigma * random.normal(), 0).pose;
    }
    return X * edges.back().X_PC.pose;
  }
};

TEST_CASE("The gate rejects right measurements as often as it says") {
  Random random(911);
  INFO("seed " << random.seed());
  const int joints = GENERATE(1, 2, 3, 6);
  const double sigma = GENERATE(0.01, 0.1, 0.3);
  const double noise = GENERATE(0.001, 0.0003);
  CAPTURE(joints, sigma, noise);
  constexpr int kRuns = 300;
  constexpr double kRejected = 0.02;
  const Arm arm(joints, sigma);
  const Covariance R = isotropic(noise, noise);
  int rejected = 0;
  double sum = 0;
  for (int run = 0; run < kRuns; ++run) {
    const Transform Z{arm.moved(sigma, random) * exp(Gaussian(R)(random)), R};
    const auto observed = observe(arm.edges, Z, kSource, {1.0 - kRejected, true});
    REQUIRE(observed);
    CHECK(observed->dimensions == 6);
    rejected += observed->accepted ? 0 : 1;
    sum += observed->distance_squared;
  }
  // Four standard deviations of a binomial count.
  const double expected = kRejected * kRuns;
  INFO(rejected << " of " << kRuns << " rejected, mean distance " << sum / kRuns);
  CHECK(std::abs(rejected - expected) < 4.0 * std::sqrt(expected));
  CHECK(sum > chi_squared_quantile(1e-4, 6 * kRuns));
  CHECK(sum < chi_squared_quantile(1.0 - 1e-4, 6 * kRuns));
}

TEST_CASE("The gate rejects what no position of the joints explains") {
  Random random(912);
  INFO("seed " << random.seed());
  const double sigma = GENERATE(0.01, 0.3);
  CAPTURE(sigma);
  const Arm arm(2, sigma);
  const Covariance R = isotropic(0.001, 0.001);
  for (int run = 0; run < 100; ++run) {
    // Two joints about z and y cannot roll the end about its own axis.
    const Pose Z = arm.moved(sigma, random) * exp(0.02 * Twist::Unit(3));
    const auto observed = observe(arm.edges, {Z, R}, kSource);
    REQUIRE(observed);
    CHECK_FALSE(observed->accepted);
    CHECK(observed->distance_squared > 100.0);
    CHECK_FALSE(observed->edges[0].corrected);
  }
}

}  // namespace
}  // namespace tfdude
