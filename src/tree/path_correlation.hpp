#pragma once

#include <optional>
#include <string>
#include <vector>

#include "tfdude/math/belief.hpp"
#include "tfdude/types/correlation.hpp"

namespace tfdude {

/// What of an edge's correlation outlives its process.
struct StoredCorrelation {
  Correlation said{};
  /// What observations have left, in place of that, until the edge's next value.
  std::optional<Correlation> observed{};

  [[nodiscard]] bool empty() const { return said.empty() && !observed; }
  friend bool operator==(const StoredCorrelation& a, const StoredCorrelation& b) {
    return a.said == b.said && a.observed == b.observed;
  }
};

/// What a Belief has beside its pose and own part.
struct PathCorrelation {
  std::optional<Covariance> unknown;
  std::vector<CommonError> common_errors;
  std::vector<std::string> observed_with;  ///< of a single edge, as in Correlation; else empty

  [[nodiscard]] bool empty() const {
    return !unknown && common_errors.empty() && observed_with.empty();
  }
};

[[nodiscard]] Belief belief_of(const Transform& X, const PathCorrelation& correlation);

/// An edge's new value by an observation.
struct Revision {
  std::string id;
  Transform X_PC;
  Correlation correlation;
};

}  // namespace tfdude
