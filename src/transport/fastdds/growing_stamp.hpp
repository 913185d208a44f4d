#pragma once

#include <algorithm>
#include <cstdint>

namespace tfdude::fastdds {

/// Source timestamps of one writer's samples, which grow whatever the clock does. Fast DDS 2.9 keeps the samples of a reader
/// in the order of their source timestamps and looks for those of one writer in the order in which they were written. Where
/// these differ, as after a step of the clock, it passes samples over, and then ends the process by an assertion. Not
/// thread-safe.
class GrowingStamp {
 public:
  /// [ns]
  [[nodiscard]] std::int64_t next(std::int64_t clock) {
    // Coarser than what the format, which has fractions of its own, may round to.
    constexpr std::int64_t kStep = 1000;
    return last_ = std::max(last_ + kStep, clock);
  }

 private:
  std::int64_t last_ = 0;
};

}  // namespace tfdude::fastdds
