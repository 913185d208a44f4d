#pragma once

#include <Eigen/Core>

#include "tfdude/base/export.hpp"
#include "tfdude/math/transform.hpp"

namespace tfdude {

/// How one number q moves a child frame C in its parent P: X_PC(q) = X_PJ · Exp(S q), with the twist S of a motor
/// of one degree of freedom. At q = 0 the child stands at the origin J, as in URDF.
struct Joint {
  Transform X_PJ;  ///< the origin, with its own covariance
  Twist S = Twist::
      Zero();  ///< per unit of q: (0, axis) turns [rad], (axis, 0) shifts [m]; the same seen from J and C
};

/// Turns about a unit axis of J. @param axis  of length one
[[nodiscard]] TFDUDE_EXPORT Joint revolute_joint(const Transform& X_PJ,
                                                 const Eigen::Vector3d& axis);

/// Shifts along a unit axis of J. @param axis  of length one
[[nodiscard]] TFDUDE_EXPORT Joint prismatic_joint(const Transform& X_PJ,
                                                  const Eigen::Vector3d& axis);

/// X_PC(q). An error of q moves C along S, wherever q is, as Exp(S (q + δ)) = Exp(S q) Exp(S δ): so q's variance is the
/// covariance S Sᵀ σ² of rank one, without approximation; the origin's is seen from C and added to it.
/// @param position  q [rad or m]
/// @param variance  of q [rad² or m²]
[[nodiscard]] TFDUDE_EXPORT Transform joint_transform(const Joint& joint, double position,
                                                      double variance);

}  // namespace tfdude
