#include "runtime/explanations.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "tfdude/base/id.hpp"
#include "tfdude/base/number.hpp"
#include "tfdude/base/similar.hpp"

#include "calls/lookup_in_progress.hpp"
#include "math/instant_sources.hpp"
#include "math/path_relations.hpp"
#include "math/variance_shares.hpp"
#include "partition/observing.hpp"
#include "runtime/member_runner.hpp"

namespace tfdude {
namespace {

// How long owners are waited for in all: for people, who then learn which owner is silent.
constexpr Milliseconds kPatienceForAnswers{90};

// The edges of a path at one instant.
class PathEdgesTask final : public Task {
 public:
  PathEdgesTask(const Forest& forest, std::string a, std::string b, std::optional<Time> at)
      : forest_(forest), a_(std::move(a)), b_(std::move(b)), at_(at) {}

  [[nodiscard]] std::vector<std::string> frames() const override { return {a_, b_}; }
  [[nodiscard]] Result<void> plan(const Directory& directory, Clock::time_point) override {
    auto planned = route_observe(forest_, directory, a_, b_, {}, at_);
    if (!planned) return tl::unexpected(std::move(planned.error()));
    plan_ = *std::move(planned);
    return {};
  }
  [[nodiscard]] std::vector<Part>& parts() override { return plan_.parts; }
  [[nodiscard]] Result<Next> take(std::vector<Reply> replies, Clock::time_point) override {
    auto answers = values_of(std::move(replies));
    if (!answers) return tl::unexpected(std::move(answers.error()));
    auto path = observed_path(plan_, *answers);
    if (!path) return tl::unexpected(std::move(path.error()));
    path->edges.resize(plan_.edges.size());  // no rows were asked for
    std::vector<bool> lasting;
    for (std::size_t k = 0; k < plan_.edges.size(); ++k) {
      lasting.push_back(!instant_of(plan_, *path, k));
    }
    edges_ = std::move(path->edges);
    relate_sources(edges_, lasting, path->stamp);
    return Next::kDone;
  }

  /// Once it is done.
  [[nodiscard]] const std::vector<ObservedEdge>& edges() const { return edges_; }
  [[nodiscard]] const FrameInfo& info(std::size_t k) const { return plan_.edges[k].info; }

 private:
  const Forest& forest_;
  const std::string a_;
  const std::string b_;
  const std::optional<Time> at_;
  ObservePlan plan_;
  std::vector<ObservedEdge> edges_;
};

std::vector<VarianceShare> sorted(std::vector<VarianceShare> shares, double total) {
  for (VarianceShare& one : shares) one.share = total > 0 ? one.variance / total : 0;
  shares.erase(std::remove_if(shares.begin(), shares.end(),
                              [](const VarianceShare& one) { return one.variance == 0; }),
               shares.end());
  std::stable_sort(shares.begin(), shares.end(),
                   [](const auto& x, const auto& y) { return x.variance > y.variance; });
  return shares;
}

// The partition is absent.
void blame(const PartitionInfo& absent, Cause& cause) {
  cause.obstacle = absent.silent    ? Obstacle::kOwnerSilent
                   : absent.stopped ? Obstacle::kOwnerStopped
                                    : Obstacle::kOwnerLost;
  cause.partition = absent.name;
  cause.since = absent.since;
  cause.needs = "partition " + quote(absent.name) + " again" +
                (absent.host.empty() ? ""
                                     : ", which ran on host " + absent.host + " as process " +
                                           std::to_string(absent.pid));
}

}  // namespace

Explanation Explanations::why(const std::string& a, const std::string& b, const WhyQuery& query) {
  for (const double deviation : query.sensor) {
    if (deviation >= 0 && std::isfinite(deviation)) continue;
    Cause cause;
    cause.error = {Errc::kInvalidInput,
                   "a standard deviation of the sensor must be finite and not "
                   "negative, not " +
                       number_text(deviation)};
    Explanation explanation;
    explanation.cause = std::move(cause);
    return explanation;
  }
  const Deadline deadline = discovery_.call_deadline();
  const bool complete = discovery_.complete();
  const Deadline answers = complete ? deadline.within(kPatienceForAnswers) : deadline;
  // The rest is for what explains the answer.
  const Deadline first = answers.within(answers.left() / 3 * 2);
  Query lookup;
  lookup.at = query.at;
  Explanation explanation;
  auto found = lookups_.lookup<std::string_view>(a, b, lookup, first);
  if (!found && found.error().code == Errc::kTimeout && !complete) {
    // A program that has just joined hears last of partitions that are lost.
    found = lookups_.lookup<std::string_view>(a, b, lookup, deadline);
  }
  if (!found) {
    explanation.cause = cause_of(std::move(found.error()), a, b, query, answers);
    return explanation;
  }
  explanation.X_AB = *std::move(found);
  divide(a, b, query, deadline.within(deadline.left() / 4 * 3), explanation);
  if (const auto edges = structure_.forest.edges(a, b)) {
    add_ages(owners_of(*edges, deadline), deadline, explanation);
  }
  return explanation;
}

void Explanations::divide(const std::string& a, const std::string& b, const WhyQuery& query,
                          const Deadline& deadline, Explanation& explanation) {
  const StampedTransform& X_AB = *explanation.X_AB;
  const PathFunctional functional = worst_direction(X_AB);
  explanation.direction = functional.direction;
  explanation.is_rotation = functional.is_rotation;
  const Matrix6d sigma = X_AB.covariance.of_specified().matrix();
  explanation.variance = functional.gradient.dot(sigma * functional.gradient);
  PathEdgesTask at_stamp(structure_.forest, a, b, X_AB.stamp);
  PathEdgesTask newest(structure_.forest, a, b, std::nullopt);
  const bool has_all = requests_.run(at_stamp, deadline).has_value();
  // The latest common time leaves out an edge without a sample.
  if (!has_all && (query.at || !requests_.run(newest, deadline))) return;
  const PathEdgesTask& task = has_all ? at_stamp : newest;
  Eigen::Matrix<double, 6, 1> sensor;
  for (Eigen::Index i = 0; i < 6; ++i) {
    const double stddev = query.sensor[static_cast<std::size_t>(i)];
    sensor[i] = std::max(stddev * stddev, 1e-24);
  }
  const VarianceShares shares = variance_shares(task.edges(), functional, sensor);
  std::vector<VarianceShare> edges;
  std::vector<VarianceShare> moved;
  std::map<std::string, std::string> joint_of;  // by frame
  std::vector<std::string> asked;
  for (std::size_t k = 0; k < task.edges().size(); ++k) {
    const std::string owner = owner_name(task.info(k).owner);
    if (std::find(asked.begin(), asked.end(), owner) != asked.end()) continue;
    asked.push_back(owner);
    const auto joints = joints_.list(owner, deadline);
    if (!joints) continue;
    for (const JointInfo& joint : *joints) {
      joint_of[joint.frame] = joint.name;
      const auto on_path = [&](std::size_t i) { return task.info(i).id == joint.frame; };
      for (std::size_t i = 0; i < task.edges().size(); ++i) {
        if (!joint.measured && on_path(i)) explanation.assumed_joints.push_back(joint.name);
      }
    }
  }
  std::optional<std::size_t> best;
  for (std::size_t k = 0; k < task.edges().size(); ++k) {
    const FrameInfo& edge = task.info(k);
    edges.push_back({edge.id, shares.edges[k], 0});
    const auto joint = joint_of.find(edge.id);
    if (joint != joint_of.end()) moved.push_back({joint->second, shares.edges[k], 0});
    if (!best || shares.after[k] < shares.after[*best]) best = k;
  }
  std::vector<VarianceShare> sources;
  std::map<std::string, double> of_shown;
  for (const auto& [name, variance] : shares.sources) {
    of_shown[std::string(shown_source(name))] += variance;
  }
  for (const auto& [name, variance] : of_shown) sources.push_back({name, variance, 0});
  explanation.edges = sorted(std::move(edges), shares.total);
  explanation.sources = sorted(std::move(sources), shares.total);
  explanation.joints = sorted(std::move(moved), shares.total);
  if (best && shares.after[*best] < shares.total) {
    const FrameInfo& edge = task.info(*best);
    explanation.best =
        PossibleMeasurement{edge.parent, edge.id, std::max(shares.after[*best], 0.0)};
  }
}

std::string Explanations::owner_name(Owner owner) {
  const Lock lock(structure_.mutex);
  return structure_.directory.name(owner);
}

Explanations::Owners Explanations::owners_of(const std::vector<FrameInfo>& edges,
                                             const Deadline& deadline) {
  Owners owners;
  std::vector<Part> parts;
  for (const FrameInfo& edge : edges) {
    const std::string name = owner_name(edge.owner);
    if (std::find(owners.order.begin(), owners.order.end(), name) == owners.order.end()) {
      owners.order.push_back(name);
    }
    parts.push_back({edge.owner, name, Request{0, edge.id, HistoryRequest{}}});
  }
  const std::vector<Reply> replies = requests_.ask(parts, deadline.within(kPatienceForAnswers));
  for (std::size_t i = 0; i < replies.size(); ++i) {
    const auto* error = std::get_if<Error>(&replies[i].body);
    if (error != nullptr && error->code == Errc::kTimeout && owners.silent.empty()) {
      owners.silent = parts[i].partition;
    }
    const auto* histories = std::get_if<std::vector<HistoryInfo>>(&replies[i].body);
    if (histories == nullptr || histories->empty()) continue;
    const HistoryInfo& history = histories->front();
    // A static edge is listed if it has rejected samples.
    if (!history.dynamic()) continue;
    owners.dynamic.push_back(
        {edges[i].id, parts[i].partition, history.oldest, history.newest, history.refused_ahead});
  }
  return owners;
}

void Explanations::add_ages(const Owners& owners, const Deadline& deadline,
                            Explanation& explanation) {
  const auto now = structure_.clock.now();
  for (const std::string& name : owners.order) {
    OwnerAge age{name};
    age.reachable = name != owners.silent;
    for (const EdgeHistory& edge : owners.dynamic) {
      if (edge.partition != name || !edge.newest) continue;
      if (age.newest && *age.newest <= *edge.newest) continue;
      age.slowest = edge.id;
      age.newest = edge.newest;
    }
    if (age.newest && now) age.age = *now - *age.newest;
    if (age.age) age.clock_ahead = clock_ahead(name, deadline);
    explanation.owners.push_back(std::move(age));
  }
}

// ---- why there is no answer

Cause Explanations::cause_of(Error error, const std::string& a, const std::string& b,
                             const WhyQuery& query, const Deadline& deadline) {
  Cause cause;
  cause.error = std::move(error);
  if (explain_missed(a, b, cause)) return cause;
  // What is missing at the time limit is no longer an error of its own, but is still missing.
  for (const std::string& id : {a, b}) {
    if (!structure_.forest.exists(id)) {
      explain_unknown(id, cause);
      return cause;
    }
  }
  const auto edges = structure_.forest.edges(a, b);
  if (!edges) {
    explain_apart(a, b, cause);
    return cause;
  }
  explain_absent(*edges, cause);
  if (cause.obstacle != Obstacle::kOther) return cause;
  Owners owners = owners_of(*edges, deadline);
  // One may have been lost while they were asked.
  explain_absent(*edges, cause);
  if (cause.obstacle != Obstacle::kOther) return cause;
  if (!owners.silent.empty()) {
    cause.obstacle = Obstacle::kOwnerSilent;
    cause.partition = owners.silent;
    const auto of_it = [&](const FrameInfo& edge) {
      return owner_name(edge.owner) == owners.silent;
    };
    const auto edge = std::find_if(edges->begin(), edges->end(), of_it);
    if (edge != edges->end()) cause.frame = edge->id;
    cause.needs = "partition " + quote(owners.silent) +
                  " is there, but does not answer: its process hangs, or the network loses its "
                  "replies";
    return cause;
  }
  const bool of_time = cause.error.code == Errc::kNotYet || cause.error.code == Errc::kTooOld;
  if (of_time) explain_time(std::move(owners), query, deadline, cause);
  return cause;
}

std::vector<std::string> Explanations::names_like(const std::string& id) {
  std::vector<std::string> ids;
  for (FrameInfo& frame : structure_.forest.frames()) ids.push_back(std::move(frame.id));
  return similar_names(id, ids);
}

void Explanations::explain_unknown(const std::string& id, Cause& cause) {
  cause.frame = id;
  if (cause.error.code == Errc::kTimeout && !discovery_.complete()) {
    cause.needs =
        "a longer time limit: not all participants have told yet which frames they have, or have "
        "lost";
    return;
  }
  cause.obstacle = Obstacle::kUnknownFrame;
  cause.similar = names_like(id);
  if (!structure_.forest.frames().empty()) {
    cause.needs = "a frame " + quote(id) + ": add it, or start the partition that has it";
    return;
  }
  cause.obstacle = Obstacle::kNobody;
  cause.needs =
      "no partition has been found: start one, or see `tfdude doctor` (domain, profile, "
      "network, keys)";
}

std::optional<FrameInfo> Explanations::top_of(const std::string& id) const {
  auto frame = structure_.forest.info(id);
  while (frame && frame->attached && !frame->parent.empty()) {
    auto above = structure_.forest.info(frame->parent);
    if (!above) break;
    frame = std::move(above);
  }
  return frame;
}

void Explanations::explain_apart(const std::string& a, const std::string& b, Cause& cause) {
  const auto top_a = top_of(a);
  const auto top_b = top_of(b);
  for (const auto& top : {top_a, top_b}) {
    if (!top || top->parent.empty()) continue;
    cause.obstacle = Obstacle::kMissingParent;
    cause.frame = top->id;
    cause.partition = owner_name(top->owner);
    cause.similar = names_like(top->parent);
    cause.needs = "a frame " + quote(top->parent) + ", which frame " + quote(top->id) +
                  " names as its parent";
    return;
  }
  cause.obstacle = Obstacle::kNotConnected;
  if (!top_a || !top_b) return;
  cause.frame = top_b->id;
  cause.partition = owner_name(top_b->owner);
  cause.needs = "the roots " + quote(top_a->id) + " and " + quote(top_b->id) +
                " have nothing in common: one of them needs a parent in the tree of the other";
}

void Explanations::explain_absent(const std::vector<FrameInfo>& edges, Cause& cause) {
  const Lock lock(structure_.mutex);
  const Directory& directory = structure_.directory;
  for (const FrameInfo& edge : edges) {
    if (edge.owner == kHeldHere || directory.reachable(edge.owner)) continue;
    cause.frame = edge.id;
    return blame(directory.info(edge.owner), cause);
  }
}

bool Explanations::explain_missed(const std::string& a, const std::string& b, Cause& cause) {
  if (cause.error.code != Errc::kUnreachable) return false;
  const Lock lock(structure_.mutex);
  const auto missed = structure_.directory.only_heard_of();
  if (!missed || missed->name != cause.error.partition) return false;
  cause.frame = cause.error.frame;
  for (const auto& top : {top_of(a), top_of(b)}) {
    if (top && !top->parent.empty()) cause.frame = top->parent;
  }
  blame(*missed, cause);
  return true;
}

bool Explanations::has_other_clock(const Owners& owners, Cause& cause) {
  const Lock lock(structure_.mutex);
  // A static edge holds for all times, of every clock.
  for (const EdgeHistory& edge : owners.dynamic) {
    const std::string& name = edge.partition;
    const auto owner = structure_.directory.owner(name);
    if (!owner || *owner == kHeldHere) continue;
    const auto clock = structure_.directory.info(*owner).clock;
    if (!clock || *clock == structure_.clock.kind()) continue;
    cause.obstacle = Obstacle::kOtherClock;
    cause.partition = name;
    cause.needs = "partition " + quote(name) + " uses the " + to_string(*clock) +
                  " clock, and this participant the " + to_string(structure_.clock.kind()) +
                  " clock: all must use the same";
    return true;
  }
  return false;
}

void Explanations::explain_time(Owners owners, const WhyQuery& query, const Deadline& deadline,
                                Cause& cause) {
  // Of edges with one stamp, as a controller sends them, the message names one: it is the first.
  std::stable_partition(owners.dynamic.begin(), owners.dynamic.end(),
                        [&](const EdgeHistory& one) { return one.id == cause.error.frame; });
  const EdgeHistory* first_to_end = nullptr;
  const EdgeHistory* last_to_begin = nullptr;
  const EdgeHistory* none = nullptr;
  for (const EdgeHistory& edge : owners.dynamic) {
    if (!edge.newest) {
      // At the latest common time, one that had no sample yet has its first value.
      const bool lacks = query.at || edge.id == cause.error.frame;
      if (none == nullptr && lacks) none = &edge;
      continue;
    }
    if (first_to_end == nullptr || *edge.newest < *first_to_end->newest) first_to_end = &edge;
    if (last_to_begin == nullptr || *edge.oldest > *last_to_begin->oldest) last_to_begin = &edge;
  }
  const auto blame = [&](Obstacle obstacle, const EdgeHistory& edge, std::string needs) {
    cause.obstacle = obstacle;
    cause.frame = edge.id;
    cause.partition = edge.partition;
    cause.since = obstacle == Obstacle::kBeginsAfter ? edge.oldest : edge.newest;
    cause.needs = std::move(needs);
    if (edge.ahead == 0 || obstacle == Obstacle::kBeginsAfter) return;
    cause.needs +=
        "; rejected so far, as too far ahead of the owner's clock: " + std::to_string(edge.ahead) +
        ", so whoever sends them may have another clock";
  };
  if (none != nullptr) {
    blame(Obstacle::kNoSample, *none, "a first sample of the edge of " + quote(none->id));
  } else if (query.at && has_other_clock(owners, cause)) {
    return;
  } else if (query.at && first_to_end != nullptr && *first_to_end->newest < *query.at) {
    blame(Obstacle::kEndsBefore, *first_to_end,
          "a sample of the edge of " + quote(first_to_end->id) + " at or after " +
              readable(*query.at) + "; its newest one is " +
              readable(*query.at - *first_to_end->newest) + " older");
  } else if (query.at && last_to_begin != nullptr && *last_to_begin->oldest > *query.at) {
    blame(Obstacle::kBeginsAfter, *last_to_begin,
          "a later instant: the oldest sample that is kept of the edge of " +
              quote(last_to_begin->id) + " is " + readable(*last_to_begin->oldest - *query.at) +
              " after it; or a longer history");
  } else if (!query.at && first_to_end != nullptr &&
             *first_to_end->newest < *last_to_begin->oldest) {
    if (has_other_clock(owners, cause)) return;
    blame(Obstacle::kNoCommonInstant, *first_to_end,
          "a sample of the edge of " + quote(first_to_end->id) + " at or after " +
              readable(*last_to_begin->oldest) + ", when the edge of " + quote(last_to_begin->id) +
              " of partition " + quote(last_to_begin->partition) + " begins");
  }
  if (cause.partition.empty()) return;
  cause.clock_ahead = clock_ahead(cause.partition, deadline);
  if (cause.clock_ahead) cause.needs += "; " + clock_hint(cause.partition, *cause.clock_ahead);
}

std::optional<std::chrono::nanoseconds> Explanations::clock_ahead(const std::string& partition,
                                                                  const Deadline& deadline) {
  // Of the system's clocks.
  if (structure_.clock.kind() != ClockKind::kSystem) return std::nullopt;
  // Two, as the first one may be slow.
  const auto difference =
      queries_.clock_difference(partition, deadline.within(kPatienceForAnswers), 2);
  const bool differs = difference && difference->exceeds(kClockDiffers);
  return differs ? std::optional(difference->ahead) : std::nullopt;
}

}  // namespace tfdude
