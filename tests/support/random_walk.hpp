#pragma once

#include "tfdude/math/pose.hpp"

namespace tfdude::testing {

/// Ad(Exp(ξ)) by its power series.
[[nodiscard]] Matrix6d adjoint_of_exp(const Twist& xi);

/// The covariance that a random walk of density Q (per second) adds over an even motion by ξ, in
/// 400 steps: each moves along what those before it have added. Exact to 1e-9 for angles up to π.
[[nodiscard]] Matrix6d walked_in_steps(const Matrix6d& Q, const Twist& xi, double seconds);

}  // namespace tfdude::testing
