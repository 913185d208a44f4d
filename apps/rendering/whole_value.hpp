#pragma once

#include <algorithm>

#include "tfdude/client/watch.hpp"
#include "tfdude/math/belief.hpp"

namespace tfdude {

/// A watched value with one covariance, which contains its common errors except those that `apart`
/// has, too: they are said elsewhere. Its correlation with other edges is left out.
[[nodiscard]] inline Transform whole(const WatchedValue& value, const Correlation& apart = {}) {
  const auto& said = apart.common_errors;
  Belief X{value.X_PC.pose, value.X_PC.covariance.of_specified(), {}, {}};
  for (const CommonError& error : value.correlation.common_errors) {
    if (std::count(said.begin(), said.end(), error) == 0) X.common_errors.push_back(error);
  }
  if (X.common_errors.empty()) return value.X_PC;
  X.unspecified = !value.X_PC.covariance.complete();
  return collapse(X);
}

}  // namespace tfdude
