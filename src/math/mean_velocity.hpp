#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>

#include "tfdude/math/observation.hpp"

namespace tfdude {

/// An edge of a path at both ends of an interval.
struct EdgeAtEnds {
  Belief before;  ///< X_PC at the beginning
  Belief after;   ///< X_PC at the end
  ObservedEdge::Way way = ObservedEdge::Way::kDown;
  bool fixed = false;   ///< static: both are the same value, with the same error
  bool drifts = false;  ///< as EdgeTiming::drifts
};

/// The mean velocity of frame B in frame A, in the axes of A, at the origin of B.
struct MeanVelocity {
  Eigen::Vector3d linear;   ///< [m/s]
  Eigen::Vector3d angular;  ///< [rad/s]
  Covariance covariance;    ///< of (linear, angular), as far as it is specified
  bool bound = false;       ///< it is an upper bound for any correlation
  std::vector<std::string> sources;
};

/// The mean velocity of the last frame of a path in the first one.
///
/// With X0, X1 = X_AB at both ends and φ = Log(R1 R0ᵀ), it is ((p1 - p0)/Δt, φ/Δt). To first order
/// in the errors (ρ, θ) of X0 and X1 its error is ((R1 ρ1 - R0 ρ0)/Δt, Jr⁻¹(φ) R0 (θ1 - θ0)/Δt).
/// Those are sums over the edges, G1 e1 - G0 e0 with an edge's errors e0, e1. If the edge is fixed,
/// e1 = e0; if it drifts, e1 follows from e0 (drift_between()). Otherwise their correlation is not
/// known: an offset is common to both, noise is not. So its share is bound(G0 Σ0 G0ᵀ, G1 Σ1 G1ᵀ).
/// Sources are treated likewise, after the loadings of all edges have been added up; those of
/// different samples of an edge may be related in any way (instant_sources.hpp). Parts that
/// observations subtract are left out, which makes the covariance larger.
/// @param seconds  Δt, positive
[[nodiscard]] MeanVelocity mean_velocity(std::vector<EdgeAtEnds> path, double seconds);

}  // namespace tfdude
