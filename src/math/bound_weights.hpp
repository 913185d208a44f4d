#pragma once

#include <vector>

#include "tfdude/math/covariance.hpp"

namespace tfdude {

/// The factors of A and B in bound(A, B).
struct BoundWeights {
  double of_A;
  double of_B;
};
[[nodiscard]] BoundWeights bound_weights(const Covariance& A, const Covariance& B);

/// The same of any number of errors, each of any correlation with the others. What is zero has the
/// factor one.
[[nodiscard]] std::vector<double> bound_weights(const std::vector<Covariance>& all);

}  // namespace tfdude
