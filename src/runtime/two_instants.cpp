#include "runtime/two_instants.hpp"

#include <algorithm>
#include <utility>
#include <vector>

#include "tfdude/base/id.hpp"

#include "calls/two_reads_task.hpp"
#include "tree/over_fixed.hpp"

namespace tfdude {
namespace {

// How often what was looked up may have changed until the edges were read.
constexpr int kMostTries = 10;

// Of the first read, to A, or the second one, to B.
std::vector<EdgeFromFixed> edges_of(const TwoReadsTask& task, std::size_t read) {
  std::vector<EdgeFromFixed> edges;
  const ObservedPath& path = task.path(read);
  const auto& planned = task.planned(read).edges;
  for (std::size_t i = 0; i < planned.size(); ++i) {
    const std::string& id = planned[i].info.id;
    edges.push_back({id, path.edges[i].X_PC, planned[i].way == ObservedEdge::Way::kUp,
                     is_moving(id, path.correlations[i]), is_drifting(id, path.correlations[i])});
  }
  return edges;
}

// Whether the pose is that of the edges, up to rounding.
bool is_of(const Pose& X, const std::vector<EdgeFromFixed>& edges) {
  constexpr double kSame = 1e-6;
  constexpr double kRounding = 1e-12;
  Pose along;
  double longest = 0;
  for (const EdgeFromFixed& edge : edges) {
    along = along * (edge.up ? edge.X_PC.pose.inverse() : edge.X_PC.pose);
    longest = std::max(longest, along.translation().norm());
  }
  return (X.translation() - along.translation()).norm() <= kSame + kRounding * longest &&
         X.rotation().angularDistance(along.rotation()) <= kSame;
}

}  // namespace

Result<StampedTransform> TwoInstants::lookup(const std::string& a, const Query& at_a,
                                             const std::string& b, const Query& at_b,
                                             const std::string& fixed, const Deadline& deadline) {
  for (int i = 0; i < kMostTries; ++i) {
    const auto X_FA = lookups_.lookup<std::string_view>(fixed, a, at_a, deadline);
    if (!X_FA) return tl::unexpected(X_FA.error());
    const auto X_FB = lookups_.lookup<std::string_view>(fixed, b, at_b, deadline);
    if (!X_FB) return tl::unexpected(X_FB.error());
    if (a == fixed || b == fixed) return over_fixed(*X_FA, *X_FB, {}, {}, at_b.order);
    Query then_a = at_a;
    Query then_b = at_b;
    then_a.at = X_FA->stamp;
    then_b.at = X_FB->stamp;
    TwoReadsTask task(structure_.forest, {fixed, a, then_a}, {fixed, b, then_b}, false);
    if (auto asked = requests_.run(task, deadline); !asked) return tl::unexpected(asked.error());
    auto to_a = edges_of(task, 0);
    auto to_b = edges_of(task, 1);
    // So both are of the state of the edges.
    if (!is_of(X_FA->pose, to_a) || !is_of(X_FB->pose, to_b)) continue;
    return over_fixed(*X_FA, *X_FB, std::move(to_a), std::move(to_b), at_b.order);
  }
  return fail(Errc::kChangedMeanwhile, "edges between " + quote(fixed) + " and " + quote(a) +
                                           " or " + quote(b) + " are changed all the time");
}

}  // namespace tfdude
