#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "tfdude/base/export.hpp"
#include "tfdude/base/result.hpp"
#include "tfdude/math/joint.hpp"

namespace tfdude {

/// The type of a joint that moves a frame by one number. A fixed joint is an edge without a joint.
enum class JointType : std::uint8_t { kRevolute = 1, kContinuous = 2, kPrismatic = 3 };

/// "revolute", "continuous" or "prismatic".
[[nodiscard]] TFDUDE_EXPORT const char* to_string(JointType type);

struct JointLimits {
  double lower = 0;  ///< [rad or m]
  double upper = 0;

  [[nodiscard]] bool contain(double position) const {
    return lower <= position && position <= upper;
  }
};

/// A joint that follows another: its position is multiplier · (the other's position) + offset.
struct Mimic {
  std::string joint;
  double multiplier = 1;
  double offset = 0;
  /// The other is continuous, so this one takes the shorter way, too; see period_of().
  bool of_continuous = false;

  /// Position and variance of the mimic joint.
  [[nodiscard]] double position(double of_other) const { return multiplier * of_other + offset; }
  [[nodiscard]] std::optional<double> variance(std::optional<double> of_other) const {
    if (of_other) *of_other *= multiplier * multiplier;
    return of_other;
  }
};

/// A joint that moves a frame: its kinematics, and its assumed state before the first sample.
struct JointSpec {
  std::string name;
  JointType type = JointType::kRevolute;
  Joint joint;
  std::optional<JointLimits> limits;
  std::optional<Mimic> mimic;
  /// The joint follows another one, or others follow it: they share one error.
  bool coupled = false;
  bool strict = false;               ///< positions outside the limits are rejected
  double position = 0;               ///< before the first sample [rad or m]
  std::optional<double> variance{};  ///< of the position [rad² or m²]; absent: unspecified
  /// Of samples that come without one [rad² or m²]; absent: unspecified.
  std::optional<double> sample_variance{};
};

/// A joint and its state.
struct JointInfo {
  std::string name;
  std::string frame;  ///< the frame it moves
  JointType type = JointType::kRevolute;
  std::optional<JointLimits> limits;
  std::optional<Mimic> mimic;
  double position = 0;               ///< [rad or m]
  std::optional<double> variance{};  ///< [rad² or m²]; absent: unspecified
  bool measured = false;  ///< true: by a sample, of this process or the one before; false: assumed
  std::uint64_t outside = 0;  ///< applied positions outside the limits
  std::uint64_t refused = 0;  ///< rejected positions outside the limits
};

/// The joint whose position determines this one: itself, or the one it follows.
[[nodiscard]] inline const std::string& leader_of(const JointSpec& joint) {
  return joint.mimic ? joint.mimic->joint : joint.name;
}

/// How far apart two positions are that may be the same pose, so that the joint goes the shorter
/// way between samples [rad or m]: a turn for a continuous joint, whose drivers report angles of
/// one turn, and for a joint that mimics one as much as that turn moves it; 0 for others, whose
/// positions all differ.
[[nodiscard]] TFDUDE_EXPORT double period_of(const JointSpec& joint);

/// A joint's position and its variance.
struct JointValue {
  std::string name;
  double position = 0;               ///< [rad or m]
  std::optional<double> variance{};  ///< of the position [rad² or m²]; absent: unspecified
};

/// @return kInvalidInput naming the joint and the field: not a number, too large, a negative
///   variance.
[[nodiscard]] TFDUDE_EXPORT Result<void> check_value(const JointValue& joint);

/// The ranges that check_value() accepts.
[[nodiscard]] TFDUDE_EXPORT bool is_position(double position);
[[nodiscard]] TFDUDE_EXPORT bool is_variance(double variance);

/// Checks a joint description made by code.
/// @return kInvalidInput naming the joint: an invalid name; a name longer than 249 bytes if others
///   follow the joint; a lower limit above the upper; a twist whose axis is not of unit length; a
///   mimic that is not coupled; what check_value() rejects.
[[nodiscard]] TFDUDE_EXPORT Result<void> check_joint(const JointSpec& joint);

/// The part of a joint's variance that the covariance of its edge has: all of it, but nothing for a
/// coupled joint.
[[nodiscard]] TFDUDE_EXPORT std::optional<double> own_variance(const JointSpec& joint,
                                                               std::optional<double> variance);

/// The edge's value at a joint position. The error of a coupled joint is not part of the
/// covariance, but a common error.
[[nodiscard]] TFDUDE_EXPORT Transform value_at(const JointSpec& joint, double position,
                                               std::optional<double> variance);

/// The source of the error that a joint shares with those that follow it.
[[nodiscard]] TFDUDE_EXPORT std::string shared_source(const std::string& leader);

/// Whether a source may be that of joints: its name begins as those of shared_source().
[[nodiscard]] TFDUDE_EXPORT bool is_of_joints(std::string_view source);

/// Checks the name of a source that a user gives to an edge.
/// @return kInvalidInput: as check_new_id(), or the name is_of_joints()
[[nodiscard]] TFDUDE_EXPORT Result<void> check_new_source(std::string_view source);

/// The position assumed before the first sample: the one nearest to zero within the limits.
[[nodiscard]] TFDUDE_EXPORT double rest_position(const std::optional<JointLimits>& limits);

}  // namespace tfdude
