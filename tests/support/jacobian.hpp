#pragma once

#include <functional>

#include "tfdude/math/pose.hpp"

namespace tfdude::testing {

/// Jacobian at zero of the right perturbation of `perturbed(ξ)` with respect to that of its
/// arguments, by central differences. Of the library it uses only exp, log and the product.
[[nodiscard]] inline Matrix6d numeric_jacobian(const std::function<Pose(const Twist&)>& perturbed) {
  constexpr double kStep = 1e-4;
  const Pose X_inv = perturbed(Twist::Zero()).inverse();
  Matrix6d J;
  for (int i = 0; i < 6; ++i) {
    const Twist step = kStep * Twist::Unit(i);
    J.col(i) = (log(X_inv * perturbed(step)) - log(X_inv * perturbed(-step))) / (2.0 * kStep);
  }
  return J;
}

}  // namespace tfdude::testing
