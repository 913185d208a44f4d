#include "replayed_partition.hpp"

#include <algorithm>
#include <set>
#include <utility>

#include "tfdude/base/id.hpp"

#include "rendering/whole_value.hpp"

namespace tfdude::cli {
namespace {

// Only observations and joints may use their prefixes, and name the edges that they changed.
constexpr std::string_view kReplayedPrefix = "replayed:";

Correlation replayed(Correlation correlation) {
  correlation.observed_with.clear();
  for (CommonError& error : correlation.common_errors) {
    const bool observed = is_observed(error);
    if (!observed && !is_of_joints(error.source)) continue;
    if (observed) error.source.erase(0, kObservedPrefix.size());
    error.source.insert(0, kReplayedPrefix);
  }
  return correlation;
}

// A process of an earlier version may have had an id that no new frame gets.
bool can_serve(const FrameSpec& spec) {
  const auto& sources = spec.correlation.common_errors;
  return check_new_id(spec.id, "id") &&
         std::all_of(sources.begin(), sources.end(), [](const CommonError& one) {
           return check_new_source(one.source).has_value();
         });
}

// The values by frame.
std::vector<const WatchedValue*> by_frame(std::size_t frames, const ValuesNews& values) {
  std::vector<const WatchedValue*> all(frames);
  for (const WatchedValue& value : values.values) {
    if (value.frame < frames) all[value.frame] = &value;
  }
  return all;
}

}  // namespace

Result<ReplayedPartition> ReplayedPartition::open(const std::string& name, const FramesNews& frames,
                                                  const ValuesNews& values,
                                                  const NodeOptions& options) {
  std::vector<FrameSpec> specs;
  std::size_t rejected = 0;
  std::unordered_map<std::string, Edge> served;
  const auto known = by_frame(frames.frames.size(), values);
  for (std::size_t i = 0; i < known.size(); ++i) {
    const WatchedFrame& frame = frames.frames[i];
    FrameSpec spec{frame.id, frame.parent, {}};
    Edge edge{frame.parent, false, Correlation()};
    if (known[i] != nullptr) {
      spec.correlation = correlation_of(*known[i], frame.id, edge);
      edge.correlation = spec.correlation;
      spec.X_PC = served_as(*known[i], edge);
      // Until its sample is applied, a dynamic edge has no value that would hold for all times.
      const bool moves = known[i]->stamp || known[i]->unsampled;
      const Covariance noise = known[i]->begins.value_or(Covariance());
      if (moves || noise.upper() != Covariance::Upper{}) {
        spec.timing = options.history;
        spec.timing->process_noise = noise;
        spec.timing->moving = moves;
      }
    }
    if (!can_serve(spec)) {
      ++rejected;
      continue;
    }
    specs.push_back(std::move(spec));
    served.emplace(frame.id, std::move(edge));
  }
  auto node = Node::open(name, specs, options);
  if (!node) return tl::unexpected(std::move(node.error()));
  ReplayedPartition partition(*std::move(node));
  partition.frames_ = frames.frames;
  partition.rejected_ = rejected;
  partition.served_ = std::move(served);
  if (auto applied = partition.apply(values); !applied) {
    return tl::unexpected(std::move(applied.error()));
  };
  return partition;
}

void ReplayedPartition::apply(const FramesNews& frames) {
  frames_ = frames.frames;
  settled_ = false;
}

void ReplayedPartition::settle(const ValuesNews& values) {
  if (std::exchange(settled_, true)) return;
  std::set<std::string_view> wanted;
  for (const WatchedFrame& frame : frames_) wanted.insert(frame.id);
  bool removed = false;
  for (auto served = served_.begin(); served != served_.end();) {
    if (wanted.count(served->first) > 0) {
      ++served;
      continue;
    }
    (void)node_.remove(served->first);
    served = served_.erase(served);
    removed = true;
  }
  // With a frame those below it went.
  for (auto served = served_.begin(); removed && served != served_.end();) {
    served = node_.parent(served->first) ? std::next(served) : served_.erase(served);
  }
  const auto known = by_frame(frames_.size(), values);
  // Parents may come after their children.
  for (bool progress = true; progress;) {
    progress = false;
    settled_ = true;
    for (std::size_t i = 0; i < frames_.size(); ++i) {
      const auto served = served_.find(frames_[i].id);
      if (served != served_.end() && served->second.parent == frames_[i].parent) continue;
      const bool placed = place(frames_[i], known[i]);
      progress = progress || placed;
      settled_ = settled_ && placed;
    }
  }
}

bool ReplayedPartition::place(const WatchedFrame& frame, const WatchedValue* value) {
  const Transform X_PC = value != nullptr ? value->X_PC : Transform();
  const bool moves = served_.count(frame.id) > 0;
  const auto placed = moves ? node_.move(frame.id, frame.parent, X_PC)
                            : node_.add(frame.id, frame.parent, X_PC, node_.partition());
  if (!placed) return false;
  served_[frame.id] = Edge{frame.parent, false, {}};
  return true;
}

Result<void> ReplayedPartition::flush() {
  if (batch_.empty()) return {};
  const std::vector<EdgeUpdate> batch = std::exchange(batch_, {});
  const auto updated = node_.update(batch, stamp_);
  if (updated) return {};
  if (updated.error().code == Errc::kPartitionTaken) return updated;
  // One that is rejected does not hold up the others.
  for (const EdgeUpdate& edge : batch) {
    auto one = node_.update(edge.id, edge.X_PC, stamp_);
    // An observation has corrected the sample.
    if (!one && one.error().code == Errc::kStampTaken) one = correct(edge);
    if (!one) ++rejected_;
  }
  return {};
}

Result<void> ReplayedPartition::correct(const EdgeUpdate& edge) {
  Query query;
  query.at = stamp_;
  const auto there = node_.lookup(served_[edge.id].parent, edge.id, query);
  const bool is_known = there && there->pose.matrix() == edge.X_PC.pose.matrix() &&
                        there->covariance == edge.X_PC.covariance;
  if (is_known) return {};
  return node_.rewrite(edge.id, {*stamp_, *stamp_}, {{*stamp_, edge.X_PC}});
}

// The value begins a history, so nothing before it holds any more.
void ReplayedPartition::begin(const WatchedFrame& frame, const WatchedValue& value, Edge& edge) {
  if (!edge.dynamic) return;
  if (value.stamp) {
    (void)node_.clear_history(frame.id);
  } else {
    (void)node_.move(frame.id, frame.parent, value.X_PC);
    edge = Edge{frame.parent, false, {}};
  }
}

void ReplayedPartition::clear(const std::string& id, const WatchedValue& value, Edge& edge) {
  // Only a sample makes an edge dynamic.
  if (!edge.dynamic) (void)node_.update(id, value.X_PC, Time{});
  edge.dynamic = true;
  (void)node_.clear_history(id);
}

Correlation ReplayedPartition::correlation_of(const WatchedValue& value, const std::string& id,
                                              Edge& edge) {
  const auto& tied = value.correlation.observed_with;
  const bool of_others =
      std::any_of(tied.begin(), tied.end(), [&](const std::string& other) { return other != id; });
  Correlation said = replayed(value.correlation);
  if (value.of_sample() && of_others) {
    const std::vector<CommonError> all = std::exchange(said.common_errors, {});
    if (edge.correlation) said = *edge.correlation;
    if (!all.empty()) edge.untied = value.stamp;
  }
  const bool keeps_untied =
      edge.untied && value.stamp && *value.stamp - *edge.untied <= EdgeTiming().span;
  said.unknown = value.correlation.unknown || keeps_untied;
  return said;
}

void ReplayedPartition::say(const std::string& id, Correlation correlation, Edge& edge) {
  if (edge.correlation && correlation == *edge.correlation) return;
  if (node_.correlate(id, correlation)) edge.correlation = std::move(correlation);
}

Transform ReplayedPartition::served_as(const WatchedValue& value, const Edge& edge) {
  return value.of_sample() ? whole(value, edge.correlation.value_or(Correlation())) : value.X_PC;
}

// The samples of the edge from this value on, which is the first of a rewritten past. Those that a
// replay does not keep are left out.
void ReplayedPartition::rewrite(const std::string& id, const ValuesNews& values, std::size_t first,
                                Edge& edge) {
  const WatchedValue& begin = values.values[first];
  std::vector<const WatchedValue*> told;
  for (std::size_t i = first; i < values.values.size(); ++i) {
    const WatchedValue& value = values.values[i];
    if (value.frame == begin.frame && value.stamp) told.push_back(&value);
  }
  Correlation said;
  for (const WatchedValue* value : told) said = correlation_of(*value, id, edge);
  say(id, std::move(said), edge);
  std::vector<EdgeSample> samples;
  for (const WatchedValue* value : told)
    samples.push_back({*value->stamp, served_as(*value, edge)});
  const EdgeTiming kept;  // the default
  const Time oldest = samples.back().stamp - kept.span;
  const auto from = std::find_if(samples.begin(), samples.end(),
                                 [&](const EdgeSample& sample) { return sample.stamp >= oldest; });
  const auto most = static_cast<std::ptrdiff_t>(kept.count);
  samples.erase(samples.begin(),
                std::max(from, samples.end() - std::min(most, samples.end() - from)));
  if (!node_.rewrite(id, {*begin.kept_before, Time::max()}, samples)) rejected_ += samples.size();
}

Result<void> ReplayedPartition::apply(const ValuesNews& values) {
  settle(values);
  std::set<std::uint32_t> rewritten;  // frames
  for (std::size_t i = 0; i < values.values.size(); ++i) {
    const WatchedValue& value = values.values[i];
    if (rewritten.count(value.frame) > 0) continue;
    if (value.frame >= frames_.size()) continue;
    const WatchedFrame& frame = frames_[value.frame];
    const auto served = served_.find(frame.id);
    if (served == served_.end() || frame.parent.empty()) continue;
    Edge& edge = served->second;
    Correlation correlation = correlation_of(value, frame.id, edge);
    const bool correlates = !edge.correlation || !(correlation == *edge.correlation);
    const bool plain = !correlates && !value.begins && !value.cleared;
    if (!plain || value.stamp != stamp_) {
      if (auto ok = flush(); !ok) return ok;
    }
    stamp_ = value.stamp;
    if (value.cleared) {
      clear(frame.id, value, edge);
      continue;
    }
    // The value that the edge was opened with is that of no instant, either; later it has none.
    if (value.unsampled) {
      if (edge.dynamic) clear(frame.id, value, edge);
      continue;
    }
    if (value.kept_before && value.stamp && edge.dynamic) {
      rewrite(frame.id, values, i, edge);
      rewritten.insert(value.frame);
      continue;
    }
    if (value.begins) begin(frame, value, edge);
    say(frame.id, std::move(correlation), edge);
    if (!value.stamp && edge.dynamic) continue;
    edge.dynamic = value.stamp.has_value();
    batch_.push_back({frame.id, served_as(value, edge)});
  }
  return flush();
}

}  // namespace tfdude::cli
