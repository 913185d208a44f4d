#include "tfdude/types/joint_spec.hpp"

#include <algorithm>
#include <cmath>

#include "tfdude/base/id.hpp"

#include "math/finite.hpp"

namespace tfdude {
namespace {

constexpr double kPi = 3.14159265358979323846;

constexpr std::string_view kOfJoints = "joint ";

}  // namespace

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

bool is_position(double position) {
  return std::isfinite(position) && std::abs(position) <= kMaxTranslation;
}

bool is_variance(double variance) { return variance >= 0 && variance <= kMaxVariance; }

Result<void> check_value(const JointValue& joint) {
  const char* what = nullptr;
  if (!is_position(joint.position)) {
    what = ": position is not a number, or beyond 1e9";
  } else if (joint.variance && !is_variance(*joint.variance)) {
    what = ": variance is not a number within 0 to 1e18";
  }
  if (what == nullptr) return {};
  return fail(Errc::kInvalidInput, "joint " + quote(joint.name) + what);
}

Result<void> check_joint(const JointSpec& joint) {
  const std::string who = "joint " + quote(joint.name);
  if (auto ok = check_new_id(joint.name, "joint"); !ok) return ok;
  const auto bad = [&](const char* what) { return fail(Errc::kInvalidInput, who + ": " + what); };
  if (joint.mimic && !joint.coupled) return bad("follows another, so it is coupled");
  if (joint.coupled && !check_id(shared_source(leader_of(joint)), "source")) {
    return bad("it is coupled, and its name, or that of the joint that it mimics, is too long");
  }
  const bool unit = std::abs(joint.joint.S.norm() - 1.0) < 1e-9;
  if (!unit) return bad("its twist is not of unit length");
  if (joint.limits && !(joint.limits->lower <= joint.limits->upper)) {
    return bad("its lower limit is above its upper limit");
  }
  if (!is_finite(joint.joint.X_PJ)) return bad("its origin is not finite");
  return check_value({joint.name, joint.position, joint.variance}).and_then([&] {
    return check_value({joint.name, joint.position, joint.sample_variance});
  });
}

std::string shared_source(const std::string& leader) { return std::string(kOfJoints) + leader; }

bool is_of_joints(std::string_view source) { return source.rfind(kOfJoints, 0) == 0; }

Result<void> check_new_source(std::string_view source) {
  if (auto ok = check_new_id(source, "source"); !ok) return ok;
  if (!is_of_joints(source)) return {};
  return fail(Errc::kInvalidInput,
              "source " + quote(source) + ": names with this prefix are reserved for joints");
}

std::optional<double> own_variance(const JointSpec& joint, std::optional<double> variance) {
  return variance && joint.coupled ? 0.0 : variance;
}

Transform value_at(const JointSpec& joint, double position, std::optional<double> variance) {
  return joint_transform(joint.joint, position, own_variance(joint, variance));
}

double period_of(const JointSpec& joint) {
  if (joint.mimic) {
    return joint.mimic->of_continuous ? 2 * kPi * std::abs(joint.mimic->multiplier) : 0;
  }
  // A screw is elsewhere after a turn.
  const bool turns = joint.joint.S.head<3>().isZero(0);
  return joint.type == JointType::kContinuous && turns ? 2 * kPi : 0;
}

double rest_position(const std::optional<JointLimits>& limits) {
  return limits ? std::clamp(0.0, limits->lower, limits->upper) : 0.0;
}

}  // namespace tfdude
