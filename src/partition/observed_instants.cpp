#include "partition/observed_instants.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>

#include "tfdude/types/joint_spec.hpp"

#include "math/common_errors.hpp"
#include "math/instant_sources.hpp"

namespace tfdude {
namespace {

bool has_named(const Belief& X, const std::string& name) {
  return std::any_of(X.common_errors.begin(), X.common_errors.end(), [&](const CommonError& one) {
    return one.source == name && !one.loading.isZero(0);
  });
}

bool has_instants_of(const std::vector<ObservedEdge>& edges, const std::string& source) {
  return std::any_of(edges.begin(), edges.end(), [&](const ObservedEdge& edge) {
    const auto& errors = edge.X_PC.common_errors;
    return std::any_of(errors.begin(), errors.end(), [&](const CommonError& one) {
      const auto said = said_source(one.source);
      return !said.empty() && is_source_itself(source, said);
    });
  });
}

// Enough for any correlation of a source with what is left of it at some instants.
void count_twice(std::vector<ObservedEdge>& edges, const std::string& source) {
  for (ObservedEdge& edge : edges) {
    for (CommonError& one : edge.X_PC.common_errors) {
      const auto said = said_source(one.source);
      const bool of_instants = !said.empty() && is_source_itself(source, said);
      if (of_instants || one.source == source) one.loading *= std::sqrt(2.0);
    }
  }
}

// The newest instant of which errors are left.
std::optional<std::int64_t> newest_instant(const std::vector<ObservedEdge>& edges) {
  std::optional<std::int64_t> newest;
  for (const ObservedEdge& edge : edges) {
    for (const CommonError& one : edge.X_PC.common_errors) {
      const std::string_view text = instant_in(one.source);
      std::int64_t instant = 0;
      const auto read = std::from_chars(text.data(), text.data() + text.size(), instant);
      if (read.ec == std::errc()) newest = std::max(newest.value_or(instant), instant);
    }
  }
  return newest;
}

// If one observation has taken a source for that of an instant, its error was the source's.
void make_lasting(std::vector<ObservedEdge>& edges, const std::string& source) {
  std::vector<std::string> names;
  for (const ObservedEdge& edge : edges) {
    for (const CommonError& one : edge.X_PC.common_errors) {
      const auto said = said_source(one.source);
      if (said.empty() || !is_source_itself(source, said)) continue;
      if (std::count(names.begin(), names.end(), one.source) == 0) names.push_back(one.source);
    }
  }
  const bool is_one = names.size() == 1 && is_of_one_instant(names.front());
  if (!is_one) return;
  for (ObservedEdge& edge : edges) {
    std::vector<CommonError> errors = std::move(edge.X_PC.common_errors);
    edge.X_PC.common_errors.clear();
    for (CommonError& one : errors) {
      if (one.source == names.front()) one.source = source;
    }
    add_errors(errors, edge.X_PC.common_errors);
  }
}

}  // namespace

// A source that edges name.
struct ObservedInstants::Use {
  std::string source;
  bool lasts = false;  // of a static edge, or one that drifts
};

ObservedInstants::ObservedInstants(const ObservePlan& plan, const ObservedPath& path,
                                   std::string source)
    : plan_(plan), path_(path), source_(std::move(source)) {}

// One beside the path does only if it was observed.
bool ObservedInstants::takes_part(const ObservedEdge& edge) const {
  const auto& errors = edge.X_PC.common_errors;
  return edge.way != ObservedEdge::Way::kBeside ||
         std::any_of(errors.begin(), errors.end(), is_observed);
}

std::vector<ObservedInstants::Use> ObservedInstants::uses(
    const std::vector<ObservedEdge>& edges) const {
  std::vector<Use> all;
  for (std::size_t k = 0; k < edges.size(); ++k) {
    if (!takes_part(edges[k])) continue;
    const bool lasts = !instant_of(plan_, path_, k);
    for (const CommonError& one : edges[k].X_PC.common_errors) {
      if (is_made(one.source)) continue;
      auto use = std::find_if(all.begin(), all.end(),
                              [&](const Use& other) { return other.source == one.source; });
      if (use == all.end()) use = all.insert(use, {one.source});
      use->lasts = use->lasts || lasts;
    }
  }
  return all;
}

void ObservedInstants::rename(std::vector<ObservedEdge>& edges, const Use& use) {
  for (std::size_t k = 0; k < edges.size(); ++k) {
    if (!takes_part(edges[k])) continue;
    const auto at = instant_of(plan_, path_, k);
    for (CommonError& one : edges[k].X_PC.common_errors) {
      if (one.source != use.source) continue;
      one.source =
          use.lasts || !at ? merged_source(source_, use.source) : instant_source(use.source, *at);
      renamed_.push_back({k, use.source, one.source});
    }
  }
}

// Those of a source that lasts have its name again; others get one that can be stored.
void ObservedInstants::name_between(std::vector<ObservedEdge>& edges) {
  std::vector<ErrorsOfEdge> all;
  for (std::size_t k = 0; k < edges.size(); ++k) {
    const bool lasts = takes_part(edges[k]) && !instant_of(plan_, path_, k);
    all.push_back({&edges[k].X_PC.common_errors, lasts});
  }
  join_lasting(all);
  for (std::size_t k = 0; k < edges.size(); ++k) {
    const auto at = instant_of(plan_, path_, k);
    if (!at || !takes_part(edges[k])) continue;
    for (CommonError& one : edges[k].X_PC.common_errors) {
      if (!is_of_two_samples(one.source)) continue;
      one.source = stored_between(one.source, *at);
      renamed_.push_back({k, one.source, one.source});
    }
  }
}

// What is merged counts as independent: that is enough for any relation of errors at one instant.
void ObservedInstants::merge_others(std::vector<ObservedEdge>& edges) const {
  // A path of static edges has no instant. The next observation may be of the newest one again,
  // also after one that came late.
  const std::optional<std::int64_t> left = newest_instant(edges);
  const std::int64_t here = path_.stamp ? nanoseconds(*path_.stamp) : left.value_or(0);
  const std::string kept[] = {std::to_string(here),
                              std::to_string(std::max(here, left.value_or(here)))};
  std::map<std::pair<std::string, std::string>, std::set<std::string>> names;  // of what is merged
  const auto of = [](const std::string& name) {
    return std::pair(std::string(said_source(name)), std::string(instant_in(name)));
  };
  const auto is_other = [&](const std::string& name) {
    const std::string_view instant = instant_in(name);
    return !instant.empty() && instant != kept[0] && instant != kept[1];
  };
  for (const ObservedEdge& edge : edges) {
    for (const CommonError& one : edge.X_PC.common_errors) {
      if (is_other(one.source)) names[of(one.source)].insert(one.source);
    }
  }
  for (ObservedEdge& edge : edges) {
    for (CommonError& one : edge.X_PC.common_errors) {
      if (!is_other(one.source)) continue;
      one.loading *= std::sqrt(static_cast<double>(names[of(one.source)].size()));
      one.source = as_merged(one.source);
    }
  }
}

void ObservedInstants::name(std::vector<ObservedEdge>& edges, bool merge) {
  name_between(edges);
  for (const Use& use : uses(edges)) {
    const bool of_joint = is_of_joints(use.source);
    if (use.lasts && of_joint && has_instants_of(edges, use.source)) count_twice(edges, use.source);
    if (!use.lasts || of_joint) {
      rename(edges, use);
    } else if (merge) {
      make_lasting(edges, use.source);
    }
  }
  if (merge) merge_others(edges);
  relations_ = PathRelations(edges);
  relations_.keep_instants();
  for (ObservedEdge& edge : edges) relations_.widen(edge.X_PC.common_errors);
}

// Whether another edge than those that named it has a share.
bool ObservedInstants::is_shared(const Observation& found, const std::string& name) const {
  for (std::size_t k = 0; k < found.edges.size(); ++k) {
    if (!has_named(found.edges[k].X_PC, name)) continue;
    const bool named = std::any_of(renamed_.begin(), renamed_.end(), [&](const Renamed& one) {
      return one.edge == k && one.now == name;
    });
    if (!named) return true;
  }
  return false;
}

void ObservedInstants::settle(Observation& found) const {
  if (!found.accepted) return;
  for (ObservedResult& edge : found.edges) relations_.narrow(edge.X_PC.common_errors);
  for (const Renamed& one : renamed_) {
    ObservedResult& edge = found.edges[one.edge];
    if (is_shared(found, one.now)) {
      edge.corrected = true;
      continue;
    }
    for (CommonError& error : edge.X_PC.common_errors) {
      if (error.source == one.now) error.source = one.before;
    }
  }
}

}  // namespace tfdude
