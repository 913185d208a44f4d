#include "partition/observing.hpp"

#include <algorithm>
#include <utility>

#include "tfdude/base/id.hpp"

#include "base/stamp.hpp"

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

// The answer that contains an edge, and its index there; edges must be visited in order.
class Places {
 public:
  explicit Places(const ObservePlan& plan) : plan_(plan), taken_(plan.parts.size(), 0) {}

  struct Place {
    std::size_t part;
    std::size_t index;
  };
  Place next(const Edge& edge) {
    const auto part = std::find_if(plan_.parts.begin(), plan_.parts.end(),
                                   [&](const Part& one) { return one.owner == edge.info.owner; });
    const auto i = static_cast<std::size_t>(part - plan_.parts.begin());
    return {i, taken_[i]++};
  }

 private:
  const ObservePlan& plan_;
  std::vector<std::size_t> taken_;
};

// Whether an edge that this one was observed with does not depend on the source.
bool lacks_source(const ObservePlan& plan, const ObservedPath& path, const Belief& X,
                  const std::vector<std::string>& observed_with) {
  const auto source = std::find_if(X.common_errors.begin(), X.common_errors.end(), is_observed);
  if (source == X.common_errors.end()) return false;
  for (std::size_t k = 0; k < plan.edges.size(); ++k) {
    const std::string& id = plan.edges[k].info.id;
    if (std::count(observed_with.begin(), observed_with.end(), id) == 0) continue;
    const auto& common_errors = path.edges[k].X_PC.common_errors;
    const auto same = [&](const CommonError& common_error) {
      return common_error.source == source->source;
    };
    if (std::none_of(common_errors.begin(), common_errors.end(), same)) return true;
  }
  return false;
}

// The correlation that an owner stores for an observed edge.
Correlation correlation_of(const Belief& X, const std::vector<std::string>& together) {
  Correlation correlation;
  correlation.unknown = X.unknown.has_value();
  correlation.common_errors = X.common_errors;
  const bool observed = std::any_of(X.common_errors.begin(), X.common_errors.end(), is_observed);
  if (observed) correlation.observed_with = together;
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
  ObservePlan plan{along(*std::move(path), a), {}};
  for (const std::string& id : beside) {
    auto info = forest.info(id);
    if (info && !has(plan.edges, id)) plan.edges.push_back({*std::move(info), Way::kBeside});
  }
  for (const auto& [info, way] : plan.edges) {
    const Owner owner = info.owner;
    auto part = std::find_if(plan.parts.begin(), plan.parts.end(),
                             [owner](const Part& one) { return one.owner == owner; });
    if (part == plan.parts.end()) {
      LookupRequest request;
      request.query.at = stamp;
      request.edges = true;
      auto fresh = route_to(directory, owner, Request{0, info.id, std::move(request)});
      if (!fresh) return tl::unexpected(std::move(fresh.error()));
      plan.parts.push_back(*std::move(fresh));
      part = std::prev(plan.parts.end());
    }
    std::get<LookupRequest>(part->request.body).segments.push_back({info.parent, info.id});
  }
  if (plan.edges.size() <= kMaxCorrelated) return plan;
  return fail(Errc::kInvalidInput, "the path from " + quote(a) + " to " + quote(b) +
                                       " and the edges observed with it earlier are " +
                                       std::to_string(plan.edges.size()) + " edges; at most " +
                                       std::to_string(kMaxCorrelated) + " can be observed at once");
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
    path.seen.push_back({answers[i].commit, answers[i].incarnation});
    if (answers[i].stamp) path.stamp = answers[i].stamp;
  }
  Places places(plan);
  std::vector<Places::Place> placed;
  for (const Edge& edge : plan.edges) {
    const auto [part, index] = placed.emplace_back(places.next(edge));
    const PathCorrelation& correlation = answers[part].correlations[index];
    path.edges.push_back({belief_of(answers[part].values[index], correlation), edge.way});
    for (const std::string& id : correlation.observed_with) {
      const bool known =
          has(plan.edges, id) || std::count(path.missing.begin(), path.missing.end(), id) != 0;
      if (!known) path.missing.push_back(id);
    }
  }
  for (std::size_t k = 0; k < plan.edges.size() && !path.torn; ++k) {
    const auto& [part, index] = placed[k];
    path.torn = lacks_source(plan, path, path.edges[k].X_PC,
                             answers[part].correlations[index].observed_with);
  }
  return path;
}

std::vector<Part> revisions(const ObservePlan& plan, const ObservedPath& path,
                            const Observation& observation) {
  std::vector<std::string> together;
  for (std::size_t k = 0; k < plan.edges.size(); ++k) {
    if (observation.edges[k].corrected) together.push_back(plan.edges[k].info.id);
  }
  std::vector<Part> parts = plan.parts;
  for (std::size_t i = 0; i < parts.size(); ++i) {
    parts[i].request.body =
        ReviseRequest{{}, path.stamp, path.seen[i].commit, path.seen[i].incarnation};
  }
  Places places(plan);
  for (std::size_t k = 0; k < plan.edges.size(); ++k) {
    const ObservedResult& result = observation.edges[k];
    const auto [part, index] = places.next(plan.edges[k]);
    if (!result.corrected && !(result.innovation.expected > 0)) continue;
    ReviseRequest::Edge edge{plan.edges[k].info.id, result.innovation, !observation.accepted, {}};
    if (result.corrected) {
      const Belief& X = result.X_PC;
      edge.revision =
          Revision{edge.id, {X.pose, X.unknown ? *X.unknown : X.own}, correlation_of(X, together)};
      edge.revision->X_PC.covariance.set_complete(!X.unspecified);
    }
    std::get<ReviseRequest>(parts[part].request.body).edges.push_back(std::move(edge));
  }
  const auto idle = [](const Part& part) {
    return std::get<ReviseRequest>(part.request.body).edges.empty();
  };
  parts.erase(std::remove_if(parts.begin(), parts.end(), idle), parts.end());
  // An owner's filter checks the request's id.
  for (Part& part : parts) {
    part.request.id = std::get<ReviseRequest>(part.request.body).edges.front().id;
  }
  return parts;
}

}  // namespace tfdude
