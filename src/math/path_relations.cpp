#include "math/path_relations.hpp"

#include <algorithm>
#include <cmath>

#include "math/common_errors.hpp"
#include "math/instant_sources.hpp"

namespace tfdude {
namespace {

// The common errors of the path's end.
std::vector<CommonError> errors_of(const std::vector<ObservedEdge>& edges) {
  Belief X;
  for (const ObservedEdge& edge : edges) {
    if (edge.way == ObservedEdge::Way::kBeside) continue;
    const Belief of_edge{edge.X_PC.pose, {}, {}, edge.X_PC.common_errors, false};
    const bool up = edge.way == ObservedEdge::Way::kUp;
    X = compose(X, up ? inverse(of_edge) : of_edge, Order::kSecond);
  }
  return X.common_errors;
}

bool has_said(const std::vector<ObservedEdge>& edges, std::string_view said, std::string& source) {
  for (const ObservedEdge& edge : edges) {
    for (const CommonError& one : edge.X_PC.common_errors) {
      if (!is_source_itself(one.source, said)) continue;
      source = one.source;
      return true;
    }
  }
  return false;
}

}  // namespace

PathRelations::PathRelations(const std::vector<ObservedEdge>& edges) {
  const bool any = std::any_of(edges.begin(), edges.end(), [](const ObservedEdge& edge) {
    return has_instants(edge.X_PC.common_errors);
  });
  if (!any) return;
  const std::vector<CommonError> errors = errors_of(edges);
  const std::vector<double> weights = relation_weights(errors);
  for (std::size_t i = 0; i < weights.size(); ++i) {
    if (weights[i] != 1) factors_.emplace_back(errors[i].source, std::sqrt(weights[i]));
  }
}

void PathRelations::keep_instants() {
  const auto all = factors_;
  const auto is_apart = [&](const auto& one) {
    if (instant_in(one.first).empty()) return true;
    const auto said = said_source(one.first);
    return std::none_of(all.begin(), all.end(), [&](const auto& other) {
      return is_between_samples(other.first) && said_source(other.first) == said;
    });
  };
  factors_.erase(std::remove_if(factors_.begin(), factors_.end(), is_apart), factors_.end());
}

double PathRelations::factor(const std::string& name) const {
  const auto found = std::find_if(factors_.begin(), factors_.end(),
                                  [&](const auto& one) { return one.first == name; });
  return found == factors_.end() ? 1.0 : found->second;
}

void PathRelations::widen(std::vector<CommonError>& common_errors) const {
  if (factors_.empty()) return;
  for (CommonError& one : common_errors) one.loading *= factor(one.source);
}

void PathRelations::narrow(std::vector<CommonError>& common_errors) const {
  if (factors_.empty()) return;
  for (CommonError& one : common_errors) one.loading /= factor(one.source);
}

void relate_sources(std::vector<ObservedEdge>& edges, const std::vector<bool>& lasting,
                    std::optional<Time> at) {
  std::vector<ErrorsOfEdge> all;
  for (std::size_t k = 0; k < edges.size(); ++k) {
    all.push_back({&edges[k].X_PC.common_errors, lasting[k]});
  }
  join_lasting(all);
  std::string source;
  for (ObservedEdge& edge : edges) {
    bool any = false;
    for (CommonError& one : edge.X_PC.common_errors) {
      if (!at || !is_of_one_instant(one.source)) continue;
      const std::string said(said_source(one.source));
      if (one.source != instant_source(said, *at) || !has_said(edges, said, source)) continue;
      one.source = source;
      any = true;
    }
    if (any) add_up(edge.X_PC.common_errors);
  }
  const PathRelations relations(edges);
  for (ObservedEdge& edge : edges) relations.widen(edge.X_PC.common_errors);
}

}  // namespace tfdude
