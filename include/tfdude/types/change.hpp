#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "tfdude/base/export.hpp"
#include "tfdude/base/time.hpp"

namespace tfdude {

enum class ChangeKind : std::uint8_t {
  kPartitionUp,
  kPartitionDown,
  kFrameAdded,
  kFrameRemoved,
  kFrameMoved,  ///< is now under another parent, or has another owner
  kConflict,    ///< one of two partitions, or of two processes that serve one, had to yield
  /// The clock of an edge's source has jumped back; reported only by the owner's process.
  kHistoryRestarted,
  kFrameOrphaned,  ///< waits for its parent, which the parent's configuration no longer names
  /// Now belongs to a reachable partition, since its former owner is not reachable.
  kFrameTakenOver,
  kMissed,         ///< changes were not reported, because the listeners took too long
  kJointConflict,  ///< two partitions have a joint of one name
};

/// The stable snake_case name of a kind, as the command line prints it in JSON.
[[nodiscard]] TFDUDE_EXPORT std::string_view to_string(ChangeKind kind);

/// A change of the structure, as one participant saw it.
struct Change {
  ChangeKind kind = ChangeKind::kPartitionUp;
  std::string partition;  ///< the frame's owner; for a conflict, the one that yielded
  std::string frame;      ///< empty if the change concerns a partition
  std::string parent;     ///< of an added, moved or orphaned frame; empty: a root
  /// For a conflict: the partition that kept its claim. For an orphan: the former owner of its
  /// parent. For a frame taken over: its former owner. For joints of one name: the other owner.
  std::string rival;
  std::string message;  ///< human-readable
  Time time{};          ///< by the clock of the participant that saw it
  /// For a partition that is down: it announced its stop; otherwise it was lost.
  bool stopped = false;
  std::string joint{};  ///< of a conflict of joints
};

}  // namespace tfdude
