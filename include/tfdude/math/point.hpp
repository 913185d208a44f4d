#pragma once

#include <vector>

#include <Eigen/Core>

#include "tfdude/base/export.hpp"
#include "tfdude/base/result.hpp"
#include "tfdude/math/belief.hpp"
#include "tfdude/math/transform.hpp"

namespace tfdude {

/// A point or a direction, expressed in a frame.
struct Point {
  Eigen::Vector3d coordinates = Eigen::Vector3d::Zero();  ///< [m], or as the direction has it
  /// Of the coordinates' own error, in their unit squared. Zero: known exactly in its frame.
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  bool direction = false;  ///< only turns, as the normal of a plane or a velocity
};

/// A point in frame A: of p_A = X_AB p_B with the errors of both.
struct TransformedPoint {
  Eigen::Vector3d coordinates = Eigen::Vector3d::Zero();  ///< the mean pose times the given point
  /// How far the mean of p_A is from `coordinates`. Angular errors bend the distribution of p_A
  /// into a bow, whose centre lies nearer to B's origin.
  Eigen::Vector3d bias = Eigen::Vector3d::Zero();
  /// Of p_A about its mean; edges with an unspecified covariance count as known exactly.
  Eigen::Matrix3d of_specified = Eigen::Matrix3d::Zero();
  bool complete = false;  ///< the transform has no unspecified covariance

  /// The covariance; null if the transform's is unspecified.
  [[nodiscard]] const Eigen::Matrix3d* covariance() const {
    return complete ? &of_specified : nullptr;
  }
};

/// Checks values from outside. @return kInvalidInput naming the element: NaN, infinity, beyond
///   kMaxTranslation or kMaxVariance, a covariance that is not symmetric or not positive
///   semi-definite.
[[nodiscard]] TFDUDE_EXPORT Result<void> check_point(const Point& p_B);

/// Transforms a point from B to A, p_A = X̄ Exp(ξ) (p_B + δ) with independent Gaussian ξ and δ.
/// The moments are those of the power series of Exp(ξ), by Isserlis' theorem, as Barfoot & Furgale
/// 2014, Section IV, has them for a camera. To second order the covariance is linear,
/// R̄ (J Σ Jᵀ + S) R̄ᵀ with J = [1, -p×]; to fourth order the next terms are added, and one of
/// sixth order that keeps it positive semi-definite. Angular errors above half a radian are beyond
/// the series: the bias is then no longer that of the mean. Takes 1 µs to second order, 2.5 µs to
/// fourth.
[[nodiscard]] TFDUDE_EXPORT TransformedPoint transform(const Transform& X_AB, const Point& p_B,
                                                       Order order = Order::kSecond);

/// The same for many points, for which the transform is prepared once: 0.3 µs for each to second
/// order, 2 µs to fourth.
[[nodiscard]] TFDUDE_EXPORT std::vector<TransformedPoint> transform(
    const Transform& X_AB, const std::vector<Point>& points_B, Order order = Order::kSecond);

/// The 3Nx3N covariance of N points transformed together: one pose moves all of them, so their
/// errors are correlated. The blocks on the diagonal are those of transform(). Unspecified
/// covariances add nothing. O(N²).
[[nodiscard]] TFDUDE_EXPORT Eigen::MatrixXd joint_covariance(const Transform& X_AB,
                                                             const std::vector<Point>& points_B,
                                                             Order order = Order::kSecond);

}  // namespace tfdude
