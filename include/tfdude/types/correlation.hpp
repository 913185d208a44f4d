#pragma once

#include <string>
#include <vector>

#include "tfdude/math/belief.hpp"

namespace tfdude {

/// How an edge's error is correlated with those of other edges. Its covariance is that of its own part.
struct Correlation {
  bool unknown = false;                    ///< that part may be correlated with anything
  std::vector<CommonError> common_errors;  ///< beside that part
  /// Edges that depend on a source that an observation has made, as this one does; see observe().
  std::vector<std::string> observed_with;

  [[nodiscard]] bool empty() const {
    return !unknown && common_errors.empty() && observed_with.empty();
  }
  friend bool operator==(const Correlation& a, const Correlation& b) {
    return a.unknown == b.unknown && a.common_errors == b.common_errors &&
           a.observed_with == b.observed_with;
  }
};

}  // namespace tfdude
