#include "tree/over_fixed.hpp"

#include <algorithm>
#include <optional>
#include <utility>

#include "math/drift.hpp"
#include "math/symmetric_eigen.hpp"

namespace tfdude {
namespace {

// The own error may be correlated with that at the other instant in any way.
void bound(Belief& X) {
  if (X.unknown || X.own.matrix().isZero(0)) return;
  X.unknown = std::exchange(X.own, {});
}

// The own error of the earlier value is a part of the later one.
void share(EdgeFromFixed& earlier, EdgeFromFixed& later, const Drift& drift) {
  Belief& X = earlier.X_PC;
  later.X_PC.own = drift.added;
  if (X.own.matrix().isZero(0)) return;
  const SymmetricEigen eigen = symmetric_eigen(X.own.matrix());
  const Loading root = eigen.vectors * eigen.values.cwiseMax(0.0).cwiseSqrt().asDiagonal();
  X.common_errors.push_back({"edge:" + earlier.id, false, root});
  later.X_PC.common_errors.push_back({"edge:" + earlier.id, false, drift.F * root});
  X.own = {};
}

// How the error of an edge at the later instant follows from that at the earlier one, if it does.
std::optional<Drift> drift_of(const EdgeFromFixed& earlier, const EdgeFromFixed& later,
                              bool same_instant) {
  if (same_instant || !(earlier.moving || later.moving)) {
    if (earlier.X_PC.unknown) return std::nullopt;
    return Drift{Matrix6d::Identity(), {}};
  }
  if (!earlier.drifts || !later.drifts) return std::nullopt;
  return drift_between(earlier.X_PC, later.X_PC);
}

Belief along(const std::vector<EdgeFromFixed>& edges, Order order) {
  Belief X;
  for (const EdgeFromFixed& edge : edges) {
    X = compose(X, edge.up ? inverse(edge.X_PC) : edge.X_PC, order);
  }
  return X;
}

}  // namespace

Result<std::vector<EdgeFromFixed>> edges_from_fixed(const Forest& forest, std::string_view fixed,
                                                    std::string_view frame, const Query& query) {
  const auto path = forest.edges(fixed, frame);
  if (!path) return tl::unexpected(path.error());
  if (path->empty()) return std::vector<EdgeFromFixed>();
  std::vector<PathEnds> segments;
  for (const FrameInfo& edge : *path) segments.push_back({edge.parent, edge.id});
  const auto found = forest.lookup_segments(segments, query, {}, true);
  if (!found) return tl::unexpected(found.error());
  std::vector<EdgeFromFixed> edges;
  std::string here(fixed);
  for (std::size_t i = 0; i < path->size(); ++i) {
    const FrameInfo& edge = (*path)[i];
    const bool up = edge.parent != here;
    here = up ? edge.parent : edge.id;
    const PathCorrelation& correlation = found->correlations[i];
    edges.push_back({edge.id, belief_of(found->values[i], correlation), up,
                     is_moving(edge.id, correlation), is_drifting(edge.id, correlation)});
  }
  return edges;
}

StampedTransform over_fixed(const StampedTransform& X_FA, const StampedTransform& X_FB,
                            std::vector<EdgeFromFixed> to_a, std::vector<EdgeFromFixed> to_b,
                            Order order) {
  StampedTransform X_AB{between(X_FA, X_FB), X_FB.stamp};
  X_AB.basis.order = order;
  std::vector<std::string>& unspecified = X_AB.basis.unspecified;
  unspecified.assign(X_FA.basis.unspecified.rbegin(), X_FA.basis.unspecified.rend());
  unspecified.insert(unspecified.end(), X_FB.basis.unspecified.begin(),
                     X_FB.basis.unspecified.end());
  const bool shares_nothing = to_a.empty() || to_b.empty();
  if (!X_AB.covariance.complete() || shares_nothing) return X_AB;
  const bool same_instant = X_FA.stamp && X_FA.stamp == X_FB.stamp;
  const bool a_is_later = X_FA.stamp && X_FB.stamp && *X_FA.stamp > *X_FB.stamp;
  for (EdgeFromFixed& one : to_a) {
    const auto same = std::find_if(to_b.begin(), to_b.end(),
                                   [&](const EdgeFromFixed& other) { return other.id == one.id; });
    if (same == to_b.end()) continue;
    EdgeFromFixed& earlier = a_is_later ? *same : one;
    EdgeFromFixed& later = a_is_later ? one : *same;
    if (const auto drift = drift_of(earlier, later, same_instant)) {
      share(earlier, later, *drift);
    } else {
      bound(one.X_PC);
      bound(same->X_PC);
    }
  }
  const Belief whole = compose(inverse(along(to_a, order)), along(to_b, order), order);
  X_AB.covariance = collapse(whole).covariance;
  X_AB.basis.bound = whole.unknown.has_value();
  return X_AB;
}

}  // namespace tfdude
