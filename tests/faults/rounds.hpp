#pragma once

#include <cstddef>

namespace tfdude::faults {

/// Repeatedly kills and restarts a daemon, and adds a frame in each round. The daemon must answer,
/// have all frames, and leave no more files behind than after the first round.
/// @return the exit status
[[nodiscard]] int run_rounds(std::size_t rounds);

}  // namespace tfdude::faults
