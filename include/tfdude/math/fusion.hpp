#pragma once

#include <vector>

#include "tfdude/base/export.hpp"
#include "tfdude/math/transform.hpp"

// Several estimates of one pose X_AB as one.
namespace tfdude {

/// What fusion comes to.
struct Fused {
  Transform X;
  int iterations = 0;
};

/// Estimates with independent errors: the X of the least Σ eₖᵀ Σₖ⁻¹ eₖ with eₖ = Log(Xₖ⁻¹ X), by Gauss-Newton on the
/// manifold, and the covariance there. Barfoot & Furgale 2014, section IV (for the left perturbation), with the full
/// Jacobian. What an estimate knows exactly (zero variance) the result has of it.
/// The covariance is that of the linearised problem: an eighth too small for errors of half a radian.
/// O(estimates · iterations).
/// @param estimates  at least one
/// @return kInvalidInput: there are none, two contradict each other in what both know exactly, or the estimates lie so far
///   apart, towards half a turn, that nothing converges.
[[nodiscard]] TFDUDE_EXPORT Result<Fused> fuse(const std::vector<Transform>& estimates);

/// Two estimates whose errors may be correlated in any way: covariance intersection, (ω A⁻¹ + (1-ω) B⁻¹)⁻¹, which is no
/// less than the error's covariance for all ω (Julier & Uhlmann, "A non-divergent estimation algorithm in the presence of
/// unknown correlations", 1997); with the ω of the least sum of traces, of translation and of rotation, each in units of
/// A + B. @return as fuse().
[[nodiscard]] TFDUDE_EXPORT Result<Fused> intersect(const Transform& A, const Transform& B);

/// The distance below which a part `probability` of all squared Mahalanobis distances of so many dimensions lie:
/// quantile of χ². @param probability  within [0, 1); @param dimensions  at least 1
[[nodiscard]] TFDUDE_EXPORT double chi_squared_quantile(double probability, int dimensions);

}  // namespace tfdude
