#pragma once

#include "tfdude/description/config.hpp"

namespace tfdude {

/// @return kInvalidInput naming place and frame: its parent is the frame itself or lies below it.
[[nodiscard]] Result<void> check_no_cycle(const Config& config);

}  // namespace tfdude
