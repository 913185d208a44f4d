#pragma once

#include <cstddef>

namespace tfdude::faults {

/// Kills a daemon and starts it again, time and again, with a frame added in each round: it answers
/// and has all frames, and leaves no more files behind than after the first round. @return the exit
/// status
[[nodiscard]] int run_rounds(std::size_t rounds);

}  // namespace tfdude::faults
