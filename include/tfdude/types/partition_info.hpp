#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

#include "tfdude/base/time.hpp"

namespace tfdude {

/// Information about one partition.
struct PartitionInfo {
  std::string name;
  std::string host;
  std::uint32_t pid = 0;
  std::size_t frames = 0;
  bool reachable = false;
  Time since{};          ///< when `reachable` last changed, by the caller's clock
  bool stopped = false;  ///< if not reachable: it announced its stop; otherwise it was lost
};

/// "was stopped" or "is lost", for a partition that is not reachable.
[[nodiscard]] inline const char* why_absent(const PartitionInfo& partition) {
  return partition.stopped ? "was stopped" : "is lost";
}

}  // namespace tfdude
