#pragma once

#include <stdexcept>
#include <utility>

#include <Eigen/Geometry>

#include "tfdude/base/result.hpp"
#include "tfdude/math/transform.hpp"

// Conversions and operators for programs that use Eigen, and errors as exceptions for those that
// prefer them.
namespace tfdude {

/// X_AB as Eigen's rigid transform.
[[nodiscard]] inline Eigen::Isometry3d to_isometry(const Pose& X_AB) {
  Eigen::Isometry3d X = Eigen::Isometry3d::Identity();
  X.linear() = X_AB.rotation().toRotationMatrix();
  X.translation() = X_AB.translation();
  return X;
}

/// @return as Pose::from_matrix()
[[nodiscard]] inline Result<Pose> from_isometry(const Eigen::Isometry3d& X_AB) {
  return Pose::from_matrix(X_AB.matrix());
}

/// Of a translation [m] and fixed-axis angles (roll, pitch, yaw) [rad], as in URDF.
/// @return as Pose::create()
[[nodiscard]] inline Result<Pose> from_xyz_rpy(const Eigen::Vector3d& xyz,
                                               const Eigen::Vector3d& rpy) {
  return Pose::create(from_rpy(rpy.x(), rpy.y(), rpy.z()), xyz);
}

/// X_AC = X_AB · X_BC, with independent errors to first order: compose().
[[nodiscard]] inline Transform operator*(const Transform& X_AB, const Transform& X_BC) {
  return compose(X_AB, X_BC);
}

/// Derivatives of a product of poses by the right perturbations of its factors: with errors ξ1 and
/// ξ2 of these, that of the product is J_1 ξ1 + J_2 ξ2. Solà et al., arXiv:1812.01537, Eqs. 62, 63.
struct ProductJacobians {
  Matrix6d by_first;   ///< Ad(X_BC⁻¹)
  Matrix6d by_second;  ///< the identity
};

/// X_AC = X_AB · X_BC and its derivatives.
[[nodiscard]] inline Pose multiply(const Pose& X_AB, const Pose& X_BC,
                                   ProductJacobians& jacobians) {
  jacobians.by_first = adjoint(X_BC.inverse());
  jacobians.by_second.setIdentity();
  return X_AB * X_BC;
}

/// X_BA of X_AB and its derivative, -Ad(X_AB). Solà et al., arXiv:1812.01537, Eq. 61.
[[nodiscard]] inline Pose invert(const Pose& X_AB, Matrix6d& jacobian) {
  jacobian = -adjoint(X_AB);
  return X_AB.inverse();
}

/// p_A = X_AB p_B and its derivatives by the right perturbation of X_AB, R [1, -p_B×], and by p_B,
/// R. Solà et al., arXiv:1812.01537, Eqs. 65, 66.
[[nodiscard]] inline Eigen::Vector3d act(const Pose& X_AB, const Eigen::Vector3d& p_B,
                                         Eigen::Matrix<double, 3, 6>& by_pose,
                                         Eigen::Matrix3d& by_point) {
  by_point = X_AB.rotation().toRotationMatrix();
  by_pose << by_point, -by_point * skew(p_B);
  return X_AB * p_B;
}

/// An error as an exception.
class ErrorException : public std::runtime_error {
 public:
  explicit ErrorException(Error error)
      : std::runtime_error(error.message), error_(std::move(error)) {}
  [[nodiscard]] const Error& error() const { return error_; }
  [[nodiscard]] Errc code() const { return error_.code; }

 private:
  Error error_;
};

/// The value of a result. @throws ErrorException
template <class T>
[[nodiscard]] T value_or_throw(Result<T> result) {
  if (!result) throw ErrorException(std::move(result.error()));
  return *std::move(result);
}
inline void value_or_throw(const Result<void>& result) {
  if (!result) throw ErrorException(result.error());
}

}  // namespace tfdude
