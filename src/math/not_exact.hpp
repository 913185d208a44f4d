#pragma once

#include <vector>

#include "math/joint_prior.hpp"

namespace tfdude {

/// A root of the covariance of a measurement that is nowhere so small that what it leaves of a path
/// is lost in the rounding of the edges' errors, which cancel there. Each further measurement would
/// take that rounding for what is left, and grow it.
///
/// - A deviation is no less than a small part of what cancels (JointPrior::least_on_path()).
/// - One that is exact beside others of its unit that are not, as of a planar sensor that says zero
///   for what it does not measure, becomes 0.0003 of the least of these.
/// @param root  6xk [m, rad]
/// @param H  of each edge, as of linearize(); zero beside the path
/// @param of_all  see JointPrior::least_on_path()
[[nodiscard]] Loading not_exact(const Loading& root, const JointPrior& prior,
                                const std::vector<Matrix6d>& H, bool of_all);

}  // namespace tfdude
