#pragma once

#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace tfdude {

// Waiting until a number in memory changes, also in that of another process, which one can only
// read (futex(2)). Nothing is lost: who waits says which number it has seen.

/// A number that is waited for, by its lower half.
struct WaitedNumber {
  const std::atomic<std::uint64_t>* number = nullptr;
  std::uint64_t seen = 0;
};

/// How many can be waited for at once.
inline constexpr std::size_t kMostWaitedNumbers = 128;

/// Whether this system can wait for several numbers: Linux 5.16, if nothing forbids it.
[[nodiscard]] bool can_wait_for_numbers();

/// Returns soon after one of the numbers has changed and its writer has called wake_waiting(), or
/// at that time; perhaps earlier.
void wait_for_numbers(const std::vector<WaitedNumber>& numbers,
                      std::chrono::steady_clock::time_point until);

/// Wakes all who wait for this number, in all processes.
void wake_waiting(const std::atomic<std::uint64_t>& number);

}  // namespace tfdude
