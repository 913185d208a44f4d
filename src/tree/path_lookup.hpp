#pragma once

#include <cstdint>

#include "tree/frames.hpp"

namespace tfdude {

/// What a walk comes to, with the correlation of what has any.
struct Reached {
  Transform X;
  PathCorrelation correlation;
};

/// Where the frames at the two ends of a path are to each other, by a walk from both to where these meet. Stateless: under
/// an epoch::Guard of the caller.
class PathLookup {
 public:
  explicit PathLookup(const Frames& frames) : frames_(frames) {}

  /// Frames that are not there end the climb, or may be passed.
  enum class Absent { kEnds, kMayPass };

  /// What a walk has met.
  struct Met {
    const HeldVersion* limiting =
        nullptr;  ///< whose newest sample is the oldest; null where none is moving
    bool moving = false;
    bool correlated = false;  ///< an edge is: a Transform is not enough, and none is given
  };

  /// X_AB at the newest instant that all moving edges have: that of the newest sample of Met::limiting.
  [[nodiscard]] static Result<Reached> reach_newest(const Ends& ends, Absent absent, Order order,
                                                    Met& met);
  /// X_AB at t.
  [[nodiscard]] static Result<Reached> reach_at(const Ends& ends, Absent absent, std::int64_t t,
                                                const Query& query, Met& met);

  /// Value is Transform, or Pose where the covariance is not asked for; Name is an id or a handle. With a guard of its own.
  template <class Value, class Name>
  [[nodiscard]] Result<Value> look_up(Name a, Name b) const;
  template <class Name>
  [[nodiscard]] Result<StampedTransform> look_up(Name a, Name b, const Query& query) const;

 private:
  /// The walk that all lookups share. `take` is handed the accumulation that an edge belongs to, and the edge, whose value it
  /// adds to that; the walk ends in an error of its.
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
