#pragma once

#include <cstdint>
#include <utility>

#include "tree/frames.hpp"

namespace tfdude {

/// Where a walk writes its result: the transform, and its correlation if there is any.
struct Output {
  Transform& X;
  PathCorrelation& correlation;
};

/// Computes the pose between the frames at the two ends of a path, by a walk from both ends to
/// their common ancestor. Stateless; the caller holds an epoch::Guard.
class PathLookup {
 public:
  /// @param clock  tells how long ago that was for which an edge has no data; may be null
  PathLookup(const Frames& frames, const Forest::Clock& clock) : frames_(frames), clock_(clock) {}

  /// Whether absent frames end the climb, or may be passed: on a part of a path.
  enum class Absent { kEnds, kMayPass };

  /// What a walk has found.
  struct Met {
    /// The dynamic edge whose newest sample is the oldest; null if none is dynamic.
    const HeldVersion* limiting = nullptr;
    bool moving = false;
    /// An edge is correlated: a Transform does not suffice, and none is returned.
    bool correlated = false;
  };

  /// An instant of a lookup.
  struct Instant {
    std::int64_t t;
    /// The latest common time: edges that had no sample yet have their first value.
    bool common = false;
  };

  /// X_AB at the newest instant common to all dynamic edges: that of the newest sample of
  /// Met::limiting.
  [[nodiscard]] static Result<void> reach_newest(const Ends& ends, Absent absent, Order order,
                                                 Met& met, Output X_AB);
  /// X_AB at an instant. An error of these two for which an edge has no data has no text; see
  /// explained().
  [[nodiscard]] static Result<void> reach_at(const Ends& ends, Absent absent, const Instant& at,
                                             const Query& query, Met& met, Output X_AB);

  /// Name is an id or a handle. Takes its own guard.
  template <class Name>
  [[nodiscard]] Result<Pose> look_up_pose(Name a, Name b) const {
    return computed<Pose>([&](Pose& X_AB) { return compute(a, b, X_AB); });
  }
  template <class Name>
  [[nodiscard]] Result<StampedTransform> look_up(Name a, Name b, const Query& query) const {
    return computed<StampedTransform>(
        [&](StampedTransform& X_AB) { return compute(a, b, query, X_AB); });
  }

 private:
  // Results are computed where the caller will have them: a copy would have to wait for what has
  // just been written.
  template <class Value, class Compute>
  [[nodiscard]] static Result<Value> computed(Compute compute) {
    Result<Value> X_AB;
    if (auto ok = compute(*X_AB); !ok) X_AB = tl::unexpected(std::move(ok.error()));
    return X_AB;
  }
  template <class Name>
  [[nodiscard]] Result<void> compute(Name a, Name b, Pose& X_AB) const;
  template <class Name>
  [[nodiscard]] Result<void> compute(Name a, Name b, const Query& query,
                                     StampedTransform& X_AB) const;

  [[nodiscard]] tl::unexpected<Error> explain(Error&& error, const Ends& ends,
                                              const Query& query) const;

  const Frames& frames_;
  const Forest::Clock& clock_;
};

}  // namespace tfdude
