#pragma once

#include <chrono>
#include <cstdint>
#include <limits>

#include "tfdude/base/time.hpp"

// Saturating arithmetic on instants and durations: it returns the limit of the type instead of
// overflowing. Outside values may be any number.
namespace tfdude {

[[nodiscard]] constexpr std::int64_t end_of_range(bool negative) {
  using Limits = std::numeric_limits<std::int64_t>;
  return negative ? Limits::min() : Limits::max();
}

[[nodiscard]] constexpr std::int64_t saturating_add(std::int64_t a, std::int64_t b) {
  std::int64_t sum = 0;
  return __builtin_add_overflow(a, b, &sum) ? end_of_range(a < 0) : sum;
}

[[nodiscard]] constexpr std::int64_t saturating_subtract(std::int64_t a, std::int64_t b) {
  std::int64_t difference = 0;
  return __builtin_sub_overflow(a, b, &difference) ? end_of_range(a < 0) : difference;
}

/// The instant `duration` later.
[[nodiscard]] inline Time later_by(Time time, std::chrono::nanoseconds duration) {
  return time_of(saturating_add(nanoseconds(time), duration.count()));
}

[[nodiscard]] inline Time earlier_by(Time time, std::chrono::nanoseconds duration) {
  return time_of(saturating_subtract(nanoseconds(time), duration.count()));
}

/// The time from `earlier` to `later`.
[[nodiscard]] inline std::chrono::nanoseconds apart(Time earlier, Time later) {
  return std::chrono::nanoseconds(saturating_subtract(nanoseconds(later), nanoseconds(earlier)));
}

}  // namespace tfdude
