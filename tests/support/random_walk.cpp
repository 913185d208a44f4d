#include "support/random_walk.hpp"

#include "tfdude/math/perturbation.hpp"

namespace tfdude::testing {

Matrix6d adjoint_of_exp(const Twist& xi) {
  const Matrix6d ad = small_adjoint(xi);
  Matrix6d term = Matrix6d::Identity();
  Matrix6d sum = term;
  for (int k = 1; k < 40; ++k) {
    term = (term * ad / k).eval();
    sum += term;
  }
  return sum;
}

Matrix6d walked_in_steps(const Matrix6d& Q, const Twist& xi, double seconds) {
  constexpr int kSteps = 400;
  const Matrix6d half = adjoint_of_exp(Twist(-0.5 / kSteps * xi));
  const Matrix6d step = half * half;
  // By Simpson's rule.
  const Matrix6d of_step =
      seconds / kSteps / 6 * (Q + 4 * half * Q * half.transpose() + step * Q * step.transpose());
  Matrix6d sum = Matrix6d::Zero();
  for (int k = 0; k < kSteps; ++k) sum = (step * sum * step.transpose() + of_step).eval();
  return sum;
}

}  // namespace tfdude::testing
