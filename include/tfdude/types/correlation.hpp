#pragma once

#include <string>
#include <vector>

#include "tfdude/math/belief.hpp"

namespace tfdude {

/// How an edge's error is correlated with the errors of other edges. The edge's covariance
/// describes its own part only.
struct Correlation {
  bool unknown = false;                    ///< the own part may be correlated with anything
  std::vector<CommonError> common_errors;  ///< in addition to the own part
  /// Edges that share with this one a source created by an observation; see observe().
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
