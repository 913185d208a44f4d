#include "math/semidefinite.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include <Eigen/Cholesky>

#include "math/square_root.hpp"
#include "math/symmetric_eigen.hpp"

namespace tfdude {
namespace {

constexpr double kRounding = 1e-12;
// Pivots above this settle the sign of the smallest eigenvalue.
constexpr double kClearPivot = 1e-7;
// Of a difference, this share of what was subtracted: rounding is below a hundredth of it.
constexpr double kClearRest = 1e-13;

bool is_zero_axis(const Covariance::Upper& upper, std::size_t k) {
  for (std::size_t i = 0; i < 6; ++i) {
    if (upper[upper_index(std::min(i, k), std::max(i, k))] != 0) return false;
  }
  return true;
}

// Of an LDLᵀ factorization. Where nothing is demanded, the axis must be zero.
bool pivots_exceed(const Covariance::Upper& upper, const std::array<double, 6>& least) {
  double a[6][6];
  for (std::size_t i = 0; i < 6; ++i) {
    for (std::size_t j = i; j < 6; ++j) a[i][j] = upper[upper_index(i, j)];
  }
  for (std::size_t k = 0; k < 6; ++k) {
    if (least[k] == 0) {
      if (!is_zero_axis(upper, k)) return false;
      continue;
    }
    if (!(a[k][k] > least[k])) return false;
    for (std::size_t i = k + 1; i < 6; ++i) {
      const double factor = a[k][i] / a[k][k];
      for (std::size_t j = i; j < 6; ++j) a[i][j] -= factor * a[k][j];
    }
  }
  return true;
}

// One over the standard deviation of each axis, zero if that is zero.
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

bool is_clearly_semidefinite(const Covariance::Upper& upper) {
  std::array<double, 6> least;
  for (std::size_t k = 0; k < 6; ++k) {
    const double variance = upper[upper_index(k, k)];
    if (!(variance <= kMaxVariance)) return false;
    least[k] = kClearPivot * variance;
  }
  return pivots_exceed(upper, least);
}

bool is_clear_difference(const Covariance& difference, const Twist& variances) {
  std::array<double, 6> least;
  for (std::size_t k = 0; k < 6; ++k) {
    least[k] = kClearRest * variances[static_cast<Eigen::Index>(k)];
  }
  return pivots_exceed(difference.upper(), least);
}

bool is_semidefinite(const Covariance& symmetric) {
  if (is_clearly_semidefinite(symmetric.upper())) return true;
  const Matrix6d matrix = symmetric.matrix();
  if (matrix.diagonal().minCoeff() < 0) return false;
  // Takes a tenth of the time of eigenvalues.
  const Matrix6d lifted = scaled(matrix, units(matrix)) + kRounding * Matrix6d::Identity();
  return Eigen::LLT<Matrix6d>(lifted).info() == Eigen::Success;
}

Matrix6d nearest_semidefinite(const Matrix6d& symmetric) {
  const Matrix6d even = 0.5 * (symmetric + symmetric.transpose());
  const Twist unit = units(even);
  if (Eigen::LLT<Matrix6d>(scaled(even, unit)).info() == Eigen::Success) return even;
  const Matrix6d lifted =
      symmetric_eigen(scaled(even, unit)).of([](double value) { return std::max(value, 0.0); });
  const Matrix6d back = scaled(lifted, inverse_units(unit));
  return 0.5 * (back + back.transpose());
}

Matrix6d pseudo_inverse(const Matrix6d& semidefinite, int* rank) {
  const Factor factor(root_of(semidefinite));
  if (rank != nullptr) *rank = factor.rank();
  return factor.whitening().transpose() * factor.whitening();
}

}  // namespace tfdude
