#pragma once

#include <cstddef>

namespace tfdude::faults {

/// Runs this many one-shot programs, four at once: each moves a joint that a daemon and an observer
/// in this process both have. Each must end with success, and both owners must drop it within two
/// seconds.
/// @return the exit status
[[nodiscard]] int run_endings(std::size_t programs);

}  // namespace tfdude::faults
