#pragma once

#include <optional>
#include <string>
#include <vector>

#include "tfdude/client/client.hpp"
#include "tfdude/math/earth.hpp"

#include "angles.hpp"

// Answers for people, as text.
namespace tfdude::cli {

/// "a, b, c"
[[nodiscard]] std::string joined(const std::vector<std::string>& words);

/// How a transform or velocity is printed.
struct Shown {
  AngleUnit angles = kRadian;
  bool covariance = false;  ///< the full one
  bool matrix = false;      ///< the pose as a homogeneous matrix
};

/// Whose axes the standard deviations of a pose of B in A have: see stddev_in_parent().
inline constexpr const char* kAxesOfTranslation = "along the axes of A";
inline constexpr const char* kAxesOfRotation = "about the axes of B";

/// @param unspecified  the edges whose covariance is unspecified
[[nodiscard]] std::string describe(const Transform& X_AB, const Shown& shown,
                                   const std::vector<std::string>& unspecified = {});
/// Where a frame is on the Earth: latitude, longitude, altitude, place on a map.
[[nodiscard]] std::string describe(const GeodeticPose& seen, const AngleUnit& angles);
/// What a covariance is based on, in words; empty for second order without correlation.
[[nodiscard]] std::string describe(const Basis& basis);
/// "unspecified for odom, base"
[[nodiscard]] std::string unspecified_text(const std::vector<std::string>& edges);
/// "2 joints have had no sample: pan, lift"; empty if there are none.
[[nodiscard]] std::string assumed_text(const std::vector<std::string>& joints);
/// The same as a line of an answer.
[[nodiscard]] std::string assumed_line(const std::vector<std::string>& joints);

/// A table of the covariance, whose last three rows and columns are of angles.
[[nodiscard]] std::string matrix_table(const Matrix6d& sigma, const AngleUnit& angles);
/// The rows of a matrix.
[[nodiscard]] std::string rows_text(const Eigen::MatrixXd& matrix);

/// "1700000000.123456789": seconds since the epoch, exact.
[[nodiscard]] std::string seconds_of(Time stamp);
/// "0.200000 s ago". Without `now`, the age is not known: the stamp is of another clock.
[[nodiscard]] std::string ago(Time stamp, std::optional<Time> now);
/// The line with the stamp of a transform.
[[nodiscard]] std::string describe_stamp(Time stamp, std::optional<Time> now);
/// The same of a recording, which has no present.
[[nodiscard]] std::string describe_recorded_stamp(Time stamp, std::optional<Time> end);

// A joint's values are in metres, or in the unit of angles.
[[nodiscard]] double in_unit(const JointInfo& joint, double value, const AngleUnit& angles);
[[nodiscard]] const char* unit_of(const JointInfo& joint, const AngleUnit& angles);
/// A position in a column of a table.
[[nodiscard]] std::string position_cell(const JointInfo& joint, double value,
                                        const AngleUnit& angles, std::size_t columns);
/// "-0.1..0.1", or "none".
[[nodiscard]] std::string limits_of(const JointInfo& joint, const AngleUnit& angles);

}  // namespace tfdude::cli
