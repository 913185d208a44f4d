#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "tfdude/base/export.hpp"
#include "tfdude/base/result.hpp"
#include "tfdude/math/joint.hpp"

namespace tfdude {

/// What kind of joint moves a frame by one number. A fixed joint is an edge without a joint.
enum class JointType : std::uint8_t { kRevolute = 1, kContinuous = 2, kPrismatic = 3 };

/// revolute, continuous or prismatic.
[[nodiscard]] TFDUDE_EXPORT const char* to_string(JointType type);

struct JointLimits {
  double lower = 0;  ///< [rad or m]
  double upper = 0;

  [[nodiscard]] bool contain(double position) const {
    return lower <= position && position <= upper;
  }
};

/// That a joint follows another: its position is multiplier · (the other's) + offset.
struct Mimic {
  std::string joint;
  double multiplier = 1;
  double offset = 0;

  /// Where the joint is that follows, and the variance of that.
  [[nodiscard]] double position(double of_other) const { return multiplier * of_other + offset; }
  [[nodiscard]] double variance(double of_other) const {
    return multiplier * multiplier * of_other;
  }
};

/// A joint that moves a frame: how, and what is believed before its first sample.
struct JointSpec {
  std::string name;
  JointType type = JointType::kRevolute;
  Joint joint;
  std::optional<JointLimits> limits;
  std::optional<Mimic> mimic;
  /// It follows another joint, or others follow it: their errors are one error.
  bool coupled = false;
  bool strict = false;  ///< positions outside the limits are refused
  double position = 0;  ///< before the first sample [rad or m]
  double variance = 0;  ///< of that [rad² or m²]
};

/// A joint, and where it is.
struct JointInfo {
  std::string name;
  std::string frame;  ///< the one that it moves
  JointType type = JointType::kRevolute;
  std::optional<JointLimits> limits;
  std::optional<Mimic> mimic;
  double position = 0;  ///< [rad or m]
  double variance = 0;  ///< [rad² or m²]
  bool measured =
      false;  ///< by a sample, of this process or the one before; else it is an assumption
  std::uint64_t outside = 0;  ///< positions outside the limits that were applied,
  std::uint64_t refused = 0;  ///< or refused
};

/// The joint that says where this one is: itself, or the one that it follows.
[[nodiscard]] inline const std::string& leader_of(const JointSpec& joint) {
  return joint.mimic ? joint.mimic->joint : joint.name;
}

/// Where one joint is.
struct JointValue {
  std::string name;
  double position = 0;  ///< [rad or m]
  double variance = 0;  ///< of that [rad² or m²]
};

/// @return kInvalidInput naming the joint and the field: not a number, too large, a negative variance.
[[nodiscard]] TFDUDE_EXPORT Result<void> check_value(const JointValue& joint);

/// What check_value() takes.
[[nodiscard]] TFDUDE_EXPORT bool is_position(double position);
[[nodiscard]] TFDUDE_EXPORT bool is_variance(double variance);

/// Whether that can be: for descriptions that code has made.
/// @return kInvalidInput naming the joint: a name that is none, or, of one that others follow, longer than 249 bytes;
///   limits upside down; a twist of no unit length; a mimic that is not coupled; what check_value() refuses
[[nodiscard]] TFDUDE_EXPORT Result<void> check_joint(const JointSpec& joint);

/// The edge's value at a joint's position. A coupled joint's error is not in its covariance but a common error.
[[nodiscard]] TFDUDE_EXPORT Transform value_at(const JointSpec& joint, double position,
                                               double variance);

/// The source of the error that a joint shares with those that follow it.
[[nodiscard]] TFDUDE_EXPORT std::string shared_source(const std::string& leader);

/// The position that is taken before the first sample: the one within the limits that is nearest to zero.
[[nodiscard]] TFDUDE_EXPORT double rest_position(const std::optional<JointLimits>& limits);

/// What is known of a position of which nothing is known: the mean square distance of all that are within the limits, each
/// as likely; of a revolute joint without limits, those of one turn. @return 0 for a prismatic one without limits, of which
///   nothing can be said
[[nodiscard]] TFDUDE_EXPORT double unmeasured_variance(JointType type,
                                                       const std::optional<JointLimits>& limits,
                                                       double position);

}  // namespace tfdude
