#include "support/sampling.hpp"

#include <cmath>
#include <sstream>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <Eigen/QR>

namespace tfdude::testing {

Eigen::VectorXd eigenvalues(const Eigen::MatrixXd& symmetric) {
  return Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(symmetric, Eigen::EigenvaluesOnly)
      .eigenvalues();
}

Twist ratios(const Matrix6d& claimed, const Matrix6d& right) {
  return Eigen::GeneralizedSelfAdjointEigenSolver<Matrix6d>(claimed, right, Eigen::EigenvaluesOnly)
      .eigenvalues();
}

Matrix6d cholesky_root(const Matrix6d& positive) { return positive.llt().matrixL(); }

Matrix6d inverse_of(const Matrix6d& matrix) { return matrix.inverse(); }

Matrix6d random_orthogonal(Random& random) {
  const auto normal = [&](auto, auto) { return random.normal(); };
  return Eigen::HouseholderQR<Matrix6d>(Matrix6d::NullaryExpr(normal)).householderQ();
}

double squared_distance(const Twist& error, const Matrix6d& sigma) {
  return error.dot(sigma.ldlt().solve(error));
}

Gaussian::Gaussian(const Eigen::MatrixXd& covariance) {
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(covariance);
  root_ = solver.eigenvectors() * solver.eigenvalues().cwiseMax(0.0).cwiseSqrt().asDiagonal();
}

Eigen::VectorXd Gaussian::operator()(Random& random) const {
  Eigen::VectorXd unit(root_.cols());
  for (Eigen::Index i = 0; i < unit.size(); ++i) unit[i] = random.normal();
  return root_ * unit;
}

Matrix6d second_moment(int samples, const std::function<Twist()>& sample) {
  Matrix6d sum = Matrix6d::Zero();
  for (int i = 0; i < samples; ++i) {
    const Twist xi = sample();
    sum += xi * xi.transpose();
  }
  return sum / samples;
}

std::string moment_diff(const Matrix6d& sampled, const Matrix6d& sigma, int samples, double more) {
  for (int i = 0; i < 6; ++i) {
    for (int j = i; j < 6; ++j) {
      const double product = sigma(i, i) * sigma(j, j);
      const double error = std::sqrt((product + sigma(i, j) * sigma(i, j)) / samples);
      const double allowed = 5.0 * error + more * std::sqrt(product);
      if (std::abs(sampled(i, j) - sigma(i, j)) <= allowed) continue;
      std::ostringstream out;
      out << "[" << i << "][" << j << "]: sampled " << sampled(i, j) << ", computed " << sigma(i, j)
          << ", allowed " << allowed;
      return out.str();
    }
  }
  return "";
}

double domination(const Matrix6d& sigma, const Matrix6d& sampled) {
  const Twist unit = sigma.diagonal().unaryExpr(
      [](double variance) { return variance > 0 ? 1.0 / std::sqrt(variance) : 0.0; });
  return eigenvalues(unit.asDiagonal() * (sigma - sampled) * unit.asDiagonal())[0];
}

}  // namespace tfdude::testing
