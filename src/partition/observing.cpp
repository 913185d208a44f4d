#include "partition/observing.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <string_view>
#include <unordered_set>
#include <utility>

#include "tfdude/base/id.hpp"

#include "base/stamp.hpp"
#include "math/instant_sources.hpp"
#include "math/observe_beside.hpp"

namespace tfdude {
namespace {

using Edge = ObservePlan::Edge;
using Way = ObservedEdge::Way;

bool has(const std::vector<Edge>& edges, const std::string& id) {
  return std::any_of(edges.begin(), edges.end(),
                     [&](const Edge& edge) { return edge.info.id == id; });
}

std::vector<Edge> along(std::vector<FrameInfo> path, const std::string& a) {
  std::vector<Edge> edges;
  std::string here = a;
  for (FrameInfo& edge : path) {
    const bool down = edge.parent == here;
    here = down ? edge.id : edge.parent;
    edges.push_back({std::move(edge), down ? Way::kDown : Way::kUp});
  }
  return edges;
}

// Adds the edge to the part that asks its owner, and to the plan.
Result<void> place(const Directory& directory, Edge edge, std::optional<Time> stamp,
                   ObservePlan& plan) {
  const bool beside = edge.way == Way::kBeside;
  const auto first = plan.parts.begin() + static_cast<std::ptrdiff_t>(beside ? plan.path_parts : 0);
  auto part = std::find_if(first, plan.parts.end(),
                           [&](const Part& one) { return one.owner == edge.info.owner; });
  if (part == plan.parts.end()) {
    LookupRequest request;
    if (!beside) request.query.at = stamp;
    request.edges = true;
    if (beside) request.rows = Rows::kAll;
    auto fresh = route_to(directory, edge.info.owner, Request{0, edge.info.id, std::move(request)});
    if (!fresh) return tl::unexpected(std::move(fresh.error()));
    plan.parts.push_back(*std::move(fresh));
    part = std::prev(plan.parts.end());
  }
  auto& segments = std::get<LookupRequest>(part->request.body).segments;
  edge.part = static_cast<std::size_t>(part - plan.parts.begin());
  edge.index = segments.size();
  segments.push_back({edge.info.parent, edge.info.id});
  plan.edges.push_back(std::move(edge));
  return {};
}

// Adds the edges that this one was observed with, but that do not depend on the source of that. One
// that is listed twice has been waited for before.
void add_lacking(const ObservePlan& plan, std::size_t edge, ObservedPath& path) {
  const auto add_once = [](const std::string& one, std::vector<std::string>& all) {
    if (std::count(all.begin(), all.end(), one) == 0) all.push_back(one);
  };
  const auto& own = path.edges[edge].X_PC.common_errors;
  const auto& with = path.correlations[edge].observed_with;
  const auto source = std::find_if(own.begin(), own.end(), [](const CommonError& one) {
    return is_observed(one) && said_source(one.source).empty();
  });
  if (source == own.end() || is_moving(plan.edges[edge].info.id, path.correlations[edge])) return;
  // One that drifts may have it at another instant only.
  const auto depends = [&](std::size_t k) {
    for (std::size_t row = 0; row < path.rows.size(); ++row) {
      const auto& common_errors = path.edges[row].X_PC.common_errors;
      const auto same = [&](const CommonError& one) { return one.source == source->source; };
      if (path.rows[row].edge == k &&
          std::any_of(common_errors.begin(), common_errors.end(), same)) {
        return true;
      }
    }
    return false;
  };
  for (std::size_t k = 0; k < plan.edges.size(); ++k) {
    const std::string& id = plan.edges[k].info.id;
    if (std::count(with.begin(), with.end(), id) != 1 || depends(k)) continue;
    if (is_moving(id, path.correlations[k]) && !is_drifting(id, path.correlations[k])) continue;
    add_once(id, path.lacking);
    add_once(source->source, path.lacking_sources);
  }
}

bool was_observed(const Belief& X) {
  return std::any_of(X.common_errors.begin(), X.common_errors.end(), is_observed);
}

// An edge beside the path is corrected at the instants at which it was observed, not at its newest.
void add_rows(const std::vector<RowOfSample>& rows, const Edge& edge, std::size_t k,
              ObservedPath& path) {
  bool first = edge.way == Way::kBeside;
  for (const RowOfSample& row : rows) {
    if (row.segment != edge.index) continue;
    const Belief X_PC = belief_of(row.X_PC, row.correlation);
    if (first) {
      path.edges[k].X_PC = X_PC;
      path.rows[k].stamp = row.stamp;
    } else {
      path.edges.push_back({X_PC, Way::kBeside});
      path.correlations.push_back({row.correlation.unknown, {}, row.correlation.observed_with});
      path.rows.push_back({k, row.stamp});
    }
    first = false;
  }
}

// Whether the edge was observed on the path before all instants that are kept of it.
bool precedes_rows(const ObservedEdge& edge) {
  return edge.way != Way::kBeside && edge.X_PC.unknown && was_observed(edge.X_PC);
}

// Whether it is not known any more how a static edge is correlated with others, as it was observed
// with too many. It lists itself alone.
bool was_forgotten(const std::string& id, const ObservedEdge& edge,
                   const PathCorrelation& correlation) {
  const auto& with = correlation.observed_with;
  return edge.X_PC.unknown && !was_observed(edge.X_PC) && with.size() == 1 && with.front() == id;
}

// The same of a dynamic edge is a matter of the present sample.
void keep_forgotten(const std::string& id, bool moving, Revision& revision) {
  if (moving) revision.correlation.unknown = false;
  if (revision.correlation.unknown) revision.correlation.observed_with = {id};
}

void widen(Belief& X, double by) {
  X.own = Covariance::trusted(Matrix6d(by * X.own.matrix()));
  if (X.unknown) X.unknown = Covariance::trusted(Matrix6d(by * X.unknown->matrix()));
  for (CommonError& one : X.common_errors) one.loading *= std::sqrt(by);
}

// The request of the edge's owner, in which all its edges are revised at once; another one if it
// has dynamic edges at another instant.
ReviseRequest& revision_of(const ObservePlan& plan, const ObservedPath& path, std::size_t edge,
                           std::vector<Part>& parts) {
  const Part& asked = plan.parts[plan.edges[edge].part];
  const ObservedPath::Seen& seen = path.seen[plan.edges[edge].part];
  const std::string& id = plan.edges[edge].info.id;
  const auto stamp = is_moving(id, path.correlations[edge]) ? seen.stamp : std::nullopt;
  for (Part& part : parts) {
    auto& request = std::get<ReviseRequest>(part.request.body);
    if (part.owner != asked.owner || (stamp && request.stamp && stamp != request.stamp)) continue;
    if (stamp) request.stamp = stamp;
    request.seen = std::min(request.seen, seen.commit);
    return request;
  }
  Part& part = parts.emplace_back(asked);
  part.request.id = id;  // an owner's filter checks it
  part.request.body = ReviseRequest{{}, stamp, seen.commit, seen.incarnation};
  return std::get<ReviseRequest>(part.request.body);
}

const Edge& edge_of(const ObservePlan& plan, const std::string& id) {
  return *std::find_if(plan.edges.begin(), plan.edges.end(),
                       [&](const Edge& edge) { return edge.info.id == id; });
}

// An owner stores one part beside the common errors. One that is known to be independent may have
// become part of what is not.
Covariance stored_part(const Belief& X) {
  if (!X.unknown) return X.own;
  return X.own.matrix().isZero(0) ? *X.unknown : bound(*X.unknown, X.own);
}

// Whether an owner has what a revision has made of an edge, up to the rounding of a lookup. Sources
// have names that no other observation uses.
bool is_same(const Belief& X, const Revision& revision) {
  constexpr double kRounding = 1e-9;
  const auto same_source = [](const CommonError& a, const CommonError& b) {
    return a.source == b.source && a.subtracts == b.subtracts;
  };
  const auto& ours = revision.correlation.common_errors;
  const auto& theirs = X.common_errors;
  const Pose difference = X.pose.inverse() * revision.X_PC.pose;
  const Matrix6d own = stored_part(X).matrix();
  const Matrix6d revised = revision.X_PC.covariance.of_specified().matrix();
  return std::equal(ours.begin(), ours.end(), theirs.begin(), theirs.end(), same_source) &&
         log(difference).norm() <= kRounding * (1 + X.pose.translation().norm()) &&
         (own - revised).norm() <= kRounding * revised.norm();
}

// What an owner has now of the edge of a revision, that it was asked for as segment i.
std::optional<Belief> present_belief(const SegmentValues& present, std::size_t i,
                                     const Revision& revision) {
  if (!revision.stamp) return belief_of(present.values[i], present.correlations[i]);
  for (const RowOfSample& row : present.rows) {
    if (row.segment == i && row.stamp == revision.stamp)
      return belief_of(row.X_PC, row.correlation);
  }
  return std::nullopt;
}

// The row of the path that a revision has corrected.
std::size_t row_of(const ObservePlan& plan, const ObservedPath& path, const Revision& revision) {
  const auto found =
      std::find_if(path.rows.begin(), path.rows.end(), [&](const ObservedPath::Row& row) {
        return plan.edges[row.edge].info.id == revision.id && row.stamp == revision.stamp;
      });
  return static_cast<std::size_t>(found - path.rows.begin());
}

// What a row of the path was before. It may have got a sample by now.
Revision as_it_was(const ObservePlan& plan, const ObservedPath& path, const std::string& id,
                   std::size_t k) {
  Belief X = path.edges[k].X_PC;
  if (const auto at = instant_of(plan, path, k)) store_between(*at, X.common_errors);
  Revision revision{id,
                    {X.pose, stored_part(X)},
                    {X.unknown.has_value(), X.common_errors, path.correlations[k].observed_with},
                    path.rows[k].stamp};
  revision.X_PC.covariance.set_complete(!X.unspecified);
  return revision;
}

// The correlation that an owner stores for an observed edge. It never lists the edge itself twice,
// which is how a dynamic one is marked.
Correlation correlation_of(const std::string& id, const Belief& X,
                           const std::vector<std::string>& together) {
  Correlation correlation;
  correlation.unknown = X.unknown.has_value();
  correlation.common_errors = X.common_errors;
  if (!was_observed(X)) return correlation;
  auto& with = correlation.observed_with = together;
  const auto own = std::find(with.begin(), with.end(), id);
  if (own != with.end()) with.erase(std::remove(own + 1, with.end(), id), with.end());
  return correlation;
}

}  // namespace

Result<ObservePlan> route_observe(const Forest& forest, const Directory& directory,
                                  const std::string& a, const std::string& b,
                                  const std::vector<std::string>& beside,
                                  std::optional<Time> stamp) {
  if (auto ok = check_stamp(stamp); !ok) return tl::unexpected(std::move(ok.error()));
  auto path = forest.edges(a, b);
  if (!path) return tl::unexpected(std::move(path.error()));
  if (path->empty()) {
    return fail(Errc::kInvalidInput, "there is no edge between " + quote(a) + " and itself");
  }
  if (path->size() > kMaxCorrelated) {
    return fail(Errc::kInvalidInput, "the path from " + quote(a) + " to " + quote(b) + " has " +
                                         std::to_string(path->size()) + " edges; at most " +
                                         std::to_string(kMaxCorrelated) +
                                         " can be observed at once");
  }
  ObservePlan plan;
  for (Edge& edge : along(*std::move(path), a)) {
    auto ok = place(directory, std::move(edge), stamp, plan);
    if (!ok) return tl::unexpected(std::move(ok.error()));
  }
  plan.path_parts = plan.parts.size();
  for (const std::string& id : beside) {
    if (plan.edges.size() == kMaxCorrelated) break;
    auto info = forest.info(id);
    // One whose owner cannot be asked keeps its value: the others are corrected without it.
    if (info && !has(plan.edges, id)) {
      (void)place(directory, {*std::move(info), Way::kBeside}, stamp, plan);
    }
  }
  return plan;
}

std::vector<std::string> ObservePlan::beside(std::size_t part) const {
  std::vector<std::string> ids;
  for (const Edge& edge : edges) {
    if (edge.part == part && edge.way == Way::kBeside) ids.push_back(edge.info.id);
  }
  return ids;
}

Result<ObservedPath> observed_path(const ObservePlan& plan,
                                   const std::vector<SegmentValues>& answers) {
  ObservedPath path;
  for (std::size_t i = 0; i < plan.parts.size(); ++i) {
    const auto& asked = std::get<LookupRequest>(plan.parts[i].request.body).segments;
    const bool all = i < answers.size() && answers[i].values.size() == asked.size() &&
                     answers[i].correlations.size() == asked.size();
    if (!all) {
      return fail(Errc::kNotOwner, "partition " + quote(plan.parts[i].partition) +
                                       " did not answer of all edges that it was asked for");
    }
    path.seen.push_back({answers[i].commit, answers[i].incarnation, answers[i].stamp});
    if (i < plan.path_parts && answers[i].stamp) path.stamp = answers[i].stamp;
  }
  std::unordered_set<std::string_view> known;
  for (const Edge& edge : plan.edges) known.insert(edge.info.id);
  for (const Edge& edge : plan.edges) {
    const PathCorrelation& correlation = answers[edge.part].correlations[edge.index];
    path.edges.push_back({belief_of(answers[edge.part].values[edge.index], correlation), edge.way});
    path.correlations.push_back({correlation.unknown, {}, correlation.observed_with});
    for (const std::string& id : correlation.observed_with) {
      if (known.insert(id).second) path.missing.push_back(id);
    }
  }
  for (std::size_t k = 0; k < plan.edges.size(); ++k) path.rows.push_back({k, {}});
  for (std::size_t k = 0; k < plan.edges.size(); ++k) {
    add_rows(answers[plan.edges[k].part].rows, plan.edges[k], k, path);
  }
  for (std::size_t k = 0; k < plan.edges.size(); ++k) add_lacking(plan, k, path);
  return path;
}

std::optional<Time> instant_of(const ObservePlan& plan, const ObservedPath& path, std::size_t row) {
  const auto& [k, stamp] = path.rows[row];
  const ObservePlan::Edge& edge = plan.edges[k];
  const PathCorrelation& correlation = path.correlations[k];
  if (!is_moving(edge.info.id, correlation) || is_drifting(edge.info.id, correlation)) {
    return std::nullopt;
  }
  if (stamp) return stamp;
  return edge.way == Way::kBeside ? path.seen[edge.part].stamp : path.stamp;
}

void loosen(const ObservePlan& plan, std::vector<ObservedEdge>& edges) {
  constexpr double kMore = 0.01;
  const auto is_unspecified = [](const ObservedEdge& edge) {
    return edge.way != Way::kBeside && edge.X_PC.unspecified;
  };
  if (std::none_of(edges.begin(), edges.end(), is_unspecified)) return;
  for (std::size_t k = 0; k < plan.edges.size(); ++k) {
    if (!precedes_rows(edges[k])) continue;
    for (ObservedEdge& edge : edges) widen(edge.X_PC, 1 + kMore);
    Belief& X = edges[k].X_PC;
    X.own = Covariance::trusted(Matrix6d((1 + 1 / kMore) * X.unknown->matrix()));
    X.unknown.reset();
  }
}

void determine_forgotten(const ObservePlan& plan, const ObservedPath& path, const Transform& Z_AB,
                         std::vector<ObservedEdge>& edges) {
  std::optional<std::size_t> forgotten;
  for (std::size_t k = 0; k < plan.edges.size(); ++k) {
    if (edges[k].way == Way::kBeside) continue;
    if (edges[k].X_PC.unspecified) return;
    if (!edges[k].X_PC.unknown) continue;
    if (forgotten || !was_forgotten(plan.edges[k].info.id, edges[k], path.correlations[k])) return;
    forgotten = k;
  }
  if (!forgotten || !is_better_anew(edges, *forgotten, Z_AB)) return;
  edges[*forgotten].X_PC.unspecified = true;
  edges[*forgotten].X_PC.unknown.reset();
}

std::vector<Part> revisions(const ObservePlan& plan, const ObservedPath& path,
                            const Observation& observation,
                            const std::vector<std::string>& absent) {
  std::vector<std::string> together;
  for (std::size_t k = 0; k < observation.edges.size(); ++k) {
    const auto& [X_PC, corrected, forgotten, innovation] = observation.edges[k];
    const std::string& id = plan.edges[path.rows[k].edge].info.id;
    const bool listed = path.rows[k].edge != k && std::count(together.begin(), together.end(), id);
    if (corrected && !forgotten && !listed) together.push_back(id);
  }
  const bool none = observation.accepted && together.empty();
  const auto keep = [&](const std::string& id) {
    if (together.size() < kMaxCorrelated) together.push_back(id);
  };
  for (const std::string& id : absent) keep(id);
  for (const std::string& id : path.lacking) {
    // Twice: the next observer does not wait for it again, but corrects it if it has come.
    const bool listed = std::count(together.begin(), together.end(), id) > 0;
    for (int i = listed ? 1 : 0; i < 2; ++i) keep(id);
  }
  std::vector<Part> parts;
  for (std::size_t k = 0; k < observation.edges.size(); ++k) {
    const ObservedResult& result = observation.edges[k];
    const ObservedPath::Row& row = path.rows[k];
    // Nothing was gained, but its owner learns that it is observed at earlier instants.
    const bool keeps = none && precedes_rows(path.edges[row.edge]);
    if (!result.corrected && !keeps && !(result.innovation.expected > 0)) continue;
    const Edge& observed = plan.edges[row.edge];
    ReviseRequest::Edge edge{observed.info.id, result.innovation, !observation.accepted, {}};
    if (keeps && !result.corrected) {
      edge.revision = as_it_was(plan, path, edge.id, k);
    } else if (result.corrected) {
      const Belief& X = result.X_PC;
      edge.revision = Revision{
          edge.id, {X.pose, stored_part(X)}, correlation_of(edge.id, X, together), row.stamp};
      edge.revision->X_PC.covariance.set_complete(!X.unspecified);
      if (result.forgotten) {
        keep_forgotten(edge.id, is_moving(edge.id, path.correlations[k]), *edge.revision);
      }
    }
    revision_of(plan, path, row.edge, parts).edges.push_back(std::move(edge));
  }
  return parts;
}

Part present_values(const ObservePlan& plan, const Part& revised) {
  const auto& revise = std::get<ReviseRequest>(revised.request.body);
  LookupRequest request;
  request.query.at = revise.stamp;
  request.edges = true;
  request.rows = Rows::kAll;
  Part part = revised;
  for (const ReviseRequest::Edge& edge : revise.edges) {
    if (edge.revision) request.segments.push_back({edge_of(plan, edge.id).info.parent, edge.id});
  }
  part.request.body = std::move(request);
  return part;
}

std::optional<Part> taken_back(const ObservePlan& plan, const ObservedPath& path,
                               const Part& revised, const SegmentValues& present) {
  Part part = revised;
  auto& revise = std::get<ReviseRequest>(part.request.body);
  revise.seen = present.commit;
  auto& edges = revise.edges;
  edges.erase(std::remove_if(edges.begin(), edges.end(),
                             [](const ReviseRequest::Edge& edge) { return !edge.revision; }),
              edges.end());
  if (present.values.size() != edges.size() || present.correlations.size() != edges.size() ||
      present.incarnation != revise.incarnation) {
    return std::nullopt;
  }
  for (std::size_t i = 0; i < edges.size(); ++i) {
    Revision& revision = *edges[i].revision;
    const auto now = present_belief(present, i, revision);
    if (!now || !is_same(*now, revision)) return std::nullopt;
    revision = as_it_was(plan, path, revision.id, row_of(plan, path, revision));
    edges[i].innovation = {};
  }
  return part;
}

}  // namespace tfdude
