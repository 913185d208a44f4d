#pragma once

#include "tfdude/description/config.hpp"

namespace tfdude {

/// @return kInvalidInput naming the place and frame: a parent that lies below it.
[[nodiscard]] Result<void> check_no_cycle(const Config& config);

}  // namespace tfdude
