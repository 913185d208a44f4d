#pragma once

#include <cstddef>

#include "tfdude/math/transform.hpp"

namespace tfdude::cloud {

/// A transform prepared for many points: p_A = t + r with r = R p_B. Of the covariance in A the
/// blocks [P, C; Cᵀ, Q], for p_A = t + r + ρ + θ × r.
struct Map {
  double R[3][3];
  double t[3];
  double P[6];  ///< xx, xy, xz, yy, yz, zz; with the points' own errors
  double C[3][3];
  double half_Q[3][3];
};

/// Without a covariance.
[[nodiscard]] Map map_of(const Pose& X_AB);
/// @param own  of the points' own errors, in B
[[nodiscard]] Map map_of(const Transform& X_AB, const Eigen::Matrix3d& own);

/// As transform_cloud(), of points one after the other in memory.
/// @param covariances  six numbers a point; null: none
template <class Number>
void transform_points(const Map& map, const Number* p_B, std::size_t count, Number* p_A,
                      Number* covariances);

}  // namespace tfdude::cloud
