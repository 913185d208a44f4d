#pragma once

#include <array>

#include "tfdude/base/export.hpp"
#include "tfdude/math/transform.hpp"

// The same uncertainty in other conventions. The library itself uses the right perturbation X = X̄
// · Exp(ξ), ξ = (ρ, θ), expressed in the child frame.
namespace tfdude {

/// Covariance of the left perturbation X = Exp(ξ) · X̄, expressed in the parent frame: Ad(X̄) Σ
/// Ad(X̄)ᵀ. Exact, since X̄ · Exp(ξ) = Exp(Ad(X̄) ξ) · X̄. The convention of Barfoot & Furgale
/// 2014.
[[nodiscard]] TFDUDE_EXPORT StatedCovariance left_covariance(const Transform& X);

/// The inverse of left_covariance().
[[nodiscard]] TFDUDE_EXPORT Transform from_left_covariance(const Pose& X,
                                                           const StatedCovariance& left);

/// Covariance as in ROS's geometry_msgs/PoseWithCovariance: of the child's origin p = p̄ + δp along
/// the parent's axes [m], and of a rotation R = Exp(δθ) · R̄ about axes parallel to the parent's
/// through the child's origin [rad]. First order: since p = p̄ + R̄ V(θ) ρ with V(θ) = 1 + θ×/2 +
/// ..., δp = R̄ ρ and δθ = R̄ θ.
/// @note This is not the covariance of the numbers roll, pitch and yaw, which is equal only near
///   the identity.
[[nodiscard]] TFDUDE_EXPORT StatedCovariance ros_covariance(const Transform& X);

/// The inverse of ros_covariance().
[[nodiscard]] TFDUDE_EXPORT Transform from_ros_covariance(const Pose& X,
                                                          const StatedCovariance& ros);

/// The standard deviations that stand beside the numbers of X_AB: of B's origin along the axes of
/// A, as its coordinates [m], then of the rotation about the axes of B [rad]. Of the specified
/// edges, if the covariance is not complete. First order, as ros_covariance().
[[nodiscard]] TFDUDE_EXPORT std::array<double, 6> stddev_in_parent(const Transform& X_AB);

/// Jr(ξ), with Exp(ξ + δ) = Exp(ξ) · Exp(Jr(ξ) δ) for small δ; for any angle. Uses its power
/// series, Solà et al., arXiv:1812.01537, Eqs. 67 and 179. Jl(ξ) = Jr(-ξ).
[[nodiscard]] TFDUDE_EXPORT Matrix6d right_jacobian(const Twist& xi);

/// ad(ξ), with ad(ξ) η = [ξ, η], the Lie bracket of se(3). Barfoot & Furgale 2014, Eq. 5.
[[nodiscard]] TFDUDE_EXPORT Matrix6d small_adjoint(const Twist& xi);

}  // namespace tfdude
