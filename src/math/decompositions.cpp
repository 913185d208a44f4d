#include "math/decompositions.hpp"

#include <algorithm>

#include <Eigen/LU>

namespace tfdude {

Eigen::HouseholderQR<Eigen::MatrixXd> qr_of(const Eigen::MatrixXd& A) {
  return Eigen::HouseholderQR<Eigen::MatrixXd>(A);
}

Eigen::MatrixXd thin_q(const Eigen::HouseholderQR<Eigen::MatrixXd>& qr) {
  const Eigen::Index rank = std::min(qr.rows(), qr.cols());
  return qr.householderQ() * Eigen::MatrixXd::Identity(qr.rows(), rank);
}

Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen_of(const Eigen::MatrixXd& symmetric) {
  return Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(symmetric);
}

Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen_of(const Eigen::MatrixXd& A,
                                                        const Eigen::VectorXd& d) {
  return Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(A * d.asDiagonal() * A.transpose());
}

Matrix6d inverse_of(const Matrix6d& A) { return A.inverse(); }

}  // namespace tfdude
