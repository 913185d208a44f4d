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
  /// [ns]. Not after kGoesFor stamps, as the clock may have been set back.
  [[nodiscard]] bool surely_admits(std::int64_t stamp, std::int64_t limit) {
    return ++asked_ago_ < kGoesFor && saturating_subtract(stamp, said_) <= limit;
  }

  /// As now(), for surely_admits().
  [[nodiscard]] std::optional<std::int64_t> read() {
    const auto time = now();
    if (!time) return time;
    said_ = *time;
    asked_ago_ = 0;
    return time;
  }

  /// The clock is read for the next stamp.
  void read_again() { asked_ago_ = kGoesFor; }

 private:
  static constexpr int kGoesFor = 64;
  const std::function<std::optional<Time>()> clock_;
  std::int64_t said_ = 0;
  int asked_ago_ = kGoesFor;
};

}  // namespace tfdude
