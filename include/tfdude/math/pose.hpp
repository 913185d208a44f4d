#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "tfdude/base/export.hpp"
#include "tfdude/base/result.hpp"

namespace tfdude {

/// Tangent vector of SE(3), ξ = (ρ, θ): translation first [m], then rotation [rad].
using Twist = Eigen::Matrix<double, 6, 1>;
using Matrix6d = Eigen::Matrix<double, 6, 6>;

/// Largest accepted translation component [m]: beyond the Moon's orbit, and small enough that no
/// chain of edges can overflow.
inline constexpr double kMaxTranslation = 1e9;

/// X_AB, the pose of frame B in frame A: p_A = X_AB · p_B. A rigid transform whose rotation is
/// always a unit quaternion: outside values must pass create(). Trivially copyable and without
/// alignment requirements, so that it may be shared between builds.
class TFDUDE_EXPORT Pose {
 public:
  /// The identity.
  Pose() = default;

  /// Creates a pose from outside values, which it checks.
  /// @param rotation     R_AB; normalized if its norm is within 1e-3 of one
  /// @param translation  origin of B in A [m]
  /// @return kInvalidInput naming the field: NaN, infinity, not of unit length, beyond
  ///   kMaxTranslation.
  [[nodiscard]] static Result<Pose> create(const Eigen::Quaterniond& rotation,
                                           const Eigen::Vector3d& translation);

  /// Of a homogeneous matrix [R, t; 0, 1].
  /// @return kInvalidInput: R is no rotation to 1e-6, another last row, and as create().
  [[nodiscard]] static Result<Pose> from_matrix(const Eigen::Matrix4d& matrix);

  /// For results of the library's own computations: `rotation` must be of unit length up to
  /// rounding.
  [[nodiscard]] static Pose trusted(const Eigen::Quaterniond& rotation,
                                    const Eigen::Vector3d& translation);

  [[nodiscard]] Eigen::Quaterniond rotation() const { return {q_[3], q_[0], q_[1], q_[2]}; }
  [[nodiscard]] Eigen::Vector3d translation() const { return {p_[0], p_[1], p_[2]}; }
  [[nodiscard]] Eigen::Matrix4d matrix() const;

  /// X_BA of this X_AB.
  [[nodiscard]] Pose inverse() const;

  /// p_A = X_AB · p_B.
  [[nodiscard]] Eigen::Vector3d operator*(const Eigen::Vector3d& p_B) const {
    return rotation() * p_B + translation();
  }

 private:
  double q_[4] = {0, 0, 0, 1};  // x, y, z, w
  double p_[3] = {0, 0, 0};
};

/// X_AC = X_AB · X_BC. The rotation is normalized again, so that chains do not drift.
[[nodiscard]] TFDUDE_EXPORT Pose operator*(const Pose& X_AB, const Pose& X_BC);

/// Exponential map, ξ = (ρ, θ) to SE(3). Solà et al., arXiv:1812.01537, Eqs. 172 and 174.
[[nodiscard]] TFDUDE_EXPORT Pose exp(const Twist& xi);

/// Logarithm with |θ| ≤ π; exact at the identity and at π. Solà et al., arXiv:1812.01537, Eqs. 173,
/// 174.
[[nodiscard]] TFDUDE_EXPORT Twist log(const Pose& X);

/// Ad(X), with X · Exp(ξ) · X⁻¹ = Exp(Ad(X) ξ); for (ρ, θ) it is [R, [t]×R; 0, R].
/// Solà et al., arXiv:1812.01537, Eq. 175.
[[nodiscard]] TFDUDE_EXPORT Matrix6d adjoint(const Pose& X);

/// The cross-product matrix: skew(a) b = a × b.
[[nodiscard]] TFDUDE_EXPORT Eigen::Matrix3d skew(const Eigen::Vector3d& a);

/// Rotation from fixed-axis angles as in URDF: R = Rz(yaw) · Ry(pitch) · Rx(roll) [rad].
[[nodiscard]] TFDUDE_EXPORT Eigen::Quaterniond from_rpy(double roll, double pitch, double yaw);

/// Inverse of from_rpy(): (roll, pitch, yaw) [rad], pitch in [-π/2, π/2]; at ±π/2 roll is set to 0.
[[nodiscard]] TFDUDE_EXPORT Eigen::Vector3d to_rpy(const Eigen::Quaterniond& rotation);

}  // namespace tfdude
