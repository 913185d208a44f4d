#pragma once

#include <chrono>

#include "tfdude/base/time.hpp"

namespace tfdude {

/// The clock for stamps of this process.
inline Time wall_clock() {
  return std::chrono::time_point_cast<Time::duration>(std::chrono::system_clock::now());
}

}  // namespace tfdude
