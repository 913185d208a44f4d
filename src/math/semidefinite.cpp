#include "math/semidefinite.hpp"

#include <cmath>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>

namespace tfdude {
namespace {

using Solver = Eigen::SelfAdjointEigenSolver<Matrix6d>;

constexpr double kRounding = 1e-12;

// One over the standard deviation of each axis, zero where there is none.
Twist units(const Matrix6d& symmetric) {
  return symmetric.diagonal().unaryExpr(
      [](double variance) { return variance > 0 ? 1.0 / std::sqrt(variance) : 0.0; });
}

Matrix6d scaled(const Matrix6d& symmetric, const Twist& unit) {
  return unit.asDiagonal() * symmetric * unit.asDiagonal();
}

Twist inverse_units(const Twist& unit) {
  return unit.unaryExpr([](double one) { return one > 0 ? 1.0 / one : 0.0; });
}

}  // namespace

bool is_semidefinite(const Matrix6d& symmetric) {
  if (symmetric.diagonal().minCoeff() < 0) return false;
  // A tenth of the time that eigenvalues take.
  const Matrix6d lifted = scaled(symmetric, units(symmetric)) + kRounding * Matrix6d::Identity();
  return Eigen::LLT<Matrix6d>(lifted).info() == Eigen::Success;
}

Matrix6d nearest_semidefinite(const Matrix6d& symmetric) {
  const Matrix6d even = 0.5 * (symmetric + symmetric.transpose());
  const Twist unit = units(even);
  if (Eigen::LLT<Matrix6d>(scaled(even, unit)).info() == Eigen::Success) return even;
  const Solver solver(scaled(even, unit));
  const Matrix6d lifted = solver.eigenvectors() * solver.eigenvalues().cwiseMax(0.0).asDiagonal() *
                          solver.eigenvectors().transpose();
  const Matrix6d back = scaled(lifted, inverse_units(unit));
  return 0.5 * (back + back.transpose());
}

Matrix6d pseudo_inverse(const Matrix6d& semidefinite, int* rank) {
  const Twist unit = units(semidefinite);
  const Solver solver(scaled(semidefinite, unit));
  const double least = kRounding * solver.eigenvalues().cwiseAbs().maxCoeff();
  const Twist inverse = solver.eigenvalues().unaryExpr(
      [least](double value) { return value > least ? 1.0 / value : 0.0; });
  if (rank != nullptr) *rank = static_cast<int>((inverse.array() > 0).count());
  return scaled(solver.eigenvectors() * inverse.asDiagonal() * solver.eigenvectors().transpose(),
                unit);
}

bool is_possible(const Twist& difference, const Matrix6d& covariance, const Matrix6d& inverse) {
  constexpr double kAgrees = 1e-9;
  return (difference - covariance * (inverse * difference)).cwiseAbs().maxCoeff() <= kAgrees;
}

}  // namespace tfdude
