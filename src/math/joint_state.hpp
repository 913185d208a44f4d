#pragma once

#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>

#include "tfdude/math/joint.hpp"

namespace tfdude {

/// The position of a joint [rad or m], and its variance. If that is unspecified it is not a number,
/// as is then what is computed of it.
struct JointPosition {
  JointPosition() = default;
  JointPosition(double q, std::optional<double> of_q)
      : position(q), variance(of_q.value_or(std::numeric_limits<double>::quiet_NaN())) {}

  [[nodiscard]] std::optional<double> stated() const {
    return std::isnan(variance) ? std::nullopt : std::optional<double>(variance);
  }

  double position = 0;
  double variance = 0;
};

/// Where a joint starts that goes from one position to another the shorter way: `from`, or whole
/// periods beside it.
/// @param period  of positions that may be the same; 0: all differ
[[nodiscard]] inline double start_of(double from, double to, double period) {
  const double way = to - from;
  return period > 0 && std::abs(way) > 0.5 * period ? to - std::remainder(way, period) : from;
}

/// Between two positions, at s in [0, 1]. The correlation of their errors is unknown; as for
/// interpolate() of transforms, the variance is that of errors which are fully correlated and
/// alike, and an upper bound for any other correlation.
[[nodiscard]] inline JointPosition interpolate(const JointPosition& q0, const JointPosition& q1,
                                               double s, double period) {
  const double start = start_of(q0.position, q1.position, period);
  return {start + s * (q1.position - start), (1.0 - s) * q0.variance + s * q1.variance};
}

/// Beyond the second of two positions, at s of at least 1. The variance is the bound of
/// extrapolate() of transforms.
[[nodiscard]] inline JointPosition extrapolate(const JointPosition& q0, const JointPosition& q1,
                                               double s, double period) {
  const double beyond = s - 1.0;
  const double start = start_of(q0.position, q1.position, period);
  return {start + s * (q1.position - start),
          (s + beyond) * (s * q1.variance + beyond * q0.variance)};
}

/// The value of an edge that a joint moves: joint_transform() of both.
struct JointState {
  const Joint* joint = nullptr;
  JointPosition at{};
  double period = 0;  ///< see start_of()
};

/// A joint prepared for many positions: what does not depend on these is computed once. Most joints
/// turn in place or slide, and their origins are exact, so a value takes a third of the time of
/// joint_transform().
class PreparedJoint {
 public:
  PreparedJoint() = default;
  explicit PreparedJoint(const Joint& joint, double period = 0);

  [[nodiscard]] const Joint& joint() const { return joint_; }
  [[nodiscard]] double period() const { return period_; }
  [[nodiscard]] Pose pose(double position) const;
  /// As joint_transform().
  void compute(const JointPosition& at, Transform& X) const;

 private:
  enum class Kind { kTurns, kSlides, kScrews };

  Joint joint_;
  double period_ = 0;
  Kind kind_ = Kind::kScrews;
  std::uint8_t exact_origin_ = 0;  // a truth value; copies of damaged memory may have any
  Covariance::Upper unit_{};       // of a variance of one
};

}  // namespace tfdude
