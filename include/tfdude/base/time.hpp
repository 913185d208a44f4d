#pragma once

#include <chrono>
#include <cstdint>
#include <string>

#include "tfdude/base/export.hpp"

namespace tfdude {

/// Instant in nanoseconds since the UNIX epoch, or since the start of a simulation. Most layers get
/// the time as an argument; only `client`, `runtime` and `transport` read the clock.
using Time = std::chrono::time_point<std::chrono::system_clock, std::chrono::nanoseconds>;

using Milliseconds = std::chrono::milliseconds;

/// The clock of a simulation or a replay. It is none of this computer, so it has no now(), and its
/// times are of a type of their own: those of the system's clock do not compile in their place.
struct ExternalClock {
  // NOLINTBEGIN(readability-identifier-naming): the names that <chrono> gives to what a clock has
  using duration = std::chrono::nanoseconds;
  using rep = duration::rep;
  using period = duration::period;
  using time_point = std::chrono::time_point<ExternalClock>;
  static constexpr bool is_steady = false;
  // NOLINTEND(readability-identifier-naming)
};
/// Time since the start of a simulation: `ExternalTime(20ms)`.
using ExternalTime = ExternalClock::time_point;

/// As a stamp, which calls take of both clocks.
[[nodiscard]] constexpr Time stamp_of(ExternalTime time) { return Time(time.time_since_epoch()); }
/// A stamp that is of an external clock, as in a replay.
[[nodiscard]] constexpr ExternalTime external_time(Time stamp) {
  return ExternalTime(stamp.time_since_epoch());
}

/// The clock that a participant's stamps are of.
enum class ClockKind : std::uint8_t {
  kSystem,
  kExternal,  ///< its time comes from outside: it may start at 0, run at any rate, stop, jump back
};

/// "system" or "external".
[[nodiscard]] TFDUDE_EXPORT const char* to_string(ClockKind kind);

/// As sent and stored: nanoseconds since the epoch of the clock.
[[nodiscard]] inline std::int64_t nanoseconds(Time time) { return time.time_since_epoch().count(); }
[[nodiscard]] inline Time time_of(std::int64_t nanoseconds) {
  return Time(std::chrono::nanoseconds(nanoseconds));
}

/// For people: "12.3 ms", "0.004 ms".
[[nodiscard]] TFDUDE_EXPORT std::string in_milliseconds(std::chrono::nanoseconds duration);

/// For people: "2026-11-21 14:03:59.125 UTC".
[[nodiscard]] TFDUDE_EXPORT std::string to_string(Time time);

/// For people, in the unit that fits: "12.300 ms", "4.500 s", "15.2 s", "3.5 min", "7.0 h", "2.5
/// days".
[[nodiscard]] TFDUDE_EXPORT std::string readable(std::chrono::nanoseconds duration);

/// A stamp for people: as to_string(), but "15.200 s" if it is of a clock that started at 0, as
/// that of a simulation.
[[nodiscard]] TFDUDE_EXPORT std::string readable(Time stamp);

}  // namespace tfdude
