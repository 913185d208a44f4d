#pragma once

#include <spdlog/logger.h>

namespace tfdude {

/// The library's logger, "tfdude", on standard error; a program may register one of that name before.
[[nodiscard]] spdlog::logger& log();

}  // namespace tfdude
