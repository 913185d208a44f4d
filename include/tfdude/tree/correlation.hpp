#pragma once

#include <optional>
#include <string>
#include <vector>

#include "tfdude/math/belief.hpp"

namespace tfdude {

/// How an edge's error hangs together with those of other edges. Its covariance is that of its own part.
struct Correlation {
  bool unknown = false;       ///< that part may be correlated with anything
  std::vector<Share> shares;  ///< beside that part
  /// Edges that observations have left shares of a source in common with; see observe().
  std::vector<std::string> observed_with;

  [[nodiscard]] bool empty() const { return !unknown && shares.empty() && observed_with.empty(); }
  friend bool operator==(const Correlation& a, const Correlation& b) {
    return a.unknown == b.unknown && a.shares == b.shares && a.observed_with == b.observed_with;
  }
};

/// What of an edge's correlation outlives its process.
struct KeptTies {
  Correlation said{};
  /// What observations have left, in place of that, until the edge's next value.
  std::optional<Correlation> observed{};

  [[nodiscard]] bool empty() const { return said.empty() && !observed; }
  friend bool operator==(const KeptTies& a, const KeptTies& b) {
    return a.said == b.said && a.observed == b.observed;
  }
};

/// What a Belief has beside its pose and own part.
struct Ties {
  std::optional<Covariance> unknown;
  std::vector<Share> shares;
  std::vector<std::string> observed_with;  ///< of a single edge, as in Correlation; else empty

  [[nodiscard]] bool empty() const { return !unknown && shares.empty() && observed_with.empty(); }
};

[[nodiscard]] Belief belief_of(const Transform& X, const Ties& ties);

/// An edge's new value by an observation.
struct Revision {
  std::string id;
  Transform X_PC;
  Correlation correlation;
};

}  // namespace tfdude
