#pragma once

#include <cstdint>

#include "tree/frames.hpp"

namespace tfdude {

/// The result of a walk, with its correlation if there is any.
struct Reached {
  Transform X;
  PathCorrelation correlation;
};

/// Computes the pose between the frames at the two ends of a path, by a walk from both ends to
/// their common ancestor. Stateless; the caller holds an epoch::Guard.
class PathLookup {
 public:
  explicit PathLookup(const Frames& frames) : frames_(frames) {}

  /// Whether absent frames end the climb, or may be passed.
  enum class Absent { kEnds, kMayPass };

  /// What a walk has found.
  struct Met {
    /// The dynamic edge whose newest sample is the oldest; null if none is dynamic.
    const HeldVersion* limiting = nullptr;
    bool moving = false;
    /// An edge is correlated: a Transform does not suffice, and none is returned.
    bool correlated = false;
  };

  /// X_AB at the newest instant common to all dynamic edges: that of the newest sample of
  /// Met::limiting.
  [[nodiscard]] static Result<Reached> reach_newest(const Ends& ends, Absent absent, Order order,
                                                    Met& met);
  /// X_AB at t.
  [[nodiscard]] static Result<Reached> reach_at(const Ends& ends, Absent absent, std::int64_t t,
                                                const Query& query, Met& met);

  /// Value is Transform, or Pose if no covariance is needed; Name is an id or a handle. Takes its
  /// own guard.
  template <class Value, class Name>
  [[nodiscard]] Result<Value> look_up(Name a, Name b) const;
  template <class Name>
  [[nodiscard]] Result<StampedTransform> look_up(Name a, Name b, const Query& query) const;

 private:
  /// The walk that all lookups share. `take` gets the accumulation of an edge, and the edge, whose
  /// value it adds. The walk stops at an error of `take`.
  template <class Value, class Take>
  [[nodiscard]] static Result<Value> walk(const Ends& ends, Absent absent, Order order, Take take);
  template <class Value>
  [[nodiscard]] static Result<Value> walk_newest(const Ends& ends, Absent absent, Order order,
                                                 Met& met);
  template <class Value>
  [[nodiscard]] static Result<Value> walk_at(const Ends& ends, Absent absent, std::int64_t t,
                                             const Query& query, Met& met);

  const Frames& frames_;
};

}  // namespace tfdude
