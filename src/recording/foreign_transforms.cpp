#include "recording/foreign_transforms.hpp"

#include <algorithm>

#include "tfdude/base/id.hpp"

namespace tfdude::recording {
namespace {

// Samples that go back by more are from a clock that has jumped back, as in the bridge.
constexpr std::chrono::seconds kJumpBack{1};

// More could make each transform cost as much as all before it.
constexpr std::size_t kMostAbove = 10'000;

constexpr std::size_t kMostStamps = 2'000'000;
constexpr std::size_t kLeastStampsOfEdge = 64;
constexpr std::size_t kMostStampsOfEdge = 4096;

std::size_t hash_of(const Pose& X) {
  const Eigen::Quaterniond& q = X.rotation();
  const Eigen::Vector3d& p = X.translation();
  std::size_t hash = 0;
  for (const double number : {p.x(), p.y(), p.z(), q.x(), q.y(), q.z(), q.w()}) {
    constexpr std::size_t kGolden = 0x9E3779B97F4A7C15ULL;
    hash ^= std::hash<double>()(number) + kGolden + (hash << 6U) + (hash >> 2U);
  }
  return hash;
}

}  // namespace

void ForeignTransforms::take(std::vector<RecordedValue>& values, TransformCounts& counts,
                             const Report& report) {
  std::vector<RecordedValue> taken;
  for (RecordedValue& value : values) {
    if (takes(value, counts, report)) taken.push_back(std::move(value));
  }
  values = std::move(taken);
}

bool ForeignTransforms::takes(RecordedValue& value, TransformCounts& counts, const Report& report) {
  Edge& edge = edges_[value.edge->id];
  Edge& parent = edges_[value.edge->parent];
  if (edge.parent != &parent) {
    if (const char* why = why_not_below(parent, edge)) {
      ++counts.cycles;
      report("the transform of frame " + quote(value.edge->id) + " is left out: its parent " +
             quote(value.edge->parent) + " is below " + why);
      return false;
    }
    edge = Edge{&parent, edge.is_parent};
    parent.is_parent = true;
  }
  if (value.stamp) return takes_sample(value, edge, counts, report);
  // From now on it is static, without the samples from before.
  if (!edge.is_static) value.more().begins = Covariance();
  edge = Edge{&parent, edge.is_parent};
  return true;
}

bool ForeignTransforms::takes_sample(RecordedValue& value, Edge& edge, TransformCounts& counts,
                                     const Report& report) {
  const auto who = [&] { return "frame " + quote(value.edge->id); };
  Time& stamp = *value.stamp;
  const Time newest = edge.seen.empty() ? stamp : edge.seen.back().stamp;
  if (newest - stamp > kJumpBack) {
    ++counts.jumps;
    report(who() + ": time has jumped back by more than a second: its samples before are dropped");
    edge = Edge{edge.parent, edge.is_parent};
    value.more().begins = Covariance();
  } else if (value.dated) {
    stamp = std::max(stamp, newest);  // while the clock stands still, the last one counts
  }
  edge.is_static = false;
  const Seen seen{stamp, hash_of(value.X_PC.pose)};
  const auto place =
      std::lower_bound(edge.seen.begin(), edge.seen.end(), stamp,
                       [](const Seen& one, Time other) { return one.stamp < other; });
  if (place != edge.seen.end() && place->stamp == stamp) {
    const bool is_same = place->pose == seen.pose;
    if (is_same && !value.dated) ++counts.same;
    if (is_same || value.dated) {
      place->pose = seen.pose;
      return !is_same;
    }
    ++counts.repeated;
    report("a transform of " + who() +
           " is left out: another value for a stamp that was there before");
    return false;
  }
  if (edge.forgotten && stamp <= *edge.forgotten) {
    ++counts.old;
    report("a transform of " + who() + " is left out: older than the " +
           std::to_string(edge.seen.size()) + " newest samples");
    return false;
  }
  edge.seen.insert(place, seen);
  forget_some(edge);
  return true;
}

// What is older by more than a jump is never asked for.
void ForeignTransforms::forget_some(Edge& edge) const {
  const std::size_t most =
      std::clamp(kMostStamps / edges_.size(), kLeastStampsOfEdge, kMostStampsOfEdge);
  while (edge.seen.back().stamp - edge.seen.front().stamp > kJumpBack) edge.seen.pop_front();
  while (edge.seen.size() > most) {
    edge.forgotten = edge.seen.front().stamp;
    edge.seen.pop_front();
  }
}

const char* ForeignTransforms::why_not_below(const Edge& parent, const Edge& edge) {
  if (!edge.is_parent) return nullptr;
  std::size_t above = 0;
  for (const Edge* at = &parent; at != nullptr; at = at->parent) {
    if (at == &edge) return "it";
    if (++above > kMostAbove) return "more than 10000 others";
  }
  return nullptr;
}

}  // namespace tfdude::recording
