#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "tfdude/types/frame.hpp"

#include "partition/messages.hpp"
#include "tree/forest.hpp"

namespace tfdude {

/// A frame with what outlives its process.
struct StoredFrame {
  std::string id;
  std::string parent;  ///< empty: a root
  Transform X_PC;      ///< its covariance is that of the edge's own part where it is correlated
  std::uint64_t lamport_time = 0;
  StoredCorrelation correlation{};
};

/// Where a joint was, by its last sample.
struct StoredJoint {
  std::string name;
  double position = 0;
  double variance = 0;
  std::optional<JointType> type{};  ///< of then; absent: it was stored without
};

/// All that outlives a partition's process.
struct StoredState {
  std::uint64_t epoch = 0;
  std::vector<StoredFrame> frames;
  std::vector<Tombstone> tombstones;
  /// What the configuration said when it was last taken: what it says since differs where somebody
  /// has changed it.
  std::vector<FrameSpec> configured;
  std::vector<StoredJoint> joints{};
  std::vector<Absent> absent{};  ///< whom the partition missed
};

/// What to change in a stored state.
struct StateChange {
  std::uint64_t epoch = 0;
  std::vector<std::string> erased;  ///< frames and tombstones; before the rest
  std::vector<StoredFrame> frames;
  std::vector<Tombstone> tombstones;
  std::vector<StoredJoint> joints{};  ///< new positions
  std::optional<std::vector<Absent>>
      absent{};  ///< all whom the partition misses, where that has changed

  [[nodiscard]] bool empty() const { return erased.empty() && !absent; }
};

/// Where a partition's state is kept. Not thread-safe.
class StateStore {
 public:
  virtual ~StateStore() = default;

  /// @return kState naming the file and what to do, where it cannot be read.
  [[nodiscard]] virtual Result<StoredState> load() = 0;

  /// All of it or nothing; what was saved survives the end of the process at any instant. @return kState.
  [[nodiscard]] virtual Result<void> save(const StateChange& change) = 0;

  /// New values of frames that are there, and of joints; of the others it is not told.
  [[nodiscard]] virtual Result<void> save_values(const std::vector<ChangedEdge>& edges,
                                                 const std::vector<StoredJoint>& joints) = 0;

  [[nodiscard]] virtual Result<void> save_configured(const std::vector<FrameSpec>& frames) = 0;
};

}  // namespace tfdude
