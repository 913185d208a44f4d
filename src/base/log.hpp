#pragma once

#include <spdlog/logger.h>

namespace tfdude {

/// The library's logger, "tfdude", on standard error, from warnings upwards; a program may register one of that
/// name before, as the daemon does to see all events.
[[nodiscard]] spdlog::logger& log();

}  // namespace tfdude
