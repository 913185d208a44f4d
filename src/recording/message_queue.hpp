#pragma once

#include <cstddef>
#include <variant>
#include <vector>

#include "tfdude/base/time.hpp"

#include "recording/messages.hpp"

namespace tfdude::recording {

/// A message of a recording, ours or that of ROS. The edges of its values are those of its cursor.
struct RecordedMessage {
  Time log;
  std::variant<RecordedFrames, RecordedValues, RecordedJoints, Change> what;
  bool foreign = false;  ///< transforms without frames and owners, which its values imply
};

/// Messages of a chunk, to be taken one after the other. Reuses the memory of those that were in it
/// before.
class MessageQueue {
 public:
  [[nodiscard]] bool empty() const { return next_ == count_; }
  [[nodiscard]] RecordedMessage& front() { return messages_[next_]; }
  /// The message stays until the queue is cleared.
  void pop() { ++next_; }

  /// Adds a message, with any content.
  [[nodiscard]] RecordedMessage& add() {
    if (count_ == messages_.size()) messages_.emplace_back();
    return messages_[count_++];
  }
  void drop_last() { --count_; }
  void clear() { next_ = count_ = 0; }

  // Those that were not taken.
  [[nodiscard]] auto begin() { return messages_.begin() + static_cast<std::ptrdiff_t>(next_); }
  [[nodiscard]] auto end() { return messages_.begin() + static_cast<std::ptrdiff_t>(count_); }

 private:
  std::vector<RecordedMessage> messages_;
  std::size_t next_ = 0;
  std::size_t count_ = 0;
};

}  // namespace tfdude::recording
