#pragma once

#include <cstdint>
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
};

/// A joint's position at its last sample.
struct StoredJoint {
  std::string name;
  double position = 0;
  double variance = 0;
  std::optional<JointType> type{};  ///< at that time; absent: not stored
};

/// The stored state of a partition.
struct StoredState {
  std::uint64_t epoch = 0;
  std::vector<StoredFrame> frames;
  std::vector<Tombstone> tombstones;
  /// The configuration that was last loaded. Differences from the current one are edits.
  std::vector<FrameSpec> configured;
  std::vector<StoredJoint> joints{};
  std::vector<Absent> absent{};  ///< partitions that this one missed
};

/// A change of the stored state.
struct StateChange {
  std::uint64_t epoch = 0;
  std::vector<std::string> erased;  ///< frames and tombstones; applied before the rest
  std::vector<StoredFrame> frames;
  std::vector<Tombstone> tombstones;
  std::vector<StoredJoint> joints{};  ///< new positions
  std::optional<std::vector<Absent>>
      absent{};  ///< all partitions that this one misses, if that has changed

  [[nodiscard]] bool empty() const { return erased.empty() && !absent; }
};

/// The storage of a partition's state. Not thread-safe.
class StateStore {
 public:
  virtual ~StateStore() = default;

  /// @return kState naming the file and a remedy, if it cannot be read.
  [[nodiscard]] virtual Result<StoredState> load() = 0;

  /// Saves all of it or nothing. Saved changes survive the end of the process at any instant.
  /// @return kState.
  [[nodiscard]] virtual Result<void> save(const StateChange& change) = 0;

  /// New values of existing frames, and of joints; the others are unchanged.
  [[nodiscard]] virtual Result<void> save_values(const std::vector<ChangedEdge>& edges,
                                                 const std::vector<StoredJoint>& joints) = 0;

  [[nodiscard]] virtual Result<void> save_configured(const std::vector<FrameSpec>& frames) = 0;
};

}  // namespace tfdude
