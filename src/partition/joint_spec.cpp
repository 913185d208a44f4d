#include "tfdude/partition/joint_spec.hpp"

#include <algorithm>

namespace tfdude {

const char* to_string(JointType type) {
  switch (type) {
    case JointType::kContinuous:
      return "continuous";
    case JointType::kPrismatic:
      return "prismatic";
    default:
      return "revolute";
  }
}

Transform value_at(const JointSpec& joint, double position, double variance) {
  return moved(joint.joint, position, joint.coupled ? 0.0 : variance);
}

double rest_position(const std::optional<JointLimits>& limits) {
  return limits ? std::clamp(0.0, limits->lower, limits->upper) : 0.0;
}

double unmeasured_variance(JointType type, const std::optional<JointLimits>& limits,
                           double position) {
  constexpr double kPi = 3.14159265358979323846;
  if (!limits) return type == JointType::kPrismatic ? 0.0 : kPi * kPi / 3.0;
  const double range = limits->upper - limits->lower;
  const double off = 0.5 * (limits->upper + limits->lower) - position;
  return range * range / 12.0 + off * off;
}

}  // namespace tfdude
