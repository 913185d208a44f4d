#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "tfdude/base/time.hpp"
#include "tfdude/partition/messages.hpp"

namespace tfdude {

enum class ChangeKind : std::uint8_t {
  kPartitionUp,
  kPartitionDown,
  kFrameAdded,
  kFrameRemoved,
  kFrameMoved,  ///< hangs elsewhere, or belongs to another partition
  kConflict,    ///< one of two partitions, or of two processes that serve one, had to give way
  kHistoryRestarted,  ///< of a frame's edge, whose source's clock has jumped back; told by its owner's process only
  kMissed,  ///< changes were not told, because the listeners took too long
};

/// The stable snake_case name of a kind, as the command line prints it in JSON.
[[nodiscard]] std::string_view to_string(ChangeKind kind);

/// Something that happened to the structure, as seen by one participant.
struct Change {
  ChangeKind kind = ChangeKind::kPartitionUp;
  std::string partition;  ///< concerned: the frame's owner; of a conflict, who gave way
  std::string frame;      ///< empty where it is about a partition
  std::string parent;     ///< of an added or moved frame; empty: a root
  std::string rival;      ///< of a conflict: the partition that was given way to
  std::string message;    ///< for people
  Time time{};            ///< by the clock of the participant that saw it
};

/// The conflict that a note tells of. @param partition  whose note it is
[[nodiscard]] Change conflict_of(const Note& note, const std::string& partition);

/// That the history of an edge has started again. @param partition  its owner
[[nodiscard]] Change restarted(const HistoryRestart& restart, const std::string& partition);

/// What happened, in the order in which it did, for those who want to know. Not thread-safe.
class ChangeLog {
 public:
  /// Nothing is kept before somebody wants it.
  void watch() { watched_ = true; }
  [[nodiscard]] bool watched() const { return watched_; }

  void partition_up(const std::string& partition, const std::string& host, std::uint32_t pid);
  void partition_down(const std::string& partition);
  void frame_added(std::string_view id, std::string_view parent, const std::string& partition);
  void frame_moved(std::string_view id, std::string_view parent, const std::string& partition);
  void frame_removed(std::string_view id, const std::string& partition);

  /// A conflict is kept always: whoever had to give way logs it.
  void add(Change change) { changes_.push_back(std::move(change)); }

  [[nodiscard]] std::vector<Change> take() { return std::exchange(changes_, {}); }

 private:
  bool watched_ = false;
  std::vector<Change> changes_;
};

}  // namespace tfdude
