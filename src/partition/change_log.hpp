#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "tfdude/base/time.hpp"
#include "tfdude/types/change.hpp"

#include "partition/messages.hpp"

namespace tfdude {

/// The conflict that a tombstone describes. @param partition  the tombstone's owner
[[nodiscard]] Change conflict_of(const Tombstone& tombstone, const std::string& partition);

/// The restart of an edge's history. @param partition  its owner
[[nodiscard]] Change restarted(const HistoryRestart& restart, const std::string& partition);

/// A frame that waits for its parent.
/// @param partition  the frame's owner
/// @param dropped_by  the parent's former owner
[[nodiscard]] Change orphan_of(const FrameInfo& frame, const std::string& partition,
                               const std::string& dropped_by);

/// Changes of the structure, in order, for listeners. Not thread-safe.
class ChangeLog {
 public:
  /// Starts recording; nothing is recorded before.
  void watch() { watched_ = true; }
  [[nodiscard]] bool watched() const { return watched_; }

  void partition_up(const std::string& partition, const std::string& host, std::uint32_t pid);
  void partition_down(const std::string& partition, bool stopped);
  /// Another process serves it, and nobody has noticed that the former one is gone.
  void partition_replaced(const std::string& partition);
  void frame_added(std::string_view id, std::string_view parent, const std::string& partition);
  void frame_moved(std::string_view id, std::string_view parent, const std::string& partition);
  /// @param before  the former owner, which is unreachable
  void frame_taken_over(std::string_view id, std::string_view parent, const std::string& partition,
                        const std::string& before);
  void frame_removed(std::string_view id, const std::string& partition);

  /// Conflicts and orphans are always recorded, as the participants concerned log them.
  void add(Change change) { changes_.push_back(std::move(change)); }

  [[nodiscard]] std::vector<Change> take() { return std::exchange(changes_, {}); }

 private:
  void down(const std::string& partition, const char* what, bool stopped);

  bool watched_ = false;
  std::vector<Change> changes_;
};

}  // namespace tfdude
