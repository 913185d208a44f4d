#include "runtime/velocities.hpp"

#include <algorithm>
#include <optional>
#include <utility>

#include "base/saturating.hpp"
#include "base/stamp.hpp"
#include "calls/one_state_task.hpp"
#include "math/mean_velocity.hpp"

namespace tfdude {
namespace {

// The reads of a velocity.
constexpr std::size_t kBegin = 0;
constexpr std::size_t kEnd = 1;
constexpr std::size_t kMiddle = 2;

std::vector<EdgeAtEnds> edges_of(const OneStateTask& task) {
  std::vector<EdgeAtEnds> edges;
  const ObservedPath& before = task.path(kBegin);
  const ObservedPath& after = task.path(kEnd);
  const auto& planned = task.planned(kBegin).edges;
  for (std::size_t k = 0; k < planned.size(); ++k) {
    const std::string& id = planned[k].info.id;
    const bool moves =
        is_moving(id, before.correlations[k]) || is_moving(id, after.correlations[k]);
    const bool drifts =
        is_drifting(id, before.correlations[k]) && is_drifting(id, after.correlations[k]) &&
        is_corrected(id, before.correlations[k]) == is_corrected(id, after.correlations[k]);
    edges.push_back({before.edges[k].X_PC, after.edges[k].X_PC, planned[k].way, !moves, drifts});
  }
  return edges;
}

// Whether B turns by more than half a turn from the first instant over the middle to the last: then
// the shorter way between the first and the last pose is not the way that it took.
bool turns_too_far(const OneStateTask& task) {
  const Eigen::Quaterniond middle = task.pose(kMiddle).rotation();
  return task.pose(kBegin).rotation().angularDistance(middle) +
             middle.angularDistance(task.pose(kEnd).rotation()) >
         EIGEN_PI;
}

}  // namespace

Result<Velocities::Interval> Velocities::interval(const std::string& a, const std::string& b,
                                                  const VelocityQuery& query, Time newest,
                                                  const Deadline& deadline) {
  Time end = newest;
  if (query.at) {
    if (*query.at > end) {
      if (auto at = lookup(a, b, query.at, deadline); !at) return tl::unexpected(at.error());
    }
    end = std::min(std::max(end, *query.at), later_by(*query.at, query.over / 2));
  }
  const Time begin = earlier_by(end, query.over);
  if (is_stamp(begin)) return Interval{begin, end};
  return fail(Errc::kTooOld,
              "the interval begins " + readable(apart(begin, Time{})) + " before the clock starts");
}

Result<StampedTransform> Velocities::lookup(const std::string& a, const std::string& b,
                                            const std::optional<Time>& at,
                                            const Deadline& deadline) {
  Query query;
  query.at = at;
  return lookups_.lookup<std::string_view>(a, b, query, deadline);
}

Result<Velocity> Velocities::velocity(const std::string& a, const std::string& b,
                                      const VelocityQuery& query, const Deadline& deadline) {
  if (query.over <= std::chrono::nanoseconds(0)) {
    return fail(Errc::kInvalidInput,
                "the interval of a velocity must be positive, not " + readable(query.over));
  }
  if (auto ok = check_stamp(query.at); !ok) return tl::unexpected(std::move(ok.error()));
  auto newest = lookup(a, b, {}, deadline);
  // No edge has samples: what was not sampled yet is nowhere at an instant, whichever, and nobody
  // has measured how it moves.
  const bool rests = newest && !newest->stamp;
  if (rests && (query.at || newest->covariance.complete())) {
    newest = lookup(a, b, query.at.value_or(Time{}), deadline);
  }
  if (!newest) return tl::unexpected(std::move(newest.error()));
  if (rests) {
    Velocity rest;
    rest.basis.unspecified = std::move(newest->basis.unspecified);
    rest.covariance.set_complete(rest.basis.unspecified.empty());
    return rest;
  }
  const auto interval = this->interval(a, b, query, *newest->stamp, deadline);
  if (!interval) return tl::unexpected(interval.error());
  const Interval& ends = *interval;
  const auto read_at = [&](Time at) { return OneStateTask::Read{a, b, {at, {}, {}}}; };
  const Time middle = ends.begin + (ends.end - ends.begin) / 2;
  OneStateTask task(structure_.forest, {read_at(ends.begin), read_at(ends.end), read_at(middle)},
                    true);
  if (auto asked = requests_.run(task, deadline); !asked) return tl::unexpected(asked.error());
  std::vector<EdgeAtEnds> edges = edges_of(task);
  if (turns_too_far(task)) {
    return fail_about_frame(Errc::kInvalidInput,
                            "frame " + quote(b) + " turns by more than half a turn in " + quote(a) +
                                " within " + readable(ends.end - ends.begin) +
                                ", so that two poses do not tell how fast: ask over less time",
                            b);
  }
  std::vector<std::string> unspecified;
  for (std::size_t k = 0; k < edges.size(); ++k) {
    if (!edges[k].before.unspecified && !edges[k].after.unspecified) continue;
    unspecified.push_back(task.planned(kBegin).edges[k].info.id);
  }
  MeanVelocity mean =
      mean_velocity(std::move(edges), std::chrono::duration<double>(ends.end - ends.begin).count());
  Velocity velocity{mean.linear, mean.angular, mean.covariance, ends.begin, ends.end, {}};
  velocity.basis.bound = mean.bound;
  velocity.basis.sources = std::move(mean.sources);
  velocity.basis.unspecified = std::move(unspecified);
  velocity.covariance.set_complete(velocity.basis.unspecified.empty());
  return velocity;
}

}  // namespace tfdude
