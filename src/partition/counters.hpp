#pragma once

#include <algorithm>
#include <cstdint>

namespace tfdude {

/// The end of the range of all numbers that are counted on from what others say: Lamport times,
/// numbers of processes, and epochs. No clock reaches it. A message with a number beyond it is
/// rejected, and a state file cannot have one.
inline constexpr std::uint64_t kLastCounter = std::uint64_t{1} << 63U;

/// The greatest number that a process can have. Its epochs are counted on from there.
inline constexpr std::uint64_t kLastIncarnation = kLastCounter - (std::uint64_t{1} << 40U);

/// The number that follows, which is within the range: at its end it stays the same, and the order
/// of equal Lamport times is that of names.
[[nodiscard]] constexpr std::uint64_t next_counter(std::uint64_t before) {
  return std::min(before, kLastCounter - 1) + 1;
}

}  // namespace tfdude
