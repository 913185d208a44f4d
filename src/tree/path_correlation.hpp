#pragma once

#include <optional>
#include <string>
#include <vector>

#include "tfdude/base/time.hpp"
#include "tfdude/math/belief.hpp"
#include "tfdude/types/correlation.hpp"

namespace tfdude {

/// The stored part of an edge's correlation.
struct StoredCorrelation {
  Correlation said{};
  /// Replaces `said` until the edge's next value; set by observations.
  std::optional<Correlation> observed{};
  /// The pose of the edge's newest sample as it was given, if an observation has corrected it: an
  /// edge that drifts goes on from there.
  std::optional<Pose> given{};

  [[nodiscard]] bool empty() const { return said.empty() && !observed; }
  friend bool operator==(const StoredCorrelation& a, const StoredCorrelation& b) {
    const auto matrix = [](const StoredCorrelation& one) {
      return one.given.value_or(Pose()).matrix();
    };
    return a.said == b.said && a.observed == b.observed &&
           a.given.has_value() == b.given.has_value() && matrix(a) == matrix(b);
  }
};

/// The part of a Belief besides its pose and own part.
struct PathCorrelation {
  std::optional<Covariance> unknown;
  std::vector<CommonError> common_errors;
  /// Of a single edge, as in Correlation; otherwise empty. For a lookup of edges, a dynamic edge is
  /// listed with itself twice, before those, and one that drifts three times.
  std::vector<std::string> observed_with;

  [[nodiscard]] bool empty() const {
    return !unknown && common_errors.empty() && observed_with.empty();
  }
};

/// Whether an edge is dynamic, as a lookup of edges says.
[[nodiscard]] inline bool is_moving(const std::string& id, const PathCorrelation& correlation) {
  const auto& with = correlation.observed_with;
  return with.size() >= 2 && with[0] == id && with[1] == id;
}

/// Whether a dynamic edge drifts, as a lookup of edges says.
[[nodiscard]] inline bool is_drifting(const std::string& id, const PathCorrelation& correlation) {
  return is_moving(id, correlation) && correlation.observed_with.size() >= 3 &&
         correlation.observed_with[2] == id;
}

[[nodiscard]] Belief belief_of(const Transform& X, const PathCorrelation& correlation);

/// An edge's new value after an observation.
struct Revision {
  std::string id;
  Transform X_PC;
  Correlation correlation;
  /// Of the sample, if it is not the one that was observed: an edge that drifts is corrected at
  /// several instants.
  std::optional<Time> stamp{};
};

}  // namespace tfdude
