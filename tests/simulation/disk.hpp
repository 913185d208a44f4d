#pragma once

#include <cstdint>

#include "support/memory_store.hpp"

namespace tfdude::simulation {

/// The stored state of a daemon, which outlives its process, and whether there is room for more.
struct Disk {
  testing::MemoryStore store;
  bool full = false;

  std::uint64_t epoch = 0;  ///< of the structure that is stored

  [[nodiscard]] Result<void> save(const StateChange& rows) {
    if (full) return fail(Errc::kState, "the disk is full");
    if (rows.empty()) return {};
    epoch = rows.epoch;
    return store.save(rows);
  }
};

}  // namespace tfdude::simulation
