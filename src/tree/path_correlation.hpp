#pragma once

#include <algorithm>
#include <cstddef>
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
  /// listed with itself twice or more, before those (edge_marks.hpp).
  std::vector<std::string> observed_with;

  [[nodiscard]] bool empty() const {
    return !unknown && common_errors.empty() && observed_with.empty();
  }
};

/// How often a lookup of edges lists an edge with itself.
[[nodiscard]] inline std::size_t marks_of(const std::string& id, const PathCorrelation& of) {
  const auto& with = of.observed_with;
  const auto is_other = [&](const std::string& one) { return one != id; };
  return static_cast<std::size_t>(std::find_if(with.begin(), with.end(), is_other) - with.begin());
}
/// Whether an edge is dynamic, as a lookup of edges says.
[[nodiscard]] inline bool is_moving(const std::string& id, const PathCorrelation& of) {
  return marks_of(id, of) >= 2;
}
/// Whether a dynamic edge drifts.
[[nodiscard]] inline bool is_drifting(const std::string& id, const PathCorrelation& of) {
  return marks_of(id, of) >= 3;
}
/// Whether observations have corrected the value of one that drifts.
[[nodiscard]] inline bool is_corrected(const std::string& id, const PathCorrelation& of) {
  return marks_of(id, of) >= 4;
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
