#pragma once

#include <algorithm>
#include <chrono>
#include <memory>
#include <optional>
#include <string_view>
#include <vector>

#include "tfdude/types/many.hpp"

#include "base/saturating.hpp"
#include "recording/cursor.hpp"
#include "recording/state.hpp"

namespace tfdude::recording {

/// Reads a recording: shows what was known at one instant, and answers lookups by reading on, or
/// once more from an earlier place.
/// @par Thread safety  One thread at a time.
class Reading {
 public:
  /// Shows the end. The first and the last message are of these instants.
  Reading(Cursor cursor, Time begin, Time end)
      : cursor_(std::move(cursor)), begin_(begin), end_(end) {
    load(end, kHistory);
  }

  [[nodiscard]] Cursor& cursor() { return cursor_; }
  [[nodiscard]] const Cursor& cursor() const { return cursor_; }
  [[nodiscard]] const State& state() const { return *state_; }
  [[nodiscard]] Time instant() const { return now_; }

  void seek(Time at);
  /// As Recording::instant_for().
  [[nodiscard]] Time instant_for(Time stamp) const {
    return stamp < earlier_by(begin_, kHistory) ? end_ : stamp;
  }
  /// Goes to the next message. @return it, until anything else is called; null at the end
  const RecordedMessage* step();
  /// As of State, of the message that step() has returned.
  [[nodiscard]] std::vector<PartitionNews> news_of(const RecordedMessage& message) {
    return state_->news_of(message);
  }
  /// Shows the instant again, after the cursor has been elsewhere.
  void load_again() { load(now_, span_); }

  /// As those of Recording.
  [[nodiscard]] Result<StampedTransform> lookup(std::string_view a, std::string_view b,
                                                const Query& query);
  [[nodiscard]] Result<StampedTransform> lookup_at(std::string_view a, std::string_view b,
                                                   Query query, Time at, Milliseconds wait);
  [[nodiscard]] Trajectory trajectory(std::string_view a, std::string_view b,
                                      const std::vector<Time>& instants, const Query& query,
                                      Milliseconds wait);

 private:
  class Instants;

  // How much is read before an instant, at first: as much as live histories have.
  static constexpr std::chrono::seconds kHistory{10};

  // Partitions that are discovered within this time from the beginning on were there before.
  static constexpr std::chrono::seconds kDiscovery{1};

  void load(Time at, std::chrono::nanoseconds span);
  void advance(Time at);
  // Whether there are keyframes between what is shown and what an instant needs.
  [[nodiscard]] bool skips_to(Time at) const;
  // Whether the structure in which frames are looked up at a place ends with a message.
  [[nodiscard]] bool ends_with(const RecordedMessage& next, std::string_view a, std::string_view b,
                               Time place) const {
    return state_->changes_path(next, a, b, std::max(place, begin_ + kDiscovery));
  }

  Cursor cursor_;
  Time begin_;
  Time end_;
  std::unique_ptr<State> state_;
  Time now_{};
  std::chrono::nanoseconds span_ = kHistory;  // how much was read before the instant
};

/// Whether later data may give an answer.
[[nodiscard]] inline bool may_come(Errc code) {
  return code == Errc::kNotYet || code == Errc::kNotConnected || code == Errc::kUnreachable ||
         is_unknown(code);
}

/// Whether a message comes too late for a lookup at an instant that waits so long.
[[nodiscard]] inline bool is_late(Time message, Time at, Milliseconds wait) {
  return std::chrono::duration_cast<Milliseconds>(message - at) > wait;
}

}  // namespace tfdude::recording
