#include "recording/recorder.hpp"

#include <algorithm>

#include "recording/messages.hpp"
#include "types/ros_tf.hpp"

namespace tfdude::recording {
namespace {

std::size_t place_of(const std::vector<WatchedFrame>& frames, const WatchedFrame& frame) {
  const auto found =
      std::lower_bound(frames.begin(), frames.end(), frame,
                       [](const WatchedFrame& a, const WatchedFrame& b) { return a.id < b.id; });
  return static_cast<std::size_t>(found - frames.begin());
}

// Whether it holds for all times.
bool is_static(const WatchedValue& value) {
  return !value.stamp && !value.cleared && !value.unsampled;
}

}  // namespace

Result<void> Recorder::put(Topic topic, Time now, std::optional<Time> publish) {
  return out_({topic, now, publish.value_or(now), message_});
}

std::size_t Recorder::edges() const {
  std::size_t count = 0;
  for (const auto& [name, known] : partitions_) count += known.frames.size();
  return count;
}

Result<void> Recorder::add(const PartitionNews& news, Time now) {
  Known& known = partitions_[news.partition];
  if (const auto* reached = std::get_if<ReachNews>(&news.what)) {
    return reach(news.partition, known, *reached, now);
  }
  if (const auto* frames = std::get_if<FramesNews>(&news.what)) {
    return change(news.partition, known, *frames, now);
  }
  return write(news.partition, known, std::get<ValuesNews>(news.what), now);
}

Result<void> Recorder::reach(const std::string& name, Known& known, const ReachNews& news,
                             Time now) {
  known.reachable = news.reachable;
  known.why = news.why;
  encode({name, known.incarnation, known.reachable, known.why, false, false, {}, {}}, message_);
  return put(Topic::kFrames, now);
}

Result<void> Recorder::change(const std::string& name, Known& known, const FramesNews& news,
                              Time now) {
  const auto before = std::exchange(known.frames, news.frames);
  auto edges = std::exchange(known.edges, std::vector<Edge>(news.frames.size()));
  RecordedFrames changed{name, news.incarnation, known.reachable, known.why, false, false, {}, {}};
  changed.complete = news.incarnation != std::exchange(known.incarnation, news.incarnation);
  std::vector<bool> stays(before.size(), false);
  for (std::size_t i = 0; i < news.frames.size(); ++i) {
    const WatchedFrame& frame = news.frames[i];
    const std::size_t place = place_of(before, frame);
    const bool there = place < before.size() && before[place].id == frame.id;
    if (there) stays[place] = true;
    // The values of an earlier process are not those of this one.
    const bool same = there && before[place] == frame && !changed.complete;
    if (same) known.edges[i] = std::move(edges[place]);
    if (!same || changed.complete) changed.frames.push_back(frame);
  }
  for (std::size_t i = 0; i < before.size(); ++i) {
    if (!stays[i]) changed.removed.push_back(before[i].id);
  }
  statics_changed_ = true;
  encode(changed, message_);
  return put(Topic::kFrames, now);
}

Result<void> Recorder::write(const std::string& name, Known& known, const ValuesNews& news,
                             Time now) {
  ValuesEncoder encoder(message_, name, news.commit, false);
  std::optional<Time> publish;
  for (const WatchedValue& value : news.values) {
    if (value.frame >= known.frames.size()) continue;
    Edge& edge = known.edges[value.frame];
    const StatedCovariance& covariance = value.X_PC.covariance;
    const bool as_before = covariance.complete() && !value.begins && edge.written &&
                           edge.written->upper() == covariance.of_specified().upper();
    encoder.add(known.frames[value.frame], value, as_before);
    if (covariance.complete() && !as_before) edge.written = covariance.of_specified();
    publish = std::max(publish, value.stamp);
    if (is_static(value)) statics_changed_ = true;
    const bool late =
        !value.begins && !value.cleared && edge.newest && value.stamp < edge.newest->stamp;
    if (late) {
      const bool of_samples = value.of_sample() || edge.newest->of_sample();
      if (!of_samples) edge.newest->correlation = value.correlation;
      continue;
    }
    // A static edge that becomes dynamic is no longer one of the statics.
    if (edge.newest && is_static(*edge.newest) && value.stamp) statics_changed_ = true;
    if (!edge.newest) edge.newest.emplace().begins = Covariance();
    WatchedValue& newest = *edge.newest;
    newest.stamp = value.stamp;
    newest.X_PC = value.X_PC;
    newest.correlation = value.correlation;
    newest.cleared = value.cleared;
    newest.unsampled = value.unsampled;
    if (!value.begins) continue;
    newest.begins = value.begins;
    newest.drifts = value.drifts;
  }
  encoder.finish();
  if (auto ok = put(Topic::kValues, now, publish); !ok) return ok;
  return write_tf(known, news, now);
}

Result<void> Recorder::write_tf(const Known& known, const ValuesNews& news, Time now) {
  ros::TfEncoder encoder(message_);
  std::optional<Time> publish;
  for (const WatchedValue& value : news.values) {
    if (!value.stamp || value.frame >= known.frames.size()) continue;
    const WatchedFrame& edge = known.frames[value.frame];
    encoder.add(edge.parent, edge.id, value.X_PC.pose, *value.stamp);
    publish = std::max(publish, value.stamp);
  }
  if (encoder.count() == 0) return {};
  encoder.finish();
  return put(Topic::kTf, now, publish);
}

Result<void> Recorder::write_statics(Time now) {
  if (!std::exchange(statics_changed_, false)) return {};
  ros::TfEncoder encoder(message_);
  for (const auto& [name, known] : partitions_) {
    for (std::size_t i = 0; i < known.edges.size(); ++i) {
      const auto& value = known.edges[i].newest;
      if (!value || !is_static(*value)) continue;
      encoder.add(known.frames[i].parent, known.frames[i].id, value->X_PC.pose, now);
    }
  }
  encoder.finish();
  return put(Topic::kTfStatic, now);
}

Result<void> Recorder::add(const std::string& partition, const std::vector<JointInfo>& joints,
                           Time now) {
  Known& known = partitions_[partition];
  encode({partition, false, joints}, message_);
  if (message_ == known.joints || (joints.empty() && known.joints.empty())) return {};
  known.joints = message_;
  return put(Topic::kJoints, now);
}

Result<void> Recorder::add(const Change& change, Time now) {
  encode(change, message_);
  return put(Topic::kEvents, now, change.time);
}

Result<void> Recorder::repeat(const std::string& name, Known& known, Time now) {
  encode({name, known.incarnation, known.reachable, known.why, true, true, known.frames, {}},
         message_);
  if (auto ok = put(Topic::kFrames, now); !ok) return ok;
  ValuesEncoder encoder(message_, name, 0, true);
  for (std::size_t i = 0; i < known.edges.size(); ++i) {
    Edge& edge = known.edges[i];
    // A reader that starts here has no covariance but those that follow.
    edge.written.reset();
    if (!edge.newest) continue;
    encoder.add(known.frames[i], *edge.newest, false);
    const StatedCovariance& covariance = edge.newest->X_PC.covariance;
    if (covariance.complete()) edge.written = covariance.of_specified();
  }
  encoder.finish();
  if (auto ok = put(Topic::kValues, now); !ok || known.joints.empty()) return ok;
  auto joints = decode_joints(known.joints);
  if (!joints) return tl::unexpected(std::move(joints.error()));
  joints->repeats = true;
  encode(*joints, message_);
  return put(Topic::kJoints, now);
}

Result<void> Recorder::keyframe(Time now) {
  encode_keyframe(false, message_);
  if (auto ok = put(Topic::kKeyframe, now); !ok) return ok;
  for (auto& [name, known] : partitions_) {
    if (auto ok = repeat(name, known, now); !ok) return ok;
  }
  statics_changed_ = !partitions_.empty();
  if (auto ok = write_statics(now); !ok) return ok;
  encode_keyframe(true, message_);
  return put(Topic::kKeyframe, now);
}

}  // namespace tfdude::recording
