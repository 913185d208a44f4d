#pragma once

#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "tfdude/types/frame.hpp"

#include "partition/messages.hpp"
#include "tree/forest.hpp"

namespace tfdude {

/// The stored data of a frame.
struct StoredFrame {
  std::string id;
  std::string parent;  ///< empty: a root
  Transform X_PC;      ///< if the edge is correlated, the covariance is that of its own part
  std::uint64_t lamport_time = 0;
  StoredCorrelation correlation{};
  StoredTime time{};
};

/// A joint's position at its last sample.
struct StoredJoint {
  std::string name;
  double position = 0;
  std::optional<double> variance{};  ///< absent: unspecified
  std::optional<JointType> type{};   ///< at that time; absent: not stored
};

/// The stored state of a partition.
struct StoredState {
  std::uint64_t epoch = 0;
  std::vector<StoredFrame> frames;
  std::vector<Tombstone> tombstones;
  /// The configuration that was last loaded. Differences from the current one are edits.
  std::vector<FrameSpec> configured;
  /// Of an earlier version, for which an entry without a covariance was exact.
  bool omitted_was_exact = false;
  std::vector<StoredJoint> joints{};
  std::vector<Absent> absent{};  ///< partitions that this one missed
  /// The joints of the entries that have one, by the ids of their frames; without a name: an
  /// earlier version did not store it.
  std::map<std::string, PageJoint> configured_joints{};
  /// Entries of which only the id is known, because what they said was damaged.
  std::set<std::string> unknown_entries{};
};

/// A change of the stored state. With whatever is stored, the values of all edges are, as of the
/// same moment: so a crash never leaves half of what one update has written.
struct StateChange {
  std::uint64_t epoch = 0;
  std::vector<std::string> erased;  ///< frames and tombstones; applied before the rest
  std::vector<StoredFrame> frames;
  std::vector<Tombstone> tombstones;
  std::vector<StoredJoint> joints{};  ///< new positions
  std::optional<std::vector<Absent>>
      absent{};                       ///< all partitions that this one misses, if that has changed
  std::vector<ChangedEdge> values{};  ///< of existing frames; applied after the frames
  CommitRange commits{};              ///< which have written these values
  std::optional<std::vector<FrameSpec>> configured{};  ///< the configuration, at the start
  std::vector<std::string> erased_joints{};            ///< applied before the new positions
  /// It has a number of this process that others will know: it must survive a power loss, too.
  bool synced = false;

  [[nodiscard]] bool empty() const {
    return erased.empty() && joints.empty() && !absent && values.empty() && !configured &&
           erased_joints.empty();
  }
};

/// The storage of a partition's state. Not thread-safe.
class StateStore {
 public:
  virtual ~StateStore() = default;

  /// @return kState naming the file and a remedy, if it cannot be read.
  [[nodiscard]] virtual Result<StoredState> load() = 0;

  /// Saves all of it or nothing. Saved changes survive the end of the process at any instant; the
  /// first change of a process, and one that says so, survive a power loss, too.
  /// @return kState.
  [[nodiscard]] virtual Result<void> save(const StateChange& change) = 0;

  /// Sets room aside for the next change: one that is applied is not undone if it cannot be saved.
  /// @return kState: there is none, so no change should be made.
  [[nodiscard]] virtual Result<void> make_room() = 0;
};

}  // namespace tfdude
