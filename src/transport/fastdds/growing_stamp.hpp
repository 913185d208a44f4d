#pragma once

#include <algorithm>
#include <cstdint>

namespace tfdude::fastdds {

/// Source timestamps of one writer's DDS samples, which grow even if the clock is set back. Fast
/// DDS 2.9 keeps the DDS samples of a reader in the order of their source timestamps, but searches
/// those of one writer in the order in which they were written. If these orders differ, as after a
/// step of the clock, it skips DDS samples, and then an assertion ends the process. Not
/// thread-safe.
class GrowingStamp {
 public:
  /// [ns]
  [[nodiscard]] std::int64_t next(std::int64_t clock) {
    // Coarser than the rounding of the message format, which has its own fractions of a second.
    constexpr std::int64_t kStep = 1000;
    return last_ = std::max(last_ + kStep, clock);
  }

 private:
  std::int64_t last_ = 0;
};

}  // namespace tfdude::fastdds
