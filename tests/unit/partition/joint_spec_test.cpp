#include "tfdude/types/joint_spec.hpp"

#include <cmath>
#include <string>

#include "support/catch.hpp"
#include "support/random.hpp"

namespace {

using tfdude::JointLimits;
using tfdude::JointSpec;
using tfdude::JointType;
using tfdude::testing::Approx;
using tfdude::testing::Random;

}  // namespace

TEST_CASE("joints: types have names") {
  CHECK(std::string(to_string(JointType::kRevolute)) == "revolute");
  CHECK(std::string(to_string(JointType::kContinuous)) == "continuous");
  CHECK(std::string(to_string(JointType::kPrismatic)) == "prismatic");
}

TEST_CASE("joints: the rest position is the one within the limits that is nearest to zero") {
  CHECK(tfdude::rest_position(std::nullopt) == 0);
  CHECK(tfdude::rest_position(JointLimits{-1, 2}) == 0);
  CHECK(tfdude::rest_position(JointLimits{1, 2}) == 1);
  CHECK(tfdude::rest_position(JointLimits{-3, -2}) == -2);
  CHECK(tfdude::rest_position(JointLimits{4, 4}) == 4);
}

TEST_CASE("joints: an unmeasured position has the variance of a uniform one within the limits") {
  Random random(6);
  INFO("seed " << random.seed());
  constexpr int kSteps = 100000;
  for (int run = 0; run < 20; ++run) {
    const double lower = random.uniform(-3, 3);
    const JointLimits limits{lower, lower + random.uniform(0, 3)};
    const double at = random.uniform(limits.lower, limits.upper);
    double sum = 0;
    for (int i = 0; i < kSteps; ++i) {
      const double share = (i + 0.5) / kSteps;
      sum += std::pow(limits.lower + share * (limits.upper - limits.lower) - at, 2);
    }
    const auto variance = tfdude::unmeasured_variance(JointType::kRevolute, limits, at);
    REQUIRE(variance);
    REQUIRE(*variance == Approx(sum / kSteps).epsilon(1e-6).margin(1e-12));
  }
  const double turn = std::pow(std::acos(-1.0), 2) / 3;  // of -π to π
  CHECK(*tfdude::unmeasured_variance(JointType::kContinuous, std::nullopt, 5) == Approx(turn));
  CHECK_FALSE(tfdude::unmeasured_variance(JointType::kPrismatic, std::nullopt, 5));
  CHECK(tfdude::unmeasured_variance(JointType::kPrismatic, JointLimits{2, 2}, 2) == 0);
}

TEST_CASE("joints: a coupled joint's own covariance is only that of its origin") {
  JointSpec joint;
  joint.joint = tfdude::revolute_joint({{}, *tfdude::Covariance::from_stddev({1, 0, 0, 0, 0, 0})},
                                       Eigen::Vector3d::UnitX());
  CHECK(tfdude::value_at(joint, 0.3, 0.25).covariance.of_specified().matrix()(3, 3) == 0.25);
  joint.coupled = true;
  CHECK(tfdude::value_at(joint, 0.3, 0.25).covariance.of_specified().matrix()(3, 3) == 0);
  CHECK(tfdude::value_at(joint, 0.3, 0.25).covariance.of_specified().matrix()(0, 0) == 1);
}
