#pragma once

#include <cstdint>

#include <spdlog/logger.h>

namespace tfdude {

/// The library's logger, "tfdude": standard error, warnings and above. A program may register a
/// logger of that name before, as the daemon does to show all events.
[[nodiscard]] spdlog::logger& log();

/// Whether to log what has happened so many times, and may go on: the 1st, 2nd, 4th, 8th... time.
[[nodiscard]] constexpr bool is_logged(std::uint64_t times) { return (times & (times - 1)) == 0; }

}  // namespace tfdude
