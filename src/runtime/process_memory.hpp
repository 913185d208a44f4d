#pragma once

#include <memory>
#include <string>

#include "memory/port.hpp"
#include "tree/arena.hpp"

namespace tfdude {

/// The memory of a participant's forest, and how that of others is read.
struct ProcessMemory {
  std::unique_ptr<SharedMemory> port;  ///< null: no memory is shared
  std::shared_ptr<Arena> arena;        ///< of what others may read; null: the heap
  std::string why_not;                 ///< if others cannot read

  /// @param wanted  Options::shared_memory
  /// @param owns  whether there will be something to read
  [[nodiscard]] static ProcessMemory open(bool wanted, bool owns);
};

}  // namespace tfdude
