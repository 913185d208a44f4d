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
  kFrameMoved,  ///< hangs elsewhere, or belongs to another partition
  kConflict,    ///< one of two partitions, or of two processes that serve one, had to yield
  kHistoryRestarted,  ///< of a frame's edge, whose source's clock has jumped back; told by its owner's process only
  kFrameOrphaned,   ///< waits for its parent, which that one's configuration names no more
  kFrameTakenOver,  ///< belongs to a partition that is there, since the one that had it is not
  kMissed,          ///< changes were not told, because the listeners took too long
};

/// The stable snake_case name of a kind, as the command line prints it in JSON.
[[nodiscard]] TFDUDE_EXPORT std::string_view to_string(ChangeKind kind);

/// Something that happened to the structure, as seen by one participant.
struct Change {
  ChangeKind kind = ChangeKind::kPartitionUp;
  std::string partition;  ///< concerned: the frame's owner; of a conflict, who yielded
  std::string frame;      ///< empty where it is about a partition
  std::string parent;     ///< of an added, moved or orphaned frame; empty: a root
  /// Of a conflict: the partition that was yielded to; of an orphan: who had its parent; of a frame taken over: the
  /// one that had it.
  std::string rival;
  std::string message;   ///< for people
  Time time{};           ///< by the clock of the participant that saw it
  bool stopped = false;  ///< of a partition that is down: it has said so; else it was lost
};

}  // namespace tfdude
