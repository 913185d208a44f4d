#include "runtime/velocities.hpp"

#include <algorithm>
#include <iterator>
#include <optional>
#include <utility>

#include "base/saturating.hpp"
#include "base/stamp.hpp"
#include "runtime/gathering.hpp"

namespace tfdude {
namespace {

// The same requests at another instant.
std::vector<Part> parts_at(const std::vector<Part>& parts, Time at) {
  std::vector<Part> then = parts;
  for (Part& part : then) std::get<LookupRequest>(part.request.body).query.at = at;
  return then;
}

// A static edge is the same at both instants, but a dynamic one may also be.
bool is_same(const Belief& a, const Belief& b) {
  const auto upper = [](const std::optional<Covariance>& sigma) {
    return sigma ? sigma->upper() : Covariance::Upper{};
  };
  return a.pose.matrix() == b.pose.matrix() && a.own.upper() == b.own.upper() &&
         a.unknown.has_value() == b.unknown.has_value() && upper(a.unknown) == upper(b.unknown) &&
         a.common_errors == b.common_errors && a.unspecified == b.unspecified;
}

bool is_static(const std::vector<HistoryInfo>& histories) {
  return std::none_of(histories.begin(), histories.end(),
                      [](const HistoryInfo& history) { return history.newest.has_value(); });
}

}  // namespace

Result<std::optional<Velocities::Interval>> Velocities::interval(const std::string& a,
                                                                 const std::string& b,
                                                                 const VelocityQuery& query,
                                                                 const Deadline& deadline) {
  if (query.over <= std::chrono::nanoseconds(0)) {
    return fail(Errc::kInvalidInput,
                "the interval of a velocity must be positive, not " + in_milliseconds(query.over));
  }
  if (auto ok = check_stamp(query.at); !ok) return tl::unexpected(std::move(ok.error()));
  const auto newest = lookups_.lookup<std::string_view>(a, b, {}, deadline);
  if (!newest) return tl::unexpected(newest.error());
  if (!newest->stamp) return std::nullopt;
  Time end = *newest->stamp;
  if (query.at) {
    if (*query.at > end) {
      Query then;
      then.at = query.at;
      const auto at = lookups_.lookup<std::string_view>(a, b, then, deadline);
      if (!at) return tl::unexpected(at.error());
    }
    end = std::min(std::max(end, *query.at), later_by(*query.at, query.over / 2));
  }
  const Time begin = earlier_by(end, query.over);
  if (is_stamp(begin)) return Interval{begin, end};
  return fail(Errc::kTooOld, "the interval begins " + in_milliseconds(apart(begin, Time{})) +
                                 " before the clock starts");
}

Result<void> Velocities::find_fixed(const ObservePlan& plan, std::vector<EdgeAtEnds>& edges,
                                    const Deadline& deadline) {
  std::vector<std::size_t> asked;
  std::vector<Part> parts;
  for (std::size_t k = 0; k < edges.size(); ++k) {
    if (!is_same(edges[k].before, edges[k].after)) continue;
    const FrameInfo& edge = plan.edges[k].info;
    const auto owner = std::find_if(plan.parts.begin(), plan.parts.end(),
                                    [&](const Part& part) { return part.owner == edge.owner; });
    asked.push_back(k);
    parts.push_back({edge.owner, owner->partition, Request{0, edge.id, HistoryRequest{}}});
  }
  if (parts.empty()) return {};
  std::vector<Reply> replies = requests_.ask(parts, deadline);
  for (std::size_t i = 0; i < asked.size(); ++i) {
    if (auto* error = std::get_if<Error>(&replies[i].body)) return tl::unexpected(*error);
    const auto* histories = std::get_if<std::vector<HistoryInfo>>(&replies[i].body);
    edges[asked[i]].fixed = histories != nullptr && is_static(*histories);
  }
  return {};
}

Result<std::vector<EdgeAtEnds>> Velocities::edges(const ObservePlan& plan, const Interval& interval,
                                                  const Deadline& deadline) {
  std::vector<Part> parts = parts_at(plan.parts, interval.begin);
  std::vector<Part> then = parts_at(plan.parts, interval.end);
  std::move(then.begin(), then.end(), std::back_inserter(parts));
  auto answers = values_of(requests_.ask(parts, deadline));
  if (!answers) return tl::unexpected(std::move(answers.error()));
  const auto middle = answers->begin() + static_cast<std::ptrdiff_t>(plan.parts.size());
  const auto before = observed_path(plan, {answers->begin(), middle});
  if (!before) return tl::unexpected(before.error());
  const auto after = observed_path(plan, {middle, answers->end()});
  if (!after) return tl::unexpected(after.error());
  std::vector<EdgeAtEnds> edges;
  for (std::size_t k = 0; k < plan.edges.size(); ++k) {
    edges.push_back({before->edges[k].X_PC, after->edges[k].X_PC, plan.edges[k].way});
  }
  if (auto ok = find_fixed(plan, edges, deadline); !ok) return tl::unexpected(ok.error());
  return edges;
}

Result<Velocity> Velocities::velocity(const std::string& a, const std::string& b,
                                      const VelocityQuery& query, const Deadline& deadline) {
  const auto interval = this->interval(a, b, query, deadline);
  if (!interval) return tl::unexpected(interval.error());
  if (!*interval) return Velocity{};
  const Interval& ends = **interval;
  ObservePlan used;
  const auto edges = requests_.retry_on_stale_route(
      deadline,
      [&] {
        return std::vector<std::string>{a, b};
      },
      [&](const Directory& directory) {
        return route_observe(structure_.forest, directory, a, b, {}, ends.begin);
      },
      [&](ObservePlan& plan) {
        auto found = this->edges(plan, ends, deadline);
        used = std::move(plan);
        return found;
      });
  if (!edges) return tl::unexpected(edges.error());
  MeanVelocity mean =
      mean_velocity(*edges, std::chrono::duration<double>(ends.end - ends.begin).count());
  Velocity velocity{mean.linear, mean.angular, mean.covariance, ends.begin, ends.end, {}};
  velocity.basis.bound = mean.bound;
  velocity.basis.sources = std::move(mean.sources);
  for (std::size_t k = 0; k < edges->size(); ++k) {
    if (!(*edges)[k].before.unspecified && !(*edges)[k].after.unspecified) continue;
    velocity.basis.unspecified.push_back(used.edges[k].info.id);
  }
  velocity.covariance.set_complete(velocity.basis.unspecified.empty());
  return velocity;
}

}  // namespace tfdude
