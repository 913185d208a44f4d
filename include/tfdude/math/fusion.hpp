#pragma once

#include <vector>

#include "tfdude/base/export.hpp"
#include "tfdude/math/transform.hpp"

// Combines several estimates of one pose X_AB.
namespace tfdude {

/// The result of a fusion.
struct Fused {
  Transform X;
  int iterations = 0;
};

/// Fuses estimates with independent errors: the X that minimizes Σ eₖᵀ Σₖ⁻¹ eₖ with eₖ = Log(Xₖ⁻¹
/// X), by Gauss-Newton on the manifold, and its covariance. Barfoot & Furgale 2014, section IV (for
/// the left perturbation), with the full Jacobian. A part that an estimate knows exactly (zero
/// variance) is taken from it. The covariance is that of the linearised problem: an eighth too
/// small for errors of half a radian. O(estimates · iterations).
/// @param estimates  at least one
/// @return kInvalidInput: no estimates; one of unspecified covariance; two of them contradict each
///   other in a part that both know exactly; or they differ so much, towards half a turn, that the
///   iteration does not converge.
[[nodiscard]] TFDUDE_EXPORT Result<Fused> fuse(const std::vector<Transform>& estimates);

/// Fuses two estimates whose errors may be correlated in any way, by covariance intersection: (ω
/// A⁻¹ + (1-ω) B⁻¹)⁻¹, which is no less than the error's covariance for any ω (Julier & Uhlmann, "A
/// non-divergent estimation algorithm in the presence of unknown correlations", 1997). ω minimizes
/// the sum of the traces of translation and rotation, each in units of A + B.
/// @return as fuse().
[[nodiscard]] TFDUDE_EXPORT Result<Fused> intersect(const Transform& A, const Transform& B);

/// Quantile of χ²: the squared Mahalanobis distance that a fraction `probability` of samples of
/// that many dimensions do not exceed.
/// @param probability  within [0, 1)
/// @param dimensions  at least 1
[[nodiscard]] TFDUDE_EXPORT double chi_squared_quantile(double probability, int dimensions);

}  // namespace tfdude
