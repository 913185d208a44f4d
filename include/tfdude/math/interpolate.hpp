#pragma once

#include "tfdude/base/export.hpp"
#include "tfdude/math/transform.hpp"

namespace tfdude {

/// X_AB between two samples of it, on the geodesic X0 · Exp(s · Log(X0⁻¹ · X1)): motion with a constant twist.
///
/// To first order the error is e = (1-s) B0 e0 + s B1 e1, with B0 = Jl((1-s)ξ) Jl⁻¹(ξ), B1 = Jr(sξ) Jr⁻¹(ξ) and
/// ξ = Log(X0⁻¹ · X1) (Jr, Jl: Solà et al., arXiv:1812.01537, Eqs. 69 to 76 and 179; Jl(x) = Jr(-x)). How e0 and e1
/// are correlated is not known: an encoder's offset is the same in both, its noise is not. So the covariance given is
/// (1-s) B0 Σ0 B0ᵀ + s B1 Σ1 B1ᵀ, which is that of e where both are fully correlated and alike, and no less
/// than it for any correlation, since y ↦ y yᵀ is convex.
/// @param s  where: 0 gives X0, 1 gives X1; in [0, 1]
/// Where the two are less than 0.1 rad apart and have the same covariance, that is given as it is, as long as
/// what it lacks is below a millionth: s (1-s)/4 ad(ξ) Σ ad(ξ)ᵀ.
/// @note Of two rotations that are a half turn apart the way between them is one of two.
[[nodiscard]] TFDUDE_EXPORT Transform interpolate(const Transform& X0, const Transform& X1,
                                                  double s);

/// The same into a place of the caller's, which must be another than X0 and X1; and without the covariance.
TFDUDE_EXPORT void interpolate(const Transform& X0, const Transform& X1, double s, Transform& X);
TFDUDE_EXPORT void interpolate(const Pose& X0, const Pose& X1, double s, Pose& X);

/// X_AB beyond the second of two samples, with their twist.
///
/// To first order e = B1 s e1 - (s-1) B0 e0, of which the weights add up to one, but not as a mean: no correlation
/// gives more than s (2s-1) B1 Σ1 B1ᵀ + (s-1) (2s-1) B0 Σ0 B0ᵀ, which is given (e eᵀ ≤ (1 + 1/c) x xᵀ + (1 + c) y yᵀ
/// with c = s / (s-1)).
/// @param s  1 gives X1, 2 as far beyond it as it is from X0; no less than 1
[[nodiscard]] TFDUDE_EXPORT Transform extrapolate(const Transform& X0, const Transform& X1,
                                                  double s);

/// The same without the covariance.
[[nodiscard]] TFDUDE_EXPORT Pose extrapolate(const Pose& X0, const Pose& X1, double s);

}  // namespace tfdude
