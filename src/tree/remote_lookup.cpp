#include <utility>

#include "math/finite.hpp"
#include "tree/epoch.hpp"
#include "tree/forest_impl.hpp"
#include "tree/path_walk.hpp"

// Lookups over edges that others hold, in the memory of their owners.
namespace tfdude {
namespace {

// A test shows that it notices when this is left out.
#ifdef TFDUDE_WITHOUT_HORIZON
constexpr bool kAsksForHorizon = false;
#else
constexpr bool kAsksForHorizon = true;
#endif

bool finite(const Pose& X) { return is_finite(Transform{X, Covariance()}); }
bool finite(const Transform& X) { return is_finite(X); }

// Repeats what `compute` does as long as an owner overwrites meanwhile what was read: a writer at
// full speed lets one of several thousand lookups begin again.
template <class Value, class Compute>
Result<Value> computed(const RemoteEdges& others, Compute compute) {
  constexpr int kTries = 16;
  RemoteReading reading(others);
  Result<Value> X_AB;
  bool intact = false;
  for (int tries = 0; tries < kTries && !intact; ++tries) {
    reading.clear();
    if (tries > 0) X_AB = Value();
    if (Result<void> ok = compute(reading, *X_AB); !ok) {
      X_AB = tl::unexpected(std::move(ok.error()));
    }
    intact = !kAsksForHorizon || reading.intact();
  }
  // An owner has checked its values; another process may have written anything.
  if (!intact || (X_AB && reading.used() && !finite(*X_AB))) X_AB = not_readable();
  return X_AB;
}

template <class Value, class Name>
Result<Value> newest(const Frames& frames, Name a, Name b, const RemoteEdges& others) {
  const epoch::Guard guard;
  const auto found = frames.ends(a, b);
  if (!found) return tl::unexpected(found.error());
  return computed<Value>(others, [&](RemoteReading& reading, Value& X_AB) {
    return compute_newest(*found, reading, X_AB);
  });
}

template <class Name>
Result<StampedTransform> queried(const Frames& frames, Name a, Name b, const Query& query,
                                 const RemoteEdges& others) {
  const epoch::Guard guard;
  const auto found = frames.ends(a, b);
  if (!found) return tl::unexpected(found.error());
  return computed<StampedTransform>(others, [&](RemoteReading& reading, StampedTransform& X_AB) {
    return compute_queried(*found, query, reading, X_AB);
  });
}

template <class Name>
std::size_t bound(const Frames& frames, Name a, Name b, RemoteEdges& others) {
  const epoch::Guard guard;
  const auto found = frames.ends(a, b);
  if (!found) return 0;
  std::size_t count = 0;
  const Version* up = found->a;
  const Version* down = found->b;
  while (up != down) {
    const Version*& here = up->depth >= down->depth ? up : down;
    if (here->depth == 0) return 0;
    const Version* above = Frames::at(*here->above, found->commit);
    if (!here->held()) {
      if (!others.bind(*here, here->name->text, above->name->text)) return 0;
      ++count;
    }
    here = above;
  }
  return count;
}

}  // namespace

Result<Transform> Forest::lookup(std::string_view a, std::string_view b,
                                 const RemoteEdges& others) const {
  return newest<Transform>(impl_->frames_, a, b, others);
}
Result<Transform> Forest::lookup(Handle a, Handle b, const RemoteEdges& others) const {
  return newest<Transform>(impl_->frames_, a, b, others);
}
Result<Pose> Forest::lookup_pose(std::string_view a, std::string_view b,
                                 const RemoteEdges& others) const {
  return newest<Pose>(impl_->frames_, a, b, others);
}
Result<Pose> Forest::lookup_pose(Handle a, Handle b, const RemoteEdges& others) const {
  return newest<Pose>(impl_->frames_, a, b, others);
}
Result<StampedTransform> Forest::lookup(std::string_view a, std::string_view b, const Query& query,
                                        const RemoteEdges& others) const {
  return queried(impl_->frames_, a, b, query, others);
}
Result<StampedTransform> Forest::lookup(Handle a, Handle b, const Query& query,
                                        const RemoteEdges& others) const {
  return queried(impl_->frames_, a, b, query, others);
}
std::size_t Forest::bind(std::string_view a, std::string_view b, RemoteEdges& others) const {
  return bound(impl_->frames_, a, b, others);
}
std::size_t Forest::bind(Handle a, Handle b, RemoteEdges& others) const {
  return bound(impl_->frames_, a, b, others);
}

}  // namespace tfdude
