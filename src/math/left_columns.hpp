#pragma once

#include "math/joint_prior.hpp"

// Columns of a joint covariance that observations have left.
namespace tfdude {

/// Whether a source is of such columns.
[[nodiscard]] bool is_left(const JointPrior::Source& source);

/// How many there are; zero: few, or some that subtract.
[[nodiscard]] Eigen::Index many_left_columns(const JointPrior& prior);

/// Those of all edges, 6n x count.
[[nodiscard]] Eigen::MatrixXd left_columns(const JointPrior& prior, Eigen::Index count);

}  // namespace tfdude
