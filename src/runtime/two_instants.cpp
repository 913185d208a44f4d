#include "runtime/two_instants.hpp"

#include <utility>
#include <vector>

#include "calls/two_reads_task.hpp"
#include "tree/over_fixed.hpp"

namespace tfdude {
namespace {

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

Pose along(const std::vector<EdgeFromFixed>& edges) {
  Pose X;
  for (const EdgeFromFixed& edge : edges) {
    X = X * (edge.up ? edge.X_PC.pose.inverse() : edge.X_PC.pose);
  }
  return X;
}

}  // namespace

Result<StampedTransform> TwoInstants::lookup(const std::string& a, const Query& at_a,
                                             const std::string& b, const Query& at_b,
                                             const std::string& fixed, const Deadline& deadline) {
  auto X_FA = lookups_.lookup<std::string_view>(fixed, a, at_a, deadline);
  if (!X_FA) return tl::unexpected(X_FA.error());
  auto X_FB = lookups_.lookup<std::string_view>(fixed, b, at_b, deadline);
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
  // The edges are of one state; what was looked up may be of two.
  X_FA->pose = along(to_a);
  X_FB->pose = along(to_b);
  return over_fixed(*X_FA, *X_FB, std::move(to_a), std::move(to_b), at_b.order);
}

}  // namespace tfdude
