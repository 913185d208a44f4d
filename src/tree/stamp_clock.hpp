#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <utility>

#include "tfdude/base/time.hpp"

#include "base/saturating.hpp"

namespace tfdude {

/// The clock by which a forest's writer judges stamps, if there is one. One writer at a time.
class StampClock {
 public:
  explicit StampClock(std::function<std::optional<Time>()> clock) : clock_(std::move(clock)) {}

  [[nodiscard]] bool is_there() const { return clock_ != nullptr; }

  /// Nothing while its time is not known.
  [[nodiscard]] std::optional<std::int64_t> now() const {
    const auto time = clock_();
    return time ? std::optional<std::int64_t>(nanoseconds(*time)) : std::nullopt;
  }

  /// Whether the last reading of the clock shows that the stamp is no further ahead than the limit
  /// [ns]. Not after kGoesFor stamps, as the clock may have been set back; nor after a jump, see
  /// is_of_before().
  [[nodiscard]] bool surely_admits(std::int64_t stamp, std::int64_t limit) {
    return ++asked_ago_ < kGoesFor && saturating_subtract(stamp, said_) <= limit;
  }

  /// As now(), for surely_admits().
  [[nodiscard]] std::optional<std::int64_t> read() {
    const auto time = now();
    if (!time) return time;
    if (*time >= before_jump_) before_jump_ = kNever;
    said_ = *time;
    asked_ago_ = has_jumped() ? kGoesFor : 0;
    return time;
  }

  /// The clock is read for the next stamp.
  void read_again() { asked_ago_ = kGoesFor; }

  /// The clock has jumped back from this time.
  void jumped_from(std::int64_t before) {
    before_jump_ = before;
    read_again();
  }
  /// Whether it has not reached the time before its last jump back again.
  [[nodiscard]] bool has_jumped() const { return before_jump_ != kNever; }
  /// Whether a stamp is of a sample that was on its way when the clock jumped back: then it is
  /// nearer to the time before the jump than to the present, and was not too far ahead of that
  /// time. Stamps that are later still are of another clock.
  [[nodiscard]] bool is_of_before(std::int64_t stamp, std::int64_t now) const {
    return has_jumped() && stamp - now > (before_jump_ - now) / 2 &&
           stamp - before_jump_ <= kMostAhead;
  }
  [[nodiscard]] std::int64_t before_jump() const { return before_jump_; }

 private:
  static constexpr int kGoesFor = 64;
  static constexpr std::int64_t kNever = INT64_MIN;
  static constexpr std::int64_t kMostAhead = 60'000'000'000;  // the default of max_ahead
  const std::function<std::optional<Time>()> clock_;
  std::int64_t said_ = 0;
  int asked_ago_ = kGoesFor;
  std::int64_t before_jump_ = kNever;
};

}  // namespace tfdude
