#pragma once

#include <functional>
#include <string>

#include "tfdude/math/transform.hpp"

#include "support/random.hpp"

// Samples of errors, and linear algebra that takes the compiler seconds wherever it is used; so it
// is compiled only once.
namespace tfdude::testing {

/// Of a symmetric matrix, ascending.
[[nodiscard]] Eigen::VectorXd eigenvalues(const Eigen::MatrixXd& symmetric);

/// Of claimed variances to right ones in all directions, ascending: eigenvalues of the pair. The
/// right ones are positive.
[[nodiscard]] Twist ratios(const Matrix6d& claimed, const Matrix6d& right);

/// L with L Lᵀ = A.
[[nodiscard]] Matrix6d cholesky_root(const Matrix6d& positive);

[[nodiscard]] Matrix6d inverse_of(const Matrix6d& matrix);

/// Uniform over all orthogonal matrices.
[[nodiscard]] Matrix6d random_orthogonal(Random& random);

/// ξᵀ Σ⁻¹ ξ.
[[nodiscard]] double squared_distance(const Twist& error, const Matrix6d& sigma);

/// ξ ~ N(0, Σ), also where Σ is singular.
class Gaussian {
 public:
  explicit Gaussian(const Eigen::MatrixXd& covariance);
  explicit Gaussian(const StatedCovariance& covariance)
      : Gaussian(Eigen::MatrixXd(covariance.of_specified().matrix())) {}

  [[nodiscard]] Eigen::VectorXd operator()(Random& random) const;

 private:
  Eigen::MatrixXd root_;
};

/// E[ξ ξᵀ] over samples of ξ.
[[nodiscard]] Matrix6d second_moment(int samples, const std::function<Twist()>& sample);

/// Empty if a second moment over so many samples of a Gaussian agrees with Σ in every element,
/// within five standard errors √((σii σjj + σij²) / N) (Isserlis) and `more` of √(σii σjj).
[[nodiscard]] std::string moment_diff(const Matrix6d& sampled, const Matrix6d& sigma, int samples,
                                      double more = 0);

/// The smallest eigenvalue of Σ - sampled, in units of Σ's own axes. Negative: Σ is too small.
[[nodiscard]] double domination(const Matrix6d& sigma, const Matrix6d& sampled);

}  // namespace tfdude::testing
