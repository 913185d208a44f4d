#pragma once

#include <chrono>

namespace tfdude {

/// How far the system's clock of one host is ahead of that of another.
struct ClockDifference {
  std::chrono::nanoseconds ahead{};  ///< negative: behind
  std::chrono::nanoseconds error{};  ///< the true difference is within +-error of it
};

}  // namespace tfdude
