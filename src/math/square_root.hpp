#pragma once

#include <limits>
#include <vector>

#include "tfdude/math/belief.hpp"

// Covariances as their roots: A = L Lᵀ. A root keeps directions whose standard deviations differ by
// 1e15, a matrix only by 1e8, because its elements are variances.
namespace tfdude {

/// What is lost in a few operations, relative to the size of the numbers.
inline constexpr double kRoundingShare = 16 * std::numeric_limits<double>::epsilon();

/// L with L Lᵀ = A, with as many columns as A has rank. Cholesky with pivots, in units of each
/// axis's own deviation. What is left below rounding, or negative, counts as zero.
[[nodiscard]] Loading root_of(const Matrix6d& semidefinite);

/// L Lᵀ.
[[nodiscard]] Matrix6d square_of(const Loading& root);

/// Side by side: a root of A + B from those of A and B.
[[nodiscard]] Loading joined(const Loading& A, const Loading& B);

/// A root of the same covariance with at most six columns.
[[nodiscard]] Loading compressed(const Loading& root);

/// A root of C Cᵀ - D Dᵀ, which has no negative eigenvalue but by rounding. Each direction is
/// judged in units of C's deviation there. None becomes less than rounding of it, as zero would
/// claim to be exact.
[[nodiscard]] Loading root_of_difference(const Loading& C, const Loading& D);

using Whitening = Eigen::Matrix<double, Eigen::Dynamic, 6>;

/// S = A Aᵀ as B Bᵀ with W B = 1, so that Wᵀ W = S⁺. Rows are scaled to one before anything is
/// decomposed, so units and sizes of axes do not matter. A direction whose deviation is below the
/// rounding of the numbers that it comes from is known exactly: B and W leave it out.
class Factor {
 public:
  /// @param rounding  standard deviations [m, rad] by which rounding moves what S is the covariance
  ///   of; they are added to S
  explicit Factor(const Loading& A, const Twist& rounding = Twist::Zero());

  /// B, 6xrank.
  [[nodiscard]] const Loading& root() const { return root_; }
  /// W, rank x6.
  [[nodiscard]] const Whitening& whitening() const { return whitening_; }
  [[nodiscard]] int rank() const { return static_cast<int>(root_.cols()); }
  /// xᵀ S⁺ x.
  [[nodiscard]] double distance_squared(const Twist& x) const;
  /// Leaves out such directions, too, as those that are known exactly.
  /// @param hidden  by column of the root
  /// @param within  how much may remain in them, in addition to can_cause() [m, rad]
  void leave_out(const std::vector<bool>& hidden, const Twist& within);
  /// Whether errors with this covariance can cause the difference. In directions that are known
  /// exactly nothing may remain but a millionth of the difference (as covariances may be rounded to
  /// float32), and `tolerance`.
  [[nodiscard]] bool can_cause(const Twist& difference, const Twist& tolerance) const;

 private:
  Loading root_;
  Whitening whitening_;
  Loading exact_;  // the other directions, in scaled units
  Twist unit_;
  Twist within_ = Twist::Zero();  // of those that were left out
};

/// A root of the covariance after a measurement, L Lᵀ - L Aᵀ S⁺ A Lᵀ with A = H L and S = A Aᵀ + R
/// Rᵀ. By one orthogonal transformation, without a difference (the array form of the square-root
/// filter; Kaminski, Bryson & Schmidt 1971).
[[nodiscard]] Loading updated_root(const Loading& L, const Loading& A, const Loading& R,
                                   const Factor& S);

/// By how much rounding moves a pose whose coordinates, and those that it was computed from, are
/// this large [m].
[[nodiscard]] Twist rounding_of_pose(double reach);

/// By how much two poses may differ that are meant to be the same, as they may be written with ten
/// digits.
[[nodiscard]] Twist tolerance_of_pose(double reach);

}  // namespace tfdude
