#pragma once

#include "tfdude/description/config.hpp"

#include "arguments.hpp"

namespace tfdude::daemon {

/// Prints what the daemon would serve, and what the configuration would change in the stored state.
/// Checks the keys, too. Joins no domain, and writes no file.
/// @return the exit status: 0, or kWrongUsage if the daemon would not start
[[nodiscard]] int check(const Arguments& arguments, const Config& config);

}  // namespace tfdude::daemon
