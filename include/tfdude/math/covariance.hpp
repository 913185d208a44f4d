#pragma once

#include <array>

#include <Eigen/Core>

#include "tfdude/base/export.hpp"
#include "tfdude/base/result.hpp"
#include "tfdude/math/pose.hpp"

namespace tfdude {

/// Largest accepted variance [m² or rad²]. With kMaxTranslation it keeps every chain finite.
inline constexpr double kMaxVariance = 1e18;

/// Covariance of the right perturbation X = X̄ · Exp(ξ), ξ = (ρ, θ): 6x6, translation first [m²,
/// m·rad, rad²], expressed in the child frame. Always symmetric (only the upper triangle is stored)
/// and positive semi-definite up to rounding: outside values must pass the from_...() functions.
class TFDUDE_EXPORT Covariance {
 public:
  static constexpr std::size_t kSize = 21;
  /// Upper triangle, row by row: (0,0), (0,1) ... (0,5), (1,1) ... (5,5).
  using Upper = std::array<double, kSize>;

  /// Zero: known exactly.
  Covariance() = default;

  /// @return kInvalidInput naming the element: NaN, infinity, not symmetric to 6e-6 of its axes'
  ///   standard deviations, not positive semi-definite, beyond kMaxVariance.
  [[nodiscard]] static Result<Covariance> from_matrix(const Matrix6d& matrix);

  /// @return as from_matrix(). Negative eigenvalues up to 1e-6 of the largest, as rounding to
  ///   float32 or to seven digits causes them, are raised to zero. Each axis is scaled by its own
  ///   variance, but by no less than 1e-6 of the largest variance of its unit (m² or rad²). Values
  ///   below 1e-12 of that largest variance count as rounding. So the library's own results are
  ///   usually accepted again. An exception cannot be detected here: if, over a lever, all values
  ///   of one unit are rounding errors of the other.
  [[nodiscard]] static Result<Covariance> from_upper(const Upper& upper);

  /// Independent errors along the six axes: three standard deviations [m], then three [rad].
  /// @return kInvalidInput naming the element: NaN, infinity, negative, beyond kMaxVariance.
  [[nodiscard]] static Result<Covariance> from_stddev(const std::array<double, 6>& stddev);

  /// For results of the library's own computations, which are positive semi-definite up to
  /// rounding.
  [[nodiscard]] static Covariance trusted(const Upper& upper);
  [[nodiscard]] static Covariance trusted(const Matrix6d& symmetric);

  [[nodiscard]] const Upper& upper() const { return upper_; }
  [[nodiscard]] Matrix6d matrix() const;
  /// Square roots of the diagonal: three [m], three [rad].
  [[nodiscard]] std::array<double, 6> stddev() const;

  /// Ad(X) Σ Ad(X)ᵀ: the same error expressed on the other side of X. Uses the block form of the
  /// adjoint: 243 multiplications, instead of 864 for two dense products.
  [[nodiscard]] Covariance transported(const Pose& X) const;

  Covariance& operator+=(const Covariance& other);

 private:
  Upper upper_{};
};

[[nodiscard]] TFDUDE_EXPORT Covariance operator+(Covariance a, const Covariance& b);

/// Index of element (row, column) in Covariance::Upper, row <= column.
[[nodiscard]] constexpr std::size_t upper_index(std::size_t row, std::size_t column) {
  return row * 6 - row * (row + 1) / 2 + column;
}

}  // namespace tfdude
