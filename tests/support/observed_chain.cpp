#include "support/observed_chain.hpp"

#include <Eigen/LU>

namespace tfdude::testing {

Eigen::MatrixXd ObservedChain::dense() const {
  const auto size = static_cast<Eigen::Index>(6 * edges_.size());
  Eigen::MatrixXd P = Eigen::MatrixXd::Zero(size, size);
  for (std::size_t i = 0; i < edges_.size(); ++i) {
    for (std::size_t j = 0; j < edges_.size(); ++j) {
      auto block =
          P.block<6, 6>(static_cast<Eigen::Index>(6 * i), static_cast<Eigen::Index>(6 * j));
      if (i == j) block = edges_[i].X_PC.own.matrix();
      for (const CommonError& a : edges_[i].X_PC.common_errors) {
        for (const CommonError& b : edges_[j].X_PC.common_errors) {
          if (a.source != b.source || a.subtracts != b.subtracts) continue;
          block += (a.subtracts ? -1.0 : 1.0) * a.loading * b.loading.transpose();
        }
      }
    }
  }
  return P;
}

Eigen::MatrixXd ObservedChain::dense_update(const Eigen::MatrixXd& P, std::size_t from,
                                            std::size_t to, const Covariance& R) const {
  Eigen::MatrixXd H = Eigen::MatrixXd::Zero(6, P.cols());
  Eigen::MatrixXd concerns = Eigen::MatrixXd::Zero(P.rows(), P.cols());
  for (std::size_t i = std::min(from, to); i < std::max(from, to); ++i) {
    const Pose X_toC = believed(to, i + 1).pose;
    const auto at = static_cast<Eigen::Index>(6 * i);
    H.middleCols<6>(at) = (from > to ? -1.0 : 1.0) * adjoint(X_toC);
  }
  for (const std::size_t i : concerned(from, to)) {
    const auto at = static_cast<Eigen::Index>(6 * i);
    concerns.block<6, 6>(at, at).setIdentity();
  }
  const Matrix6d S = H * P * H.transpose() + R.matrix();
  const Eigen::MatrixXd K = concerns * P * H.transpose() * S.inverse();
  const Eigen::MatrixXd rest = Eigen::MatrixXd::Identity(P.rows(), P.cols()) - K * H;
  return rest * P * rest.transpose() + K * R.matrix() * K.transpose();
}

}  // namespace tfdude::testing
