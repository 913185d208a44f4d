#pragma once

#include <optional>

#include <Eigen/Core>

namespace tfdude {

/// A joint covariance of blocks of six as blockdiag(own) + F Fᵀ.
struct BlocksAndColumns {
  Eigen::MatrixXd own;  ///< 6n x 6: block under block
  Eigen::MatrixXd F;    ///< 6n x k
};

/// Writes a joint covariance P in this form by blocks on which the others depend: each gives six
/// columns, P_ih P_hh^(-1/2), and what is left, P_ij - P_ih P_hh⁻¹ P_hj, has no correlation with
/// it. If all others were only correlated through them, as are objects that one camera has seen,
/// nothing but blocks on the diagonal is left. This is a block Cholesky factorization with
/// pivoting, which ends early.
/// O(n² · columns).
/// @param P  6n x 6n
/// @param rounding  standard deviations whose products correlations are rounded to, 6n
/// @param most_columns  how many F may have
/// @return empty if they do not suffice
[[nodiscard]] std::optional<BlocksAndColumns> by_hubs(Eigen::MatrixXd P,
                                                      const Eigen::VectorXd& rounding,
                                                      Eigen::Index most_columns);

/// Columns whose sum of squares is a joint covariance, F Fᵀ = P, as many as P has rank.
/// Each row is scaled by its own deviation before. O(n³).
/// @param P  6n x 6n
[[nodiscard]] Eigen::MatrixXd root_of_joint(const Eigen::MatrixXd& P);

/// Columns with the same F Fᵀ, no more than there are rows. The error of each row is relative to
/// that row. O(n² · columns).
[[nodiscard]] Eigen::MatrixXd triangle_of_columns(const Eigen::MatrixXd& F);

}  // namespace tfdude
