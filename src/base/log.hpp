#pragma once

#include <spdlog/logger.h>

namespace tfdude {

/// The library's logger, "tfdude": standard error, warnings and above. A program may register a
/// logger of that name before, as the daemon does to show all events.
[[nodiscard]] spdlog::logger& log();

}  // namespace tfdude
