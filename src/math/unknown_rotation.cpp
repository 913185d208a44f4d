#include "math/unknown_rotation.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/SVD>

#include "math/square_root.hpp"

namespace tfdude {
namespace {

// π²/3 [rad²], of an angle that is anywhere.
constexpr double kAnywhere = 3.289868133696453;
// Instead of what was stated [rad]: the rotation is that of the path, and must not confirm it, how
// often it may be measured.
constexpr double kNothing = 1e3;
// What counts of an edge's own rotation [rad]: 55 times what is possible.
constexpr double kCounted = 100;

struct RotationAxes {
  Eigen::Matrix3d axes;  // columns, those that are known first
  Eigen::Vector3d variances;
  int known = 0;
};

// Of a root, by Jacobi's method: beside deviations of 1e9 rad, those that are known keep all their
// digits (J. Demmel, K. Veselić, "Jacobi's method is more accurate than QR", SIAM Journal on Matrix
// Analysis and Applications 13, 1992).
RotationAxes axes_of(const Loading& root) {
  RotationAxes found{Eigen::Matrix3d::Identity(), Eigen::Vector3d::Zero(), 0};
  if (root.cols() > 0) {
    const Eigen::MatrixXd turns = root.bottomRows<3>().transpose();
    const Eigen::JacobiSVD<Eigen::MatrixXd> svd(turns, Eigen::ComputeFullV);
    found.axes = svd.matrixV().rowwise().reverse();
    const Eigen::Index count = svd.singularValues().size();
    found.variances.tail(count) = svd.singularValues().reverse().cwiseAbs2();
  }
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

Pose turned_by(const Pose& Z_AB, const Eigen::Quaterniond& T) {
  return Pose::trusted((Z_AB.rotation() * T).normalized(), Z_AB.translation());
}

// Only the turn about one axis is known. How it depends on the rotation of the path, whose axes are
// others, is what the measurement says of that.
Measured with_one_turn(const Measured& Z_AB, const RotationAxes& of, const Eigen::Quaterniond& E) {
  const Eigen::Vector3d w = of.axes.col(0);
  const double a = E.vec().dot(w);
  const double c = E.w();
  const double size = a * a + c * c;
  // Nearly half a turn across the axis: the turn about it is undetermined, and so means nothing.
  constexpr double kUndetermined = 1e-6;
  if (size < kUndetermined) return Z_AB;
  const double turn = 2 * std::atan2(c < 0 ? -a : a, std::abs(c));
  // The derivative of that angle by a turn of the path in its own axes.
  const Eigen::Vector3d g = (c * c * w + c * w.cross(E.vec()) + a * E.vec()) / size;
  const Eigen::Vector3d by = g / g.squaredNorm();
  const Eigen::Quaterniond back(Eigen::AngleAxisd(-turn * by.norm(), by.normalized()));
  const Eigen::Quaterniond T = E * back;
  Loading known(6, Z_AB.root.cols());
  known << T.toRotationMatrix().transpose() * Z_AB.root.topRows<3>(),
      by * (w.transpose() * Z_AB.root.bottomRows<3>());
  Loading across = Loading::Zero(6, 3);
  across.bottomRows<3>() =
      kNothing * (Eigen::Matrix3d::Identity() - by * by.transpose() / by.squaredNorm());
  return {turned_by(Z_AB.X_AB, T), joined(known, across)};
}

}  // namespace

void bound_rotations(std::vector<Loading>& loadings) {
  const Eigen::Index count = loadings.empty() ? 0 : loadings.front().cols();
  for (Eigen::Index k = 0; k < count; ++k) {
    double most = 0;
    for (const Loading& one : loadings) most = std::max(most, one.col(k).tail<3>().norm());
    if (most <= kCounted) continue;
    for (Loading& one : loadings) one.col(k) *= kCounted / most;
  }
}

Matrix6d with_bounded_rotations(const Matrix6d& covariance) {
  if (covariance.diagonal().tail<3>().maxCoeff() <= kCounted * kCounted) return covariance;
  std::vector<Loading> root{root_of(covariance)};
  bound_rotations(root);
  return root[0] * root[0].transpose();
}

int unknown_rotations(const Loading& root) { return 3 - axes_of(root).known; }

Measured with_unknown_rotation_of(const Pose& X_AB, const Measured& Z_AB) {
  const RotationAxes of = axes_of(Z_AB.root);
  if (of.known == 3) return Z_AB;
  const Eigen::Quaterniond E = Z_AB.X_AB.rotation().conjugate() * X_AB.rotation();
  if (of.known == 1) return with_one_turn(Z_AB, of, E);
  const Eigen::Quaterniond T = of.known == 0 ? E : about(of.axes.col(2), E);
  const Eigen::Matrix3d turned = T.toRotationMatrix();
  // Along the axes that are known nothing changes; along the others nothing is left.
  const Eigen::MatrixXd unknown = of.axes.rightCols(3 - of.known);
  Loading root(6, Z_AB.root.cols() + unknown.cols());
  root << Z_AB.root, Loading::Zero(6, unknown.cols());
  root.bottomRows<3>() -= unknown * (unknown.transpose() * root.bottomRows<3>()).eval();
  root.bottomRightCorner(3, unknown.cols()) = kNothing * unknown;
  Matrix6d turn = Matrix6d::Zero();
  turn.topLeftCorner<3, 3>() = turn.bottomRightCorner<3, 3>() = turned.transpose();
  return {turned_by(Z_AB.X_AB, T), turn * root};
}

}  // namespace tfdude
