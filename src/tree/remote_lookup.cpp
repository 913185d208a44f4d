#include <utility>

#include "math/finite.hpp"
#include "tree/epoch.hpp"
#include "tree/forest_impl.hpp"
#include "tree/held_edges.hpp"
#include "tree/no_data.hpp"
#include "tree/path_walk.hpp"
#include "tree/read_intact.hpp"

// Lookups over edges that others hold, in the memory of their owners.
namespace tfdude {
namespace {

bool finite(const Pose& X) { return is_finite(Transform{X, Covariance()}); }
bool finite(const Transform& X) { return is_finite(X); }

template <class Value, class Compute>
Result<Value> computed(const RemoteEdges& others, Compute compute) {
  RemoteReading reading(others);
  Result<Value> X_AB;
  const bool intact = read_intact(reading, X_AB, compute);
  // An owner has checked its values; another process may have written anything.
  if (!intact || (X_AB && reading.used() && !finite(*X_AB))) X_AB = not_readable();
  return X_AB;
}

template <class Name>
Result<Pose> newest(const Frames& frames, Name a, Name b, const RemoteEdges& others) {
  const epoch::Guard guard;
  const auto found = frames.ends(a, b);
  if (!found) return tl::unexpected(found.error());
  return computed<Pose>(others, [&](RemoteReading& reading, Pose& X_AB) {
    return compute_newest(*found, reading, X_AB);
  });
}

template <class Name>
Result<StampedTransform> queried(const Frames& frames, Name a, Name b, const Query& query,
                                 const RemoteEdges& others) {
  // What was believed before, only owners can say.
  if (query.believed_at) return not_readable();
  const epoch::Guard guard;
  const auto found = frames.ends(a, b);
  if (!found) return tl::unexpected(found.error());
  return computed<StampedTransform>(others, [&](RemoteReading& reading, StampedTransform& X_AB) {
    return compute_queried(*found, query, reading, X_AB);
  });
}

// Whatever a reader can see of an edge has the number of a commit, and later ones are larger.
std::optional<std::uint64_t> written_on(const Ends& ends, RemoteReading& reading) {
  std::uint64_t sum = 14695981039346656037U;
  bool all = true;
  for_each_edge(ends, reading, [&](const Version& here, const auto& edge) {
    all = all && edge.version != nullptr;
    if (!all) return;
    for (const std::uint64_t number :
         {std::uint64_t{here.slot}, std::uint64_t{here.attachment}, edge.version->commit}) {
      sum = (sum ^ number) * 1099511628211U;
    }
  });
  return all ? std::optional(sum) : std::nullopt;
}

template <class Name>
std::size_t bound(const Frames& frames, Name a, Name b, RemoteEdges& others, bool former = false) {
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
      if (!others.bind(*here, here->name->text, above->name->text, former)) return 0;
      ++count;
    }
    here = above;
  }
  return count;
}

}  // namespace

Result<Pose> Forest::lookup_pose(std::string_view a, std::string_view b,
                                 const RemoteEdges& others) const {
  return newest(impl_->frames_, a, b, others);
}
Result<Pose> Forest::lookup_pose(Handle a, Handle b, const RemoteEdges& others) const {
  return newest(impl_->frames_, a, b, others);
}
Result<StampedTransform> Forest::lookup(std::string_view a, std::string_view b, const Query& query,
                                        const RemoteEdges& others) const {
  return queried(impl_->frames_, a, b, query, others);
}
Result<StampedTransform> Forest::lookup(Handle a, Handle b, const Query& query,
                                        const RemoteEdges& others) const {
  return queried(impl_->frames_, a, b, query, others);
}
std::optional<std::uint64_t> Forest::written(std::string_view a, std::string_view b,
                                             const RemoteEdges& others) const {
  const epoch::Guard guard;
  const auto ends = impl_->frames_.ends(a, b);
  if (!ends) return std::nullopt;
  RemoteReading reading(others);
  return written_on(*ends, reading);
}
Error Forest::explain(Error error, std::string_view a, std::string_view b, const Query& query,
                      const RemoteEdges& others) const {
  const epoch::Guard guard;
  const auto ends = impl_->frames_.ends(a, b);
  if (!ends) return error;
  RemoteReading reading(others);
  return tfdude::explained(std::move(error), *ends, reading, query, impl_->now_);
}
Result<StampedTransform> Forest::lookup_former(std::string_view a, std::string_view b,
                                               const RemoteEdges& others) const {
  const epoch::Guard guard;
  const auto found = impl_->frames_.ends(a, b);
  if (!found) return tl::unexpected(found.error());
  return computed<StampedTransform>(others, [&](RemoteReading& reading, StampedTransform& X_AB) {
    for_each_edge_elsewhere(*found, [&](const Version& here) { reading.go_back(here); });
    return compute_queried(*found, Query{}, reading, X_AB);
  });
}
std::size_t Forest::bind(std::string_view a, std::string_view b, RemoteEdges& others,
                         bool former) const {
  return bound(impl_->frames_, a, b, others, former);
}
std::size_t Forest::bind(Handle a, Handle b, RemoteEdges& others) const {
  return bound(impl_->frames_, a, b, others);
}

}  // namespace tfdude
