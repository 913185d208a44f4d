#pragma once

#include <optional>

#include <Eigen/Core>

#include "tfdude/base/export.hpp"
#include "tfdude/math/transform.hpp"

namespace tfdude {

/// How one number q moves a child frame C in its parent P: X_PC(q) = X_PJ · Exp(S q), with the
/// twist S of a joint with one degree of freedom. At q = 0 the child is at the origin J, as in
/// URDF.
struct Joint {
  Transform X_PJ;  ///< the origin, with its own covariance
  /// Per unit of q: (0, axis) rotates [rad], (axis, 0) translates [m]. The same expressed in J and
  /// in C.
  Twist S = Twist::Zero();
};

/// Rotates about a unit axis of J. @param axis  of unit length
[[nodiscard]] TFDUDE_EXPORT Joint revolute_joint(const Transform& X_PJ,
                                                 const Eigen::Vector3d& axis);

/// Translates along a unit axis of J. @param axis  of unit length
[[nodiscard]] TFDUDE_EXPORT Joint prismatic_joint(const Transform& X_PJ,
                                                  const Eigen::Vector3d& axis);

/// X_PC(q). An error of q moves C along S for any q, since Exp(S (q + δ)) = Exp(S q) Exp(S δ). So
/// q's variance gives the covariance S Sᵀ σ² of rank one, without approximation. The origin's
/// covariance, transported to C, is added. If one of both is unspecified, so is that of the edge.
/// @param position  q [rad or m]
/// @param variance  of q [rad² or m²]; absent: unspecified
[[nodiscard]] TFDUDE_EXPORT Transform joint_transform(const Joint& joint, double position,
                                                      std::optional<double> variance);

}  // namespace tfdude
