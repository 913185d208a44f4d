#pragma once

#include <vector>

#include <Eigen/Core>

#include "tfdude/math/belief.hpp"

namespace tfdude {

/// A joint covariance of blocks of six, blockdiag(own) + F Fᵀ, after a measurement.
struct MeasuredJoint {
  std::vector<Matrix6d> own;
  Eigen::MatrixXd F;     ///< 6n x k
  Eigen::MatrixXd seen;  ///< (6 + 6n) x r: a root B of S = H P Hᵀ + R, and P Hᵀ B⁻ᵀ below it
};

/// P - P Hᵀ S⁻¹ H P by orthogonal transformations of columns, without a difference: the array form
/// of the square-root filter (Kaminski, Bryson & Schmidt 1971). The own part of one block that was
/// measured stays an own part; those of the others become columns, which are six for each. So a
/// block adds columns only when it is measured for the first time since its own part has grown.
/// O(n · columns).
/// @param own_roots  6 x (0 to 6) for each block
/// @param F  columns of all blocks, 6n x k
/// @param H  how the measurement depends on each block; zero for most
/// @param R  a root of the measurement's covariance
[[nodiscard]] MeasuredJoint measured_joint(const std::vector<Loading>& own_roots, Eigen::MatrixXd F,
                                           const std::vector<Matrix6d>& H, const Loading& R);

}  // namespace tfdude
