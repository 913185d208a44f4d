#pragma once

#include <chrono>

namespace tfdude {

/// Wall-clock instant in nanoseconds since the UNIX epoch. Logic is handed one; only `client` and
/// `transport` read the clock.
using Time = std::chrono::time_point<std::chrono::system_clock, std::chrono::nanoseconds>;

using Milliseconds = std::chrono::milliseconds;

}  // namespace tfdude
