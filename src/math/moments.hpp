#pragma once

#include "tfdude/math/pose.hpp"

// Moments of brackets [ξ1, ξ2] of two perturbations with zero mean, jointly Gaussian if correlated.
// J_ij stands for E[ξi ξjᵀ].
namespace tfdude {

/// E[ad(ξi) ad(ξj)].
[[nodiscard]] Matrix6d product_of_adjoints(const Matrix6d& J_ij);

/// E[[ξ1, ξ2]]; zero if J_12 is symmetric.
[[nodiscard]] Twist mean_bracket(const Matrix6d& J_12);

/// E[[a, u] [b, v]ᵀ] for (a, b) independent of (u, v), with E[a bᵀ] = N and E[u vᵀ] = M.
[[nodiscard]] Matrix6d bracket_moment(const Matrix6d& N, const Matrix6d& M);

/// E[[ξ1, ξ2] [ξ1, ξ2]ᵀ], by Isserlis' theorem: the part of the mean, and the two other pairings of
/// the four.
[[nodiscard]] Matrix6d bracket_second_moment(const Matrix6d& J_11, const Matrix6d& J_22,
                                             const Matrix6d& J_12);

}  // namespace tfdude
