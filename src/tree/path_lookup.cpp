#include "tree/path_lookup.hpp"

#include <utility>

#include "tree/epoch.hpp"
#include "tree/no_data.hpp"
#include "tree/path_walk.hpp"

namespace tfdude {
namespace {

// Without state, so it is always the same.
OwnEdgesOnly own_edges;  // NOLINT(*-avoid-non-const-global-variables): see above

}  // namespace

Result<void> PathLookup::reach_newest(const Ends& ends, Absent absent, Order order, Met& met,
                                      Output X_AB) {
  return tfdude::reach_newest(ends, absent, order, own_edges, met, X_AB);
}

Result<void> PathLookup::reach_at(const Ends& ends, Absent absent, const Instant& at,
                                  const Query& query, Met& met, Output X_AB) {
  return tfdude::reach_at(ends, absent, at, query, own_edges, met, X_AB);
}

// Errors are rare, and long to explain.
[[gnu::cold, gnu::noinline]] tl::unexpected<Error> PathLookup::explain(Error&& error,
                                                                       const Ends& ends,
                                                                       const Query& query) const {
  return tl::unexpected(explained(std::move(error), {ends}, query, clock_));
}

template <class Name>
Result<void> PathLookup::compute(Name a, Name b, Pose& X_AB) const {
  const epoch::Guard guard;
  const auto found = frames_.ends(a, b);
  if (!found) return tl::unexpected(found.error());
  auto newest = compute_newest(*found, own_edges, X_AB);
  if (!newest) return explain(std::move(newest.error()), *found, Query{});
  return newest;
}

template <class Name>
Result<void> PathLookup::compute(Name a, Name b, const Query& query, StampedTransform& X_AB) const {
  const epoch::Guard guard;
  const auto found = frames_.ends(a, b);
  if (!found) return tl::unexpected(found.error());
  auto then = compute_queried(*found, query, own_edges, X_AB);
  if (!then) return explain(std::move(then.error()), *found, query);
  return then;
}

// For a frame's id, and for its handle.
template Result<void> PathLookup::compute(std::string_view a, std::string_view b, Pose& X_AB) const;
template Result<void> PathLookup::compute(std::string_view a, std::string_view b,
                                          const Query& query, StampedTransform& X_AB) const;
template Result<void> PathLookup::compute(Handle a, Handle b, Pose& X_AB) const;
template Result<void> PathLookup::compute(Handle a, Handle b, const Query& query,
                                          StampedTransform& X_AB) const;

}  // namespace tfdude
