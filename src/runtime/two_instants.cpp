#include "runtime/two_instants.hpp"

#include <vector>

#include "calls/one_state_task.hpp"
#include "tree/over_fixed.hpp"

namespace tfdude {
namespace {

// Of the first read, to A, or the second one, to B.
std::vector<EdgeFromFixed> edges_of(const OneStateTask& task, std::size_t read) {
  std::vector<EdgeFromFixed> edges;
  const ObservedPath& path = task.path(read);
  const auto& planned = task.planned(read).edges;
  for (std::size_t i = 0; i < planned.size(); ++i) {
    const std::string& id = planned[i].info.id;
    const PathCorrelation& correlation = path.correlations[i];
    edges.push_back({id, path.edges[i].X_PC, planned[i].way == ObservedEdge::Way::kUp,
                     is_moving(id, correlation), is_drifting(id, correlation),
                     is_corrected(id, correlation)});
  }
  return edges;
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
  if (X_FA->stamp) then_a.at = X_FA->stamp;
  if (X_FB->stamp) then_b.at = X_FB->stamp;
  OneStateTask task(structure_.forest, {{fixed, a, then_a}, {fixed, b, then_b}}, false);
  if (auto asked = requests_.run(task, deadline); !asked) return tl::unexpected(asked.error());
  return over_fixed(*X_FA, *X_FB, edges_of(task, 0), edges_of(task, 1), at_b.order);
}

}  // namespace tfdude
