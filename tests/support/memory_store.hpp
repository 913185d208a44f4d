#pragma once

#include <map>
#include <string>
#include <utility>
#include <vector>

#include "partition/joints.hpp"
#include "partition/partition.hpp"
#include "partition/state_store.hpp"

namespace tfdude::testing {

/// A partition's state in memory, which outlives the partition.
class MemoryStore final : public StateStore {
 public:
  Result<StoredState> load() override {
    StoredState state{epoch_, {}, {}, configured_};
    for (const auto& [name, joint] : joints_) state.joints.push_back(joint);
    state.absent = absent_;
    state.configured_joints = joints_of(configured_);
    for (const auto& [id, frame] : frames_) state.frames.push_back(frame);
    for (const auto& [id, tombstone] : tombstones_) state.tombstones.push_back(tombstone);
    return state;
  }
  Result<void> save(const StateChange& change) override {
    epoch_ = change.epoch;
    if (change.absent) absent_ = *change.absent;
    for (const std::string& id : change.erased) {
      frames_.erase(id);
      tombstones_.erase(id);
    }
    for (const StoredFrame& frame : change.frames) frames_[frame.id] = frame;
    for (const Tombstone& tombstone : change.tombstones) tombstones_[tombstone.id] = tombstone;
    for (const std::string& name : change.erased_joints) joints_.erase(name);
    for (const StoredJoint& joint : change.joints) joints_[joint.name] = joint;
    if (change.configured) configured_ = *change.configured;
    for (const ChangedEdge& edge : change.values) {
      const auto there = frames_.find(edge.id);
      if (there == frames_.end()) continue;
      there->second.X_PC = edge.X_PC;
      there->second.correlation = edge.correlation;
      there->second.time = edge.time;
    }
    return {};
  }
  Result<void> make_room() override { return {}; }

 private:
  std::uint64_t epoch_ = 0;
  std::map<std::string, StoredFrame> frames_;
  std::map<std::string, Tombstone> tombstones_;
  std::map<std::string, StoredJoint> joints_;
  std::vector<Absent> absent_;
  std::vector<FrameSpec> configured_;
};

/// All that a partition must save, with its values.
/// @param values_due  as of Partition::take_unsaved()
[[nodiscard]] inline StateChange unsaved(Partition& partition, bool values_due = false) {
  StateChange change = partition.take_unsaved(values_due);
  partition.add_values(change);
  return change;
}

}  // namespace tfdude::testing
