#pragma once

#include <vector>

#include "math/joint_prior.hpp"
#include "math/square_root.hpp"

// The most probable errors of the edges of a path, of which a measurement was taken.
namespace tfdude {

/// h(ξ) = Log(Z⁻¹ X_AB(ξ)) of a path whose edges have the errors ξ, and its derivatives.
struct LinearPath {
  Twist h = Twist::Zero();
  std::vector<Matrix6d> H;  ///< by each edge's ξ; zero for an edge beside the path
  double reach = 0;         ///< how large the coordinates are from which h was computed [m]
  Pose X_AB;                ///< at ξ
};
[[nodiscard]] LinearPath linearize(const std::vector<ObservedEdge>& edges,
                                   const std::vector<Twist>& xi, const Pose& Z_AB);

/// The ξ of all edges that minimize ξᵀ P⁻¹ ξ + hᵀ R⁻¹ h.
struct PathMinimum {
  std::vector<Twist> xi;
  LinearPath linear;  ///< at ξ
  Factor S;           ///< H P Hᵀ + R there
  Twist seen;         ///< H ξ - h, the errors of the edges as the measurement shows them
  bool converged = false;

  /// The cost there: χ² of `S.rank()` dimensions, if all covariances are right.
  [[nodiscard]] double cost() const { return S.distance_squared(seen); }
  /// Whether the errors that P and R allow can explain the measurement.
  [[nodiscard]] bool is_possible() const {
    return S.can_cause(seen, tolerance_of_pose(linear.reach));
  }
};

/// H P Hᵀ + R, without what is only rounding of P: earlier measurements may have left nothing of
/// the path's error in a direction, as exact ones do. What remains there by rounding would tell of
/// edges whose errors are much larger.
/// @param H, R  as of a path and its measurement; R is a root
[[nodiscard]] Factor measured(const JointPrior& prior, const LinearPath& linear, const Loading& R);

/// Gauss-Newton on the manifold (an iterated Kalman update), with shorter steps where a whole one
/// would increase the cost. If it does not converge, all is that of ξ = 0.
/// @param R  a root of the measurement's covariance
[[nodiscard]] PathMinimum minimize(const std::vector<ObservedEdge>& edges, const JointPrior& prior,
                                   const Pose& Z_AB, const Loading& R);

}  // namespace tfdude
