#pragma once

#include "tfdude/math/pose.hpp"

namespace tfdude {

/// Whether a symmetric matrix has no eigenvalue below zero but for rounding.
[[nodiscard]] bool is_semidefinite(const Matrix6d& symmetric);

/// The matrix, symmetric to the last bit, with negative eigenvalues lifted to zero. Each axis is judged in units of its own
/// variance, so that metres and radians of any size are treated alike; one whose variance is not positive is zero.
[[nodiscard]] Matrix6d nearest_semidefinite(const Matrix6d& symmetric);

/// A⁺ for symmetric positive semi-definite A, in the same units: eigenvalues below 1e-12 of the largest count as zero.
/// @param rank  is set to how many do not; may be null
[[nodiscard]] Matrix6d pseudo_inverse(const Matrix6d& semidefinite, int* rank = nullptr);

/// Whether errors of this covariance can make that difference: none [m, rad] is left, but for rounding, in what is known
/// exactly. @param inverse  pseudo_inverse() of the covariance
[[nodiscard]] bool is_possible(const Twist& difference, const Matrix6d& covariance,
                               const Matrix6d& inverse);

}  // namespace tfdude
