#pragma once

#include "tfdude/math/covariance.hpp"

namespace tfdude {

/// The factors of A and B in bound(A, B).
struct BoundWeights {
  double of_A;
  double of_B;
};
[[nodiscard]] BoundWeights bound_weights(const Covariance& A, const Covariance& B);

}  // namespace tfdude
