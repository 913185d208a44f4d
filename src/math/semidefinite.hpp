#pragma once

#include "tfdude/math/covariance.hpp"

namespace tfdude {

/// Fast test that accepts most matrices: true if an LDLᵀ factorization succeeds with clear pivots.
/// Each pivot is judged by its own variance, as if the diagonal were scaled to one. Rows of zeros
/// are left out. False for NaN, and for variances above kMaxVariance.
[[nodiscard]] bool is_clearly_semidefinite(const Covariance::Upper& upper);

/// As is_clearly_semidefinite(), for a difference of covariances: clear are pivots that exceed the
/// rounding of the variances that it was computed from.
[[nodiscard]] bool is_clear_difference(const Covariance& difference, const Twist& variances);

/// Whether a symmetric matrix has no eigenvalue below zero, up to rounding.
[[nodiscard]] bool is_semidefinite(const Covariance& symmetric);

/// The matrix, symmetric to the last bit, with negative eigenvalues raised to zero. Each axis is
/// judged in units of its own variance, so that metres and radians of any size are treated alike.
/// An axis whose variance is not positive becomes zero.
[[nodiscard]] Matrix6d nearest_semidefinite(const Matrix6d& symmetric);

/// A⁺ for symmetric positive semi-definite A, in the same units (Factor in square_root.hpp).
/// @param rank  output: the rank of A; may be null
[[nodiscard]] Matrix6d pseudo_inverse(const Matrix6d& semidefinite, int* rank = nullptr);

}  // namespace tfdude
