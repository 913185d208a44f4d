#include "math/unknown_rotation.hpp"

#include <cmath>

#include <Eigen/Eigenvalues>

namespace tfdude {
namespace {

// π²/3 [rad²], of an angle that is anywhere.
constexpr double kAnywhere = 3.289868133696453;
// Instead of what was stated [rad²]: the rotation is that of the path, and must not confirm it, how
// often it may be measured.
constexpr double kNothing = 1e6;

struct RotationAxes {
  Eigen::Matrix3d axes;  // columns, those that are known first
  Eigen::Vector3d variances;
  int known = 0;
};

RotationAxes axes_of(const Covariance& R) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> turns(R.matrix().bottomRightCorner<3, 3>());
  RotationAxes found{turns.eigenvectors(), turns.eigenvalues(), 0};
  while (found.known < 3 && found.variances[found.known] < kAnywhere) ++found.known;
  return found;
}

// The part of E that turns about the axis; the rest turns about an axis across it.
Eigen::Quaterniond about(const Eigen::Vector3d& axis, const Eigen::Quaterniond& E) {
  const double along = E.vec().dot(axis);
  if (E.w() == 0 && along == 0) return Eigen::Quaterniond::Identity();
  Eigen::Quaterniond turn;
  turn.w() = E.w();
  turn.vec() = along * axis;
  return turn.normalized();
}

Transform turned_by(const Transform& Z_AB, const Eigen::Quaterniond& T, const Matrix6d& R) {
  return {Pose::trusted((Z_AB.pose.rotation() * T).normalized(), Z_AB.pose.translation()),
          Covariance::trusted(0.5 * (R + R.transpose()))};
}

// Only the turn about one axis is known. How it depends on the rotation of the path, whose axes are
// others, is what the measurement says of that.
Transform with_one_turn(const Transform& Z_AB, const RotationAxes& of,
                        const Eigen::Quaterniond& E) {
  const Eigen::Vector3d w = of.axes.col(0);
  const double a = E.vec().dot(w);
  const double c = E.w();
  const double size = a * a + c * c;
  // Nearly half a turn across the axis: the turn about it is undetermined, and so means nothing.
  constexpr double kUndetermined = 1e-6;
  const Matrix6d& R = Z_AB.covariance.of_specified().matrix();
  if (size < kUndetermined) return Z_AB;
  const double turn = 2 * std::atan2(c < 0 ? -a : a, std::abs(c));
  // The derivative of that angle by a turn of the path in its own axes.
  const Eigen::Vector3d g = (c * c * w + c * w.cross(E.vec()) + a * E.vec()) / size;
  const Eigen::Vector3d by = g / g.squaredNorm();
  const Eigen::Quaterniond back(Eigen::AngleAxisd(-turn * by.norm(), by.normalized()));
  const Eigen::Quaterniond T = E * back;
  const Eigen::Matrix3d turned = T.toRotationMatrix();
  const Eigen::Matrix3d across =
      Eigen::Matrix3d::Identity() - by * by.transpose() / by.squaredNorm();
  Matrix6d all = Matrix6d::Zero();
  all.topLeftCorner<3, 3>() = turned.transpose() * R.topLeftCorner<3, 3>() * turned;
  all.bottomRightCorner<3, 3>() = of.variances[0] * by * by.transpose() + kNothing * across;
  all.topRightCorner<3, 3>() = turned.transpose() * R.topRightCorner<3, 3>() * w * by.transpose();
  all.bottomLeftCorner<3, 3>() = all.topRightCorner<3, 3>().transpose();
  return turned_by(Z_AB, T, all);
}

}  // namespace

int unknown_rotations(const Covariance& R) { return 3 - axes_of(R).known; }

Transform with_unknown_rotation_of(const Pose& X_AB, const Transform& Z_AB) {
  const RotationAxes of = axes_of(Z_AB.covariance.of_specified());
  if (of.known == 3) return Z_AB;
  const Eigen::Quaterniond E = Z_AB.pose.rotation().conjugate() * X_AB.rotation();
  if (of.known == 1) return with_one_turn(Z_AB, of, E);
  const Eigen::Quaterniond T = of.known == 0 ? E : about(of.axes.col(2), E);
  const Eigen::Matrix3d turned = T.toRotationMatrix();
  Matrix6d turn = Matrix6d::Zero();
  turn.topLeftCorner<3, 3>() = turn.bottomRightCorner<3, 3>() = turned.transpose();
  // Along the axes that are known nothing changes; along the others nothing is left.
  Matrix6d known = Matrix6d::Identity();
  const Eigen::MatrixXd unknown = of.axes.rightCols(3 - of.known);
  known.bottomRightCorner<3, 3>() -= unknown * unknown.transpose();
  Matrix6d R = known * Z_AB.covariance.of_specified().matrix() * known;
  R.bottomRightCorner<3, 3>() += kNothing * unknown * unknown.transpose();
  return turned_by(Z_AB, T, turn * R * turn.transpose());
}

}  // namespace tfdude
