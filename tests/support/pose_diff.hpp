#pragma once

#include <algorithm>
#include <cmath>
#include <iomanip>
#include <sstream>
#include <string>

#include <Eigen/Core>

#include "tfdude/math/transform.hpp"

namespace tfdude::testing {

/// "(x, y, z) m, [x, y, z, w]", with digits enough to see a difference of 1e-15.
[[nodiscard]] inline std::string describe(const Pose& X) {
  const Eigen::Vector3d t = X.translation();
  const Eigen::Quaterniond q = X.rotation();
  std::ostringstream out;
  out << std::setprecision(16) << "(" << t.x() << ", " << t.y() << ", " << t.z() << ") m, ["
      << q.x() << ", " << q.y() << ", " << q.z() << ", " << q.w() << "]";
  return out.str();
}

[[nodiscard]] inline std::string describe(const Covariance& sigma) {
  const Eigen::IOFormat format(10, 0, "  ", "\n", "  ");
  std::ostringstream out;
  out << sigma.matrix().format(format);
  return out.str();
}

/// By how much two ways to compute the same may differ: not at all, unless the compiler fuses
/// multiplications and additions, as on AArch64.
#ifdef __FP_FAST_FMA
inline constexpr double kRounding = 1e-15;
#else
inline constexpr double kRounding = 0.0;
#endif

/// Angle [rad] between two rotations; a quaternion and its negative are the same rotation.
[[nodiscard]] inline double angle_between(const Eigen::Quaterniond& a,
                                          const Eigen::Quaterniond& b) {
  // Fused multiplications and additions would not cancel.
  if (a.coeffs() == b.coeffs()) return 0.0;
  const Eigen::Quaterniond d = a.conjugate() * b;
  return 2.0 * std::atan2(d.vec().norm(), std::abs(d.w()));
}

/// Empty if each translation component [m] and the angle between the rotations [rad] differ by at
/// most `tol`; else both poses for people. A NaN is always a difference.
[[nodiscard]] inline std::string pose_diff(const Pose& actual, const Pose& expected, double tol) {
  const double metres = (actual.translation() - expected.translation()).lpNorm<Eigen::Infinity>();
  const double radians = angle_between(actual.rotation(), expected.rotation());
  if (metres <= tol && radians <= tol) return "";
  std::ostringstream out;
  out << "poses differ by " << metres << " m and " << radians << " rad, tolerance " << tol
      << "\nactual   " << describe(actual) << "\nexpected " << describe(expected);
  return out.str();
}

/// Empty if no element differs by more than `tol` relative to the largest variances of its rows:
/// metres are judged by metres and radians by radians, whatever the axes. A NaN is always a
/// difference.
[[nodiscard]] inline std::string covariance_diff(const StatedCovariance& actual,
                                                 const StatedCovariance& expected, double tol) {
  if (actual.complete() != expected.complete()) return "only one of the covariances is complete";
  const Matrix6d a = actual.of_specified().matrix();
  const Matrix6d e = expected.of_specified().matrix();
  const double metres = std::sqrt(e.diagonal().head<3>().maxCoeff());
  const double radians = std::sqrt(e.diagonal().tail<3>().maxCoeff());
  for (int i = 0; i < 6; ++i) {
    for (int j = i; j < 6; ++j) {
      const double scale = (i < 3 ? metres : radians) * (j < 3 ? metres : radians);
      const double difference = std::abs(a(i, j) - e(i, j));
      if (difference <= tol * scale) continue;
      std::ostringstream out;
      out << "covariances differ in [" << i << "][" << j << "] by " << difference << ", tolerance "
          << tol << " x " << scale << "\nactual\n"
          << describe(actual.of_specified()) << "\nexpected\n"
          << describe(expected.of_specified());
      return out.str();
    }
  }
  return "";
}

/// pose_diff and covariance_diff in one, each with its own tolerance.
[[nodiscard]] inline std::string transform_diff(const Transform& actual, const Transform& expected,
                                                double pose_tol, double covariance_tol) {
  const std::string pose = pose_diff(actual.pose, expected.pose, pose_tol);
  const std::string sigma = covariance_diff(actual.covariance, expected.covariance, covariance_tol);
  return pose.empty() || sigma.empty() ? pose + sigma : pose + "\n" + sigma;
}

[[nodiscard]] inline std::string transform_diff(const Transform& actual, const Transform& expected,
                                                double tol) {
  return transform_diff(actual, expected, tol, tol);
}

}  // namespace tfdude::testing
