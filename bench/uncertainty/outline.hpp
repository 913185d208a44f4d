#pragma once

#include <array>
#include <vector>

#include <Eigen/Core>

#include "tfdude/math/transform.hpp"

// Outlines of the possible positions x and y of a pose in the plane: the error is only that of
// (x, y, yaw).
namespace bench {

using Outline = std::vector<std::array<double, 2>>;

/// Σ of x, y and yaw.
[[nodiscard]] Eigen::Matrix3d planar(const tfdude::Covariance& covariance);

/// The positions of X̄ · Exp(ξ) for ξ on the ellipse of `sigmas` standard deviations in y and yaw:
/// of second order, where x has no error.
[[nodiscard]] Outline mapped_ellipse(const tfdude::Transform& X, double sigmas);

/// The rim of all positions that X̄ · Exp(ξ) has for ξ within the ellipsoid of `sigmas` standard
/// deviations in x, y and yaw.
[[nodiscard]] Outline mapped_ellipsoid(const tfdude::Transform& X, double sigmas);

/// The ellipse of a Gaussian of x and y.
[[nodiscard]] Outline ellipse(const Eigen::Vector2d& mean, const Eigen::Matrix2d& covariance,
                              double sigmas);

}  // namespace bench
