#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "tfdude/base/time.hpp"
#include "tfdude/math/transform.hpp"
#include "tfdude/types/correlation.hpp"
#include "tfdude/types/edge.hpp"

#include "math/instant_sources.hpp"

namespace tfdude {

/// How much of an edge, under this parent, a watcher has seen; initially nothing.
struct EdgeCursor {
  std::string id;
  std::string parent;
  std::uint64_t history = 0;  ///< of the values seen; 0: none
  std::uint64_t commit = 0;   ///< up to which values were seen, also in a reply
  Handle frame{};             ///< found by id if it does not exist any more
};

/// A value of one of several watched edges, with its index among them.
struct PushedValue {
  std::uint32_t index = 0;
  std::optional<Time> stamp;
  Transform X;
  /// Of the edge, only with the last of its values of which this holds; or that of a sample, if an
  /// observation has corrected it, or it is one of a composed segment (is_of_sample()).
  Correlation correlation{};
  /// The number of the history of this value. A new history, with a higher number, starts when an
  /// edge is moved, added again, or loses its samples.
  std::uint64_t history = 0;
  /// Of the edge; only with the first value reported of a history.
  std::optional<Covariance> process_noise{};
  /// With it: the edge drifts.
  bool drifts = false;
  /// Identifies the covariance among those of this edge in its group of watchers
  /// (CovarianceNumbers); 0: not numbered.
  std::uint32_t covariance_number = 0;
  /// The covariance of this number was pushed before, and X comes without it.
  bool covariance_known = false;
  /// Its owner has made up the stamp, so it tells no velocity. Only with the newest such sample.
  bool made_up = false;
  /// The history was cleared: the edge is dynamic, and has no value until its next sample.
  bool cleared = false;
  /// The edge is dynamic, and had no sample yet: the value is that of no instant.
  bool unsampled = false;
  /// Of the first value reported of a history, for who has the history of the number `continues`:
  /// what that has before this instant stays, and all from then on follows. Such a history is
  /// reported as two (join_histories()).
  std::optional<Time> kept_before{};
  std::uint64_t continues = 0;
};

/// A value of an edge that is a sample, and tells nothing else.
struct ToldSample {
  Handle frame{};
  std::int64_t stamp = 0;
  const Transform* X_PC = nullptr;
};

/// Puts such reports together: the first value of a history, after an entry that repeats the one
/// before as if it began again, goes on from that up to the entry's stamp. So it says the same to
/// those who know nothing of that.
void join_histories(std::vector<PushedValue>& values);

/// Whether two values are the same, so that one need not be told after the other.
[[nodiscard]] inline bool same(const Transform& a, const Transform& b) {
  return a.pose.matrix() == b.pose.matrix() && a.covariance == b.covariance;
}

/// Whether a value has the correlation of this sample alone. The edges that it was observed with,
/// if only itself, tell that from what is said of its edge; of a segment, earlier versions told it
/// by the sources.
[[nodiscard]] inline bool is_of_sample(const PushedValue& value) {
  const auto is_of_it = [](const CommonError& one) {
    return is_observed(one) || is_of_two_samples(one.source);
  };
  const auto& errors = value.correlation.common_errors;
  return value.stamp && (!value.correlation.observed_with.empty() ||
                         std::any_of(errors.begin(), errors.end(), is_of_it));
}

/// Values written to edges up to a commit.
struct PushedCommit {
  /// Sorted by stamp, after those without one.
  std::vector<PushedValue> values;
  std::uint64_t commit = 0;
};

/// Which samples of a dynamic edge to report.
struct PushedQuery {
  bool newest_only = false;
  /// If nothing was seen yet: start at the last sample not later than this, instead of the newest.
  std::optional<Time> from{};
  /// Report nothing while one of the edges is not held, or has another parent: without it, the
  /// others may be half of a commit.
  bool whole = false;
  /// Tell how each sample is correlated that an observation has corrected. Otherwise such a sample
  /// has all of its covariance, as a watcher of single edges needs it.
  bool of_samples = false;
};

}  // namespace tfdude
