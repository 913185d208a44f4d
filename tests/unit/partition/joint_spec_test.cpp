#include "tfdude/types/joint_spec.hpp"

#include <string>

#include "support/catch.hpp"

namespace {

using tfdude::JointLimits;
using tfdude::JointSpec;
using tfdude::JointType;

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

TEST_CASE("joints: a coupled joint's own covariance is only that of its origin") {
  JointSpec joint;
  joint.joint = tfdude::revolute_joint({{}, *tfdude::Covariance::from_stddev({1, 0, 0, 0, 0, 0})},
                                       Eigen::Vector3d::UnitX());
  CHECK(tfdude::value_at(joint, 0.3, 0.25).covariance.of_specified().matrix()(3, 3) == 0.25);
  joint.coupled = true;
  CHECK(tfdude::value_at(joint, 0.3, 0.25).covariance.of_specified().matrix()(3, 3) == 0);
  CHECK(tfdude::value_at(joint, 0.3, 0.25).covariance.of_specified().matrix()(0, 0) == 1);
}
