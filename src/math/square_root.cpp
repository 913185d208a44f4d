#include "math/square_root.hpp"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include <Eigen/QR>
#include <Eigen/SVD>

#include "math/decompositions.hpp"

namespace tfdude {
namespace {

// Lower left triangle L with L Lᵀ = A Aᵀ. The error of each row is relative to that row. By the
// steps of Eigen's HouseholderQR, without what that has for more columns: the compiler needs
// seconds for it.
Matrix6d triangle_of(const Loading& A) {
  Whitening turned = Whitening::Zero(std::max<Eigen::Index>(A.cols(), 6), 6);
  turned.topRows(A.cols()) = A.transpose();
  Twist workspace;
  for (Eigen::Index k = 0; k < 6; ++k) {
    const Eigen::Index rows = turned.rows() - k;
    auto column = turned.col(k).tail(rows);
    double factor = 0;
    double length = 0;
    column.makeHouseholderInPlace(factor, length);
    turned(k, k) = length;
    turned.bottomRightCorner(rows, 5 - k)
        .applyHouseholderOnTheLeft(column.tail(rows - 1), factor, workspace.data());
  }
  const Matrix6d upper = turned.topRows<6>().triangularView<Eigen::Upper>();
  return upper.transpose();
}

// One over each, zero for zero.
Twist inverted(const Twist& sizes) {
  return sizes.unaryExpr([](double size) { return size > 0 ? 1.0 / size : 0.0; });
}

Twist of_pose(double metres, double radians) {
  Twist sizes;
  sizes << Eigen::Vector3d::Constant(metres), Eigen::Vector3d::Constant(radians);
  return sizes;
}

}  // namespace

Loading root_of(const Matrix6d& semidefinite) {
  const Twist size = semidefinite.diagonal().cwiseMax(0.0).cwiseSqrt();
  const Twist unit = inverted(size);
  Matrix6d rest = unit.asDiagonal() * semidefinite * unit.asDiagonal();
  Loading root(6, 0);
  while (root.cols() < 6) {
    Eigen::Index pivot = 0;
    if (!(rest.diagonal().maxCoeff(&pivot) > kRoundingShare)) break;
    root.conservativeResize(Eigen::NoChange, root.cols() + 1);
    root.rightCols<1>() = rest.col(pivot) / std::sqrt(rest(pivot, pivot));
    rest -= root.rightCols<1>() * root.rightCols<1>().transpose();
    // Exactly, so that no axis is taken twice.
    rest.row(pivot).setZero();
    rest.col(pivot).setZero();
  }
  return size.asDiagonal() * root;
}

Matrix6d square_of(const Loading& root) { return root * root.transpose(); }

Loading joined(const Loading& A, const Loading& B) {
  Loading both(6, A.cols() + B.cols());
  both << A, B;
  return both;
}

Loading compressed(const Loading& root) {
  if (root.cols() <= 6) return root;
  return triangle_of(root);
}

Loading root_of_difference(const Loading& C, const Loading& D) {
  if (D.cols() == 0) return compressed(C);
  // Both come from many operations. Below that, a direction of C is none, and D's part in it would
  // be taken for one in which nothing is left.
  constexpr double kLost = 1e-12;
  const Twist sizes = (C.rowwise().squaredNorm() + D.rowwise().squaredNorm()).cwiseSqrt();
  const Factor whole(C, kLost * sizes);
  // Nothing is left of nothing; the eigenvalues of a matrix without rows are not defined.
  if (whole.rank() == 0) return Loading(6, 0);
  const Eigen::MatrixXd taken = whole.whitening() * D;
  constexpr double kEpsilon = std::numeric_limits<double>::epsilon();
  const auto rank = static_cast<Eigen::Index>(whole.rank());
  if (rank == 0) return Loading(6, 0);  // Eigen decomposes no empty matrix
  const Eigen::MatrixXd lost = taken * taken.transpose();
  const auto rest = eigen_of(Eigen::MatrixXd::Identity(rank, rank) - lost);
  return whole.root() * rest.eigenvectors() *
         rest.eigenvalues().cwiseMax(kEpsilon).cwiseSqrt().asDiagonal();
}

Factor::Factor(const Loading& A, const Twist& rounding) {
  const Matrix6d triangle = triangle_of(A);
  // The decomposition itself loses a share of each row.
  const Twist lost =
      (rounding.cwiseAbs2() + (kRoundingShare * triangle.rowwise().norm()).cwiseAbs2()).cwiseSqrt();
  const Matrix6d all = triangle_of(joined(triangle, Matrix6d(lost.asDiagonal())));
  const Twist size = all.rowwise().norm();
  unit_ = inverted(size);
  const Eigen::JacobiSVD<Matrix6d> svd(Matrix6d(unit_.asDiagonal() * all), Eigen::ComputeFullU);
  const Twist scaled_loss = unit_.cwiseProduct(lost);
  std::vector<Eigen::Index> uncertain;
  std::vector<Eigen::Index> exact;
  for (Eigen::Index k = 0; k < 6; ++k) {
    // Twice, in variance, what is due to rounding alone.
    const double due = std::sqrt(2.0) * svd.matrixU().col(k).cwiseProduct(scaled_loss).norm();
    (svd.singularValues()[k] > due ? uncertain : exact).push_back(k);
  }
  root_.resize(6, static_cast<Eigen::Index>(uncertain.size()));
  whitening_.resize(root_.cols(), 6);
  for (Eigen::Index i = 0; i < root_.cols(); ++i) {
    const Eigen::Index k = uncertain[static_cast<std::size_t>(i)];
    const Twist direction = svd.matrixU().col(k);
    root_.col(i) = size.cwiseProduct(direction) * svd.singularValues()[k];
    whitening_.row(i) = unit_.cwiseProduct(direction).transpose() / svd.singularValues()[k];
  }
  exact_.resize(6, static_cast<Eigen::Index>(exact.size()));
  for (Eigen::Index i = 0; i < exact_.cols(); ++i) {
    exact_.col(i) = svd.matrixU().col(exact[static_cast<std::size_t>(i)]);
  }
}

void Factor::leave_out(const std::vector<bool>& hidden, const Twist& within) {
  Loading root(6, 0);
  Whitening whitening(0, 6);
  for (Eigen::Index k = 0; k < root_.cols(); ++k) {
    if (hidden[static_cast<std::size_t>(k)]) {
      exact_ = joined(exact_, Loading(unit_.cwiseProduct(root_.col(k)).normalized()));
      continue;
    }
    root = joined(root, Loading(root_.col(k)));
    whitening.conservativeResize(root.cols(), Eigen::NoChange);
    whitening.bottomRows<1>() = whitening_.row(k);
  }
  root_ = std::move(root);
  whitening_ = std::move(whitening);
  within_ = within;
}

double Factor::distance_squared(const Twist& x) const { return (whitening_ * x).squaredNorm(); }

bool Factor::can_cause(const Twist& difference, const Twist& tolerance) const {
  constexpr double kCovarianceRounding = 1e-6;
  const Twist most = tolerance + within_;
  const Twist scaled = unit_.cwiseProduct(difference);
  const Twist allowed = unit_.cwiseProduct(most);
  for (int axis = 0; axis < 6; ++axis) {
    if (unit_[axis] == 0 && std::abs(difference[axis]) > most[axis]) return false;
  }
  for (const auto& direction : exact_.colwise()) {
    const double left = std::abs(direction.dot(scaled));
    const double rounded = direction.cwiseProduct(allowed).norm();
    if (!(left <= kCovarianceRounding * scaled.norm() + rounded)) return false;
  }
  return true;
}

Loading updated_root(const Loading& L, const Loading& A, const Loading& R, const Factor& S) {
  const auto rank = static_cast<Eigen::Index>(S.rank());
  // [W A, W R; L, 0], turned. What is large comes first, so that what is small keeps its digits.
  Eigen::MatrixXd array = Eigen::MatrixXd::Zero(std::max(A.cols() + R.cols(), rank + 6), rank + 6);
  array.topLeftCorner(A.cols(), rank) = (S.whitening() * A).transpose();
  array.block(A.cols(), 0, R.cols(), rank) = (S.whitening() * R).transpose();
  array.topRightCorner(A.cols(), 6) = L.transpose();
  const auto qr = qr_of(array);
  const Matrix6d rest = qr.matrixQR().block<6, 6>(rank, rank).triangularView<Eigen::Upper>();
  return rest.transpose();
}

Twist rounding_of_pose(double reach) { return of_pose(kRoundingShare * reach, kRoundingShare); }

Twist tolerance_of_pose(double reach) {
  // Quaternions are normalized, so their digits are fewer.
  return of_pose(1e-10 * reach, 1e-9);
}

}  // namespace tfdude
