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
  explicit StampClock(std::function<Time()> clock) : clock_(std::move(clock)) {}

  [[nodiscard]] bool is_there() const { return clock_ != nullptr; }
  [[nodiscard]] std::int64_t now() const { return nanoseconds(clock_()); }

  /// The clock's time if the stamp is further ahead of it than the limit [ns]; otherwise nothing.
  /// The clock is read again only if the last reading does not suffice, and after kGoesFor stamps,
  /// as it may have been set back.
  [[nodiscard]] std::optional<std::int64_t> refuses(std::int64_t stamp, std::int64_t limit) {
    if (++asked_ago_ < kGoesFor && saturating_subtract(stamp, said_) <= limit) return std::nullopt;
    said_ = now();
    asked_ago_ = 0;
    if (saturating_subtract(stamp, said_) <= limit) return std::nullopt;
    return said_;
  }

 private:
  static constexpr int kGoesFor = 64;
  const std::function<Time()> clock_;
  std::int64_t said_ = 0;
  int asked_ago_ = 0;
};

}  // namespace tfdude
