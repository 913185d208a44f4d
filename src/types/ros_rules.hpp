#pragma once

#include <cmath>
#include <string_view>

#include "tfdude/base/result.hpp"
#include "tfdude/math/pose.hpp"

// What names and numbers of ROS are here, in recordings and in the bridge. Inline, since the bridge
// is a program that uses the library as everybody does.
namespace tfdude::ros {

/// ROS 1 had a leading slash, and some nodes still do.
[[nodiscard]] inline std::string_view without_slashes(std::string_view name) {
  const std::size_t begin = name.find_first_not_of('/');
  return begin == std::string_view::npos ? std::string_view() : name.substr(begin);
}

/// Quaternions are normalized if their squared norm is within 0.01 of one, as in tf2.
/// @return kInvalidInput naming the field.
[[nodiscard]] inline Result<Pose> pose_of(const Eigen::Quaterniond& rotation,
                                          const Eigen::Vector3d& translation) {
  constexpr double kTolerance = 1e-2;
  // Also rejects NaN.
  if (!(std::abs(rotation.squaredNorm() - 1) < kTolerance)) {
    return fail(Errc::kInvalidInput, "rotation: the quaternion is not of unit length");
  }
  return Pose::create(rotation.normalized(), translation);
}

}  // namespace tfdude::ros
