#pragma once

#include <array>

#include "tfdude/base/result.hpp"
#include "tfdude/math/transform.hpp"

namespace tfdude {

/// A transform as sent and stored: x, y, z, w of the unit quaternion; x, y, z [m]; upper triangle
/// of the covariance, row by row. Does not say whether that is complete.
using Flat = std::array<double, 28>;

[[nodiscard]] Flat to_flat(const Transform& X);

/// As computed_from(), of a pose alone.
[[nodiscard]] Result<Pose> computed_pose(const Eigen::Quaterniond& rotation,
                                         const Eigen::Vector3d& translation);

/// Restores a transform that was valid, or computed from valid ones, when it was flattened. It may
/// have any size and is semi-definite up to its rounding, so the rules for user input do not apply.
/// @return kInvalidInput: not finite, or not a rotation.
[[nodiscard]] Result<Transform> computed_from(const Flat& flat);

}  // namespace tfdude
