#pragma once

#include <algorithm>
#include <chrono>
#include <string>

#include "tfdude/base/time.hpp"

namespace tfdude {

/// When a call must be over. Made once, where the call begins, and handed down through all that it waits for. Steady
/// clock. A wait that reaches beyond the clock's range, as Milliseconds::max() does, has no end.
class Deadline {
 public:
  using Clock = std::chrono::steady_clock;

  /// @param wait  how long the call may take; of a negative one the end has come
  explicit Deadline(Milliseconds wait, Clock::time_point now = Clock::now())
      : wait_(std::max(wait, Milliseconds(0))), at_(sum(now, wait_)) {}

  /// This deadline, or one so long from now on where that is earlier.
  [[nodiscard]] Deadline within(Milliseconds wait, Clock::time_point now = Clock::now()) const {
    const Deadline other(wait, now);
    return other.at_ < at_ ? other : *this;
  }

  [[nodiscard]] Clock::time_point at() const { return at_; }
  [[nodiscard]] bool over(Clock::time_point now = Clock::now()) const { return now >= at_; }

  /// What the call was given, for people: "50 ms".
  [[nodiscard]] std::string text() const { return std::to_string(wait_.count()) + " ms"; }

  /// The later instant, or the end of the clock's range.
  [[nodiscard]] static Clock::time_point sum(Clock::time_point now, Milliseconds wait) {
    const auto left =
        std::chrono::floor<Milliseconds>(Clock::time_point::max().time_since_epoch()) -
        std::chrono::ceil<Milliseconds>(now.time_since_epoch());
    return wait < left ? now + wait : Clock::time_point::max();
  }

  /// The sum of two waits, or the longest.
  [[nodiscard]] static Milliseconds sum(Milliseconds a, Milliseconds b) {
    return a < Milliseconds::max() - b ? a + b : Milliseconds::max();
  }

 private:
  Milliseconds wait_;
  Clock::time_point at_;
};

}  // namespace tfdude
