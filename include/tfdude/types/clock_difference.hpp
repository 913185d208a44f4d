#pragma once

#include <chrono>

namespace tfdude {

/// How far the system's clock of one host is ahead of that of another.
struct ClockDifference {
  std::chrono::nanoseconds ahead{};  ///< negative: behind
  std::chrono::nanoseconds error{};  ///< the true difference is within +-error of it

  /// Whether the clocks differ for certain, and by more than this.
  [[nodiscard]] bool exceeds(std::chrono::nanoseconds tolerance) const {
    return std::chrono::abs(ahead) > tolerance + error;
  }
};

}  // namespace tfdude
