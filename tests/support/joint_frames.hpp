#pragma once

#include <cmath>
#include <string>
#include <utility>

#include "partition/state_store.hpp"
#include "support/forest_support.hpp"

// Frames that joints move.
namespace tfdude::testing {

/// A frame and the joint that moves it.
[[nodiscard]] inline FrameSpec moved_by(const std::string& frame, const std::string& parent,
                                        JointSpec joint) {
  const Transform X_PC = value_at(joint, joint.position, joint.variance);
  return {frame, parent, X_PC, {}, {}, std::move(joint)};
}

/// A joint about the z axis, a metre along x, with limits of -1 and 2 rad; at rest its standard
/// deviation is half a radian.
[[nodiscard]] inline JointSpec revolute_named(const std::string& name) {
  JointSpec spec;
  spec.name = name;
  spec.type = JointType::kRevolute;
  spec.joint = revolute_joint(along_x(1), {0, 0, 1});
  spec.limits = JointLimits{-1, 2};
  spec.variance = 0.25;
  return spec;
}

/// The same joint, which follows another one.
[[nodiscard]] inline JointSpec following(const std::string& name, const std::string& leader,
                                         double multiplier, double offset) {
  JointSpec spec = revolute_named(name);
  spec.mimic = Mimic{leader, multiplier, offset};
  spec.coupled = true;
  return spec;
}

/// The rotation about z [rad]; NaN if there is no value.
template <class Answer>
[[nodiscard]] double yaw(const Result<Answer>& X) {
  if (!X) return std::nan("");
  return 2 * std::atan2(X->pose.rotation().z(), X->pose.rotation().w());
}

}  // namespace tfdude::testing
