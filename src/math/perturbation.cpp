#include "tfdude/math/perturbation.hpp"

#include <algorithm>

namespace tfdude {
namespace {

// diag(R, R): rotates both halves of a twist.
Pose turning(const Eigen::Quaterniond& rotation) {
  return Pose::trusted(rotation, Eigen::Vector3d::Zero());
}

}  // namespace

StatedCovariance left_covariance(const Transform& X) { return X.covariance.transported(X.pose); }

Transform from_left_covariance(const Pose& X, const StatedCovariance& left) {
  return {X, left.transported(X.inverse())};
}

StatedCovariance ros_covariance(const Transform& X) {
  return X.covariance.transported(turning(X.pose.rotation()));
}

Transform from_ros_covariance(const Pose& X, const StatedCovariance& ros) {
  return {X, ros.transported(turning(X.rotation().conjugate()))};
}

std::array<double, 6> stddev_in_parent(const Transform& X_AB) {
  std::array<double, 6> stddev = X_AB.covariance.of_specified().stddev();
  const std::array<double, 6> along_A = ros_covariance(X_AB).of_specified().stddev();
  std::copy_n(along_A.begin(), 3, stddev.begin());
  return stddev;
}

Matrix6d small_adjoint(const Twist& xi) {
  Matrix6d ad = Matrix6d::Zero();
  ad.topLeftCorner<3, 3>() = skew(xi.tail<3>());
  ad.bottomRightCorner<3, 3>() = ad.topLeftCorner<3, 3>();
  ad.topRightCorner<3, 3>() = skew(xi.head<3>());
  return ad;
}

namespace {

// Angles of up to π need about 25 terms. The translation enters linearly, so its size does not
// matter.
Matrix6d right_jacobian_series(const Twist& xi) {
  constexpr int kTerms = 30;
  const Matrix6d step = -small_adjoint(xi);
  Matrix6d term = Matrix6d::Identity();
  Matrix6d sum = term;
  for (int k = 1; k < kTerms; ++k) {
    term = (term * step / (k + 1)).eval();
    sum += term;
  }
  return sum;
}

}  // namespace

// Larger angles by halving: Jr(2 ξ) = (1 + Ad(Exp(-ξ))) Jr(ξ) / 2, as Jr(ξ) is the mean of
// Ad(Exp(-τ ξ)), τ from 0 to 1.
Matrix6d right_jacobian(const Twist& xi) {
  constexpr double kPi = 3.14159265358979323846;
  Twist part = xi;
  int halvings = 0;
  while (part.tail<3>().norm() > kPi && halvings < 64) {
    part *= 0.5;
    ++halvings;
  }
  Matrix6d J = right_jacobian_series(part);
  for (; halvings > 0; --halvings) {
    J = (0.5 * (Matrix6d::Identity() + adjoint(exp(-part))) * J).eval();
    part *= 2.0;
  }
  return J;
}

}  // namespace tfdude
