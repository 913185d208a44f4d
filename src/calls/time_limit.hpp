#pragma once

#include <algorithm>
#include <chrono>
#include <string>

#include "tfdude/base/time.hpp"

namespace tfdude {

/// The end of a call's time, on a steady clock. A wait beyond the clock's range, such as
/// Milliseconds::max(), never ends.
class TimeLimit {
 public:
  using Clock = std::chrono::steady_clock;

  /// @param wait  if negative, the time is over
  TimeLimit(Milliseconds wait, Clock::time_point now)
      : wait_(std::max(wait, Milliseconds(0))), at_(sum(now, wait_)) {}

  [[nodiscard]] Clock::time_point at() const { return at_; }
  [[nodiscard]] bool over(Clock::time_point now) const { return now >= at_; }

  /// Its length, human-readable: "50 ms".
  [[nodiscard]] std::string text() const { return std::to_string(wait_.count()) + " ms"; }

  /// The later instant, at most the end of the clock's range.
  [[nodiscard]] static Clock::time_point sum(Clock::time_point now, Milliseconds wait) {
    const auto left =
        std::chrono::floor<Milliseconds>(Clock::time_point::max().time_since_epoch()) -
        std::chrono::ceil<Milliseconds>(now.time_since_epoch());
    return wait < left ? now + wait : Clock::time_point::max();
  }

  /// The sum of two waits, at most the maximum.
  [[nodiscard]] static Milliseconds sum(Milliseconds a, Milliseconds b) {
    return a < Milliseconds::max() - b ? a + b : Milliseconds::max();
  }

 private:
  Milliseconds wait_;
  Clock::time_point at_;
};

}  // namespace tfdude
