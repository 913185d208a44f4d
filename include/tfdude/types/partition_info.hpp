#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

#include "tfdude/base/time.hpp"

namespace tfdude {

/// What is known of one partition.
struct PartitionInfo {
  std::string name;
  std::string host;
  std::uint32_t pid = 0;
  std::size_t frames = 0;
  bool reachable = false;
  Time since{};          ///< reachable or not since then, by the caller's clock
  bool stopped = false;  ///< of one that is not reachable: it has said so; else it was lost
};

/// "was stopped" or "is lost", of a partition that is not reachable.
[[nodiscard]] inline const char* why_absent(const PartitionInfo& partition) {
  return partition.stopped ? "was stopped" : "is lost";
}

}  // namespace tfdude
