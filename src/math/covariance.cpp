#include "tfdude/math/covariance.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include "tfdude/base/number.hpp"

#include "math/columns.hpp"
#include "math/semidefinite.hpp"
#include "math/symmetric_eigen.hpp"

namespace tfdude {
namespace {

// What counts as rounding, relative to the size of the matrix when it is scaled to a unit diagonal,
// so that metres and radians of very different size are treated alike: negative eigenvalues as far
// below zero as this share of the largest. Rounding to float32 moves an element by 6e-8 of it.
constexpr double kTolerance = 1e-6;
// Of an element, as the largest eigenvalue is at most 6 then.
constexpr double kElementTolerance = 6 * kTolerance;
// Each axis is scaled as if it had at least this share of the largest variance in metres (in
// radians). A matrix that was computed is semi-definite up to rounding of that largest variance
// (here 1e-12 of it). An axis that is known exactly, up to rounding, must not be judged by its
// rounding error.
constexpr double kAxisShare = 1e-6;

std::string element(std::size_t row, std::size_t column) {
  return "covariance[" + std::to_string(row) + "][" + std::to_string(column) + "]";
}

// The variances by which a matrix is scaled: its own, but raised if far below the largest of their
// unit.
Twist judged_variances(const Twist& variances) {
  Twist judged;
  judged.head<3>() = variances.head<3>().cwiseMax(kAxisShare * variances.head<3>().maxCoeff());
  judged.tail<3>() = variances.tail<3>().cwiseMax(kAxisShare * variances.tail<3>().maxCoeff());
  return judged;
}

// Scales to a unit diagonal (or less, see kAxisShare), in place. If all three variances of a unit
// are zero, their whole rows must be zero.
Result<void> scale_to_unit_diagonal(Matrix6d& m, Twist& scale) {
  scale = judged_variances(m.diagonal()).unaryExpr([](double variance) {
    return variance > 0 ? 1.0 / std::sqrt(variance) : 0.0;
  });
  for (int i = 0; i < 6; ++i) {
    for (int j = 0; j < 6; ++j) {
      if (i == j || m(i, j) == 0) continue;
      const bool zero_variance = scale[i] == 0 || scale[j] == 0;
      const double correlation = m(i, j) * scale[i] * scale[j];
      if (zero_variance || !(std::abs(correlation) <= 1.0 + kElementTolerance)) {
        return fail(Errc::kInvalidInput,
                    element(static_cast<std::size_t>(i), static_cast<std::size_t>(j)) +
                        " is larger than its variances allow: not positive semi-definite");
      }
    }
  }
  m = scale.asDiagonal() * m * scale.asDiagonal();
  return {};
}

// The matrix unchanged, or with eigenvalues raised to zero that are negative by rounding.
Result<Covariance::Upper> checked_psd(const Covariance::Upper& upper) {
  const Matrix6d sigma = Covariance::trusted(upper).matrix();
  Matrix6d unit = sigma;
  Twist scale;
  if (auto ok = scale_to_unit_diagonal(unit, scale); !ok) return tl::unexpected(ok.error());
  const SymmetricEigen eigen = symmetric_eigen(unit);
  const double smallest = eigen.values[0];
  if (!(smallest >= -kTolerance * eigen.values[5])) {
    return fail(Errc::kInvalidInput,
                "covariance is not positive semi-definite: the smallest eigenvalue "
                "of its correlation matrix is " +
                    number_text(smallest));
  }
  if (smallest >= 0) return upper;
  const Twist back = scale.unaryExpr([](double s) { return s > 0 ? 1.0 / s : 0.0; });
  const Matrix6d psd = eigen.of([](double value) { return std::max(value, 0.0); });
  return Covariance::trusted(Matrix6d(back.asDiagonal() * psd * back.asDiagonal())).upper();
}

}  // namespace

Result<Covariance> Covariance::from_matrix(const Matrix6d& matrix) {
  const Twist size = judged_variances(matrix.diagonal()).cwiseSqrt();
  Upper upper{};
  for (std::size_t i = 0; i < 6; ++i) {
    for (std::size_t j = i; j < 6; ++j) {
      const auto row = static_cast<Eigen::Index>(i);
      const auto column = static_cast<Eigen::Index>(j);
      const double above = matrix(row, column);
      const double below = matrix(column, row);
      if (std::abs(above - below) > kElementTolerance * size[row] * size[column]) {
        return fail(Errc::kInvalidInput, element(i, j) + " and " + element(j, i) +
                                             " differ: the covariance is not symmetric");
      }
      // The mean, without the sum: that of two finite numbers may be infinite.
      upper[upper_index(i, j)] = above == below ? above : 0.5 * above + 0.5 * below;
    }
  }
  return from_upper(upper);
}

Result<Covariance> Covariance::from_upper(const Upper& upper) {
  if (is_clearly_semidefinite(upper)) return trusted(upper);
  Twist variances;
  for (std::size_t i = 0; i < 6; ++i) {
    variances[static_cast<Eigen::Index>(i)] = upper[upper_index(i, i)];
  }
  const Twist least = -kTolerance * judged_variances(variances);
  for (std::size_t i = 0; i < 6; ++i) {
    for (std::size_t j = i; j < 6; ++j) {
      const double value = upper[upper_index(i, j)];
      if (!std::isfinite(value)) {
        return fail(Errc::kInvalidInput, element(i, j) + " is not a finite number");
      }
      if (i == j && value < std::min(0.0, least[static_cast<Eigen::Index>(i)])) {
        return fail(Errc::kInvalidInput, element(i, j) + " is a negative variance");
      }
      if (std::abs(value) > kMaxVariance) {
        return fail(Errc::kInvalidInput,
                    element(i, j) + " is " + number_text(value) + ", which is beyond 1e18");
      }
    }
  }
  const auto psd = checked_psd(upper);
  if (!psd) return tl::unexpected(psd.error());
  return trusted(*psd);
}

Result<Covariance> Covariance::from_stddev(const std::array<double, 6>& stddev) {
  Upper upper{};
  for (std::size_t i = 0; i < 6; ++i) {
    const std::string field = "stddev[" + std::to_string(i) + "]";
    if (!std::isfinite(stddev[i]))
      return fail(Errc::kInvalidInput, field + " is not a finite number");
    if (stddev[i] < 0) return fail(Errc::kInvalidInput, field + " is negative");
    if (stddev[i] > std::sqrt(kMaxVariance))
      return fail(Errc::kInvalidInput,
                  field + " is " + number_text(stddev[i]) + ", which is beyond 1e9");
    upper[upper_index(i, i)] = stddev[i] * stddev[i];
  }
  return trusted(upper);
}

Covariance Covariance::trusted(const Upper& upper) {
  Covariance sigma;
  sigma.upper_ = upper;
  return sigma;
}

Covariance Covariance::trusted(const Matrix6d& symmetric) {
  Covariance sigma;
  for (std::size_t i = 0; i < 6; ++i) {
    for (std::size_t j = i; j < 6; ++j) {
      sigma.upper_[upper_index(i, j)] =
          symmetric(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j));
    }
  }
  return sigma;
}

Matrix6d Covariance::matrix() const {
  Matrix6d m;
  for (std::size_t i = 0; i < 6; ++i) {
    for (std::size_t j = i; j < 6; ++j) {
      const double value = upper_[upper_index(i, j)];
      m(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)) = value;
      m(static_cast<Eigen::Index>(j), static_cast<Eigen::Index>(i)) = value;
    }
  }
  return m;
}

std::array<double, 6> Covariance::stddev() const {
  std::array<double, 6> s{};
  for (std::size_t i = 0; i < 6; ++i) s[i] = std::sqrt(std::max(0.0, upper_[upper_index(i, i)]));
  return s;
}

Covariance Covariance::transported(const Pose& X) const {
  return kernel::transported(kernel::columns_of(X), *this);
}

Covariance& Covariance::operator+=(const Covariance& other) {
  for (std::size_t i = 0; i < kSize; ++i) upper_[i] += other.upper_[i];
  return *this;
}

Covariance operator+(Covariance a, const Covariance& b) { return a += b; }

}  // namespace tfdude
