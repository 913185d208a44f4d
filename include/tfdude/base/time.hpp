#pragma once

#include <chrono>
#include <string>

namespace tfdude {

/// Wall-clock instant in nanoseconds since the UNIX epoch. Logic is handed one; only `client` and
/// `transport` read the clock.
using Time = std::chrono::time_point<std::chrono::system_clock, std::chrono::nanoseconds>;

using Milliseconds = std::chrono::milliseconds;

/// For people: "2026-11-21 14:03:59.125 UTC".
[[nodiscard]] std::string to_string(Time time);

}  // namespace tfdude
