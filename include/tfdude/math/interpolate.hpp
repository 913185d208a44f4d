#pragma once

#include "tfdude/base/export.hpp"
#include "tfdude/math/transform.hpp"

namespace tfdude {

/// X_AB between two samples, on the geodesic X0 · Exp(s · Log(X0⁻¹ · X1)): motion with a constant
/// twist.
///
/// To first order the error is e = (1-s) B0 e0 + s B1 e1, with B0 = Jl((1-s)ξ) Jl⁻¹(ξ), B1 = Jr(sξ)
/// Jr⁻¹(ξ) and ξ = Log(X0⁻¹ · X1) (Jr, Jl: Solà et al., arXiv:1812.01537, Eqs. 69 to 76 and 179;
/// Jl(x) = Jr(-x)). The correlation of e0 and e1 is unknown: an encoder's offset is the same in
/// both, its noise is not. So the covariance returned is (1-s) B0 Σ0 B0ᵀ + s B1 Σ1 B1ᵀ. This is the
/// covariance of e if both are fully correlated and alike, and an upper bound for any other
/// correlation, since y ↦ y yᵀ is convex.
///
/// If the samples are less than 0.1 rad apart and have the same covariance, that covariance is
/// returned unchanged, as long as the omitted term is below a millionth: s (1-s)/4 ad(ξ) Σ ad(ξ)ᵀ.
///
/// If one of both is not complete, neither is the result, and its numbers are those of that one.
/// @param s  position in [0, 1]: 0 gives X0, 1 gives X1
/// @note If the two rotations are half a turn apart, the path between them is one of two.
[[nodiscard]] TFDUDE_EXPORT Transform interpolate(const Transform& X0, const Transform& X1,
                                                  double s);

/// As above, into an object of the caller, which must not be X0 or X1; and without the covariance.
TFDUDE_EXPORT void interpolate(const Transform& X0, const Transform& X1, double s, Transform& X);
TFDUDE_EXPORT void interpolate(const Pose& X0, const Pose& X1, double s, Pose& X);

/// X_AB beyond the second of two samples, with their twist.
///
/// To first order e = B1 s e1 - (s-1) B0 e0. The weights add up to one, but one is negative, so
/// this is not a mean. The covariance returned is an upper bound for any correlation: s (2s-1) B1
/// Σ1 B1ᵀ + (s-1) (2s-1) B0 Σ0 B0ᵀ (e eᵀ ≤ (1 + 1/c) x xᵀ + (1 + c) y yᵀ with c = s / (s-1)).
/// @param s  at least 1: 1 gives X1; 2 gives the pose as far beyond X1 as X1 is from X0
[[nodiscard]] TFDUDE_EXPORT Transform extrapolate(const Transform& X0, const Transform& X1,
                                                  double s);

/// As above, without the covariance.
[[nodiscard]] TFDUDE_EXPORT Pose extrapolate(const Pose& X0, const Pose& X1, double s);

}  // namespace tfdude
