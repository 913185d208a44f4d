#pragma once

#include <cmath>
#include <functional>
#include <sstream>
#include <string>

#include <Eigen/Eigenvalues>

#include "tfdude/math/transform.hpp"

#include "support/random.hpp"

namespace tfdude::testing {

/// ξ ~ N(0, Σ), also where Σ is singular.
class Gaussian {
 public:
  explicit Gaussian(const Eigen::MatrixXd& covariance) {
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(covariance);
    root_ = solver.eigenvectors() * solver.eigenvalues().cwiseMax(0.0).cwiseSqrt().asDiagonal();
  }
  explicit Gaussian(const Covariance& covariance)
      : Gaussian(Eigen::MatrixXd(covariance.matrix())) {}

  [[nodiscard]] Eigen::VectorXd operator()(Random& random) const {
    Eigen::VectorXd unit(root_.cols());
    for (Eigen::Index i = 0; i < unit.size(); ++i) unit[i] = random.normal();
    return root_ * unit;
  }

 private:
  Eigen::MatrixXd root_;
};

/// E[ξ ξᵀ] over samples of ξ.
[[nodiscard]] inline Matrix6d second_moment(int samples, const std::function<Twist()>& sample) {
  Matrix6d sum = Matrix6d::Zero();
  for (int i = 0; i < samples; ++i) {
    const Twist xi = sample();
    sum += xi * xi.transpose();
  }
  return sum / samples;
}

/// Empty if a second moment over so many samples of a Gaussian agrees with Σ in every element, within five standard errors
/// √((σii σjj + σij²) / N) (Isserlis) and `more` of √(σii σjj).
[[nodiscard]] inline std::string moment_diff(const Matrix6d& sampled, const Matrix6d& sigma,
                                             int samples, double more = 0) {
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

/// The smallest eigenvalue of Σ - sampled in units of Σ's own axes: how far Σ is from dominating.
[[nodiscard]] inline double domination(const Matrix6d& sigma, const Matrix6d& sampled) {
  const Twist unit = sigma.diagonal().unaryExpr(
      [](double variance) { return variance > 0 ? 1.0 / std::sqrt(variance) : 0.0; });
  const Matrix6d rest = unit.asDiagonal() * (sigma - sampled) * unit.asDiagonal();
  return Eigen::SelfAdjointEigenSolver<Matrix6d>(rest, Eigen::EigenvaluesOnly).eigenvalues()[0];
}

}  // namespace tfdude::testing
