#pragma once

#include <optional>

#include "tfdude/types/correlation.hpp"

#include "tree/sample.hpp"

namespace tfdude {

/// The value of an edge at an instant, and how its error is correlated with others.
struct CorrelatedValue {
  Transform X_PC;
  Correlation correlation;
};

/// The value with all of its covariance, except for the common errors in `said`. This is what
/// remains of a value whose other common errors are left out.
[[nodiscard]] Transform whole(const Transform& X_PC, const Correlation& now,
                              const Correlation* said);
/// Of a sample. @param said  of its edge; null: nothing
[[nodiscard]] Transform whole(const Sample& sample, const Correlation* said);

/// The random walk of the error of an edge that drifts, over some time.
struct Walk {
  const Covariance& density;  ///< per second
  double seconds;             ///< not negative
};

/// A sample of an edge that drifts, some time after another one: its error is that of the other,
/// and what the drift has added (random_walk.hpp).
/// @param G_PC  the pose as it was given
/// @param walk  from the other to this one
[[nodiscard]] CorrelatedValue drifted(const Sample& before, const Correlation* said,
                                      const Pose& G_PC, const Walk& walk);
/// The same of a value. @param increment  the way since, as it was given
[[nodiscard]] CorrelatedValue drifted(const Transform& X_PC, const Correlation* correlation,
                                      const Pose& increment, const Walk& walk);

/// The value of an edge that drifts, between two samples: that of the first one, and what the drift
/// has added since. If an observation has corrected the second sample, but not the first, a bound:
/// that of interpolate_observed(). The pose then leads from one to the other, without a jump.
/// @param walk  from the first sample to the second
[[nodiscard]] CorrelatedValue drifted_between(const Sample& before, const Sample& after, double s,
                                              const Correlation* said, const Walk& walk);

/// Whether a value that a watcher is told of an edge that drifts follows from the sample before: no
/// observation has corrected it alone.
[[nodiscard]] bool follows(const Sample& before, const Correlation* said, const Transform& X_PC,
                           const Correlation& correlation);

/// Of a sample, as it was before all observations.
[[nodiscard]] Transform given(const Sample& sample);

/// Whether an observation has correlated the sample with others.
[[nodiscard]] inline bool is_correlated(const Sample& sample) {
  const SharedRevision* revision = sample.revision();
  return revision != nullptr && !revision->correlation().empty();
}

/// Whether it is of an observation between two samples, and none was given for its stamp.
[[nodiscard]] inline bool is_between(const Sample& sample) {
  const SharedRevision* revision = sample.revision();
  return revision != nullptr && revision->row.between;
}

/// How the error of a sample is correlated: as `said` of its edge, unless it was observed.
[[nodiscard]] const Correlation* correlation_at(const Sample& sample, const Correlation* said);

/// As interpolate() of two samples, at least one of which was observed. Common errors count by the
/// share that each sample has in the value (interpolate.hpp), all else is own.
/// @param walk  of an edge that drifts, from `before` to `after`: by what it may deviate is added
[[nodiscard]] CorrelatedValue interpolate_observed(const Sample& before, const Sample& after,
                                                   double s, const Correlation* said,
                                                   const Walk* walk = nullptr);

/// By what the error of `after` counts there: the value's error is that much of it, and much of
/// that of `before`.
[[nodiscard]] Matrix6d share_of_after(const Sample& before, const Sample& after, double s);

/// As extrapolate() of two samples. An observation does not change the twist, which is that of the
/// samples as given: the correction is an offset, and stays. Common errors that are said of the
/// edge may differ from sample to sample, as own parts may, and grow as those do.
/// @param X1  the value of `after`
/// @param walk  of an edge that drifts, from `after` on: it is added. Its samples tell exactly how
///   it has moved, apart from that. Null for other edges.
[[nodiscard]] CorrelatedValue extrapolate_correlated(const Sample& before, const Sample& after,
                                                     const Transform& X1, double s,
                                                     const Correlation* said, const Walk* walk);

}  // namespace tfdude
