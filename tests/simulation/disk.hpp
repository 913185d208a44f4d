#pragma once

#include "support/memory_store.hpp"

namespace tfdude::simulation {

/// The stored state of a daemon, which outlives its process, and whether there is room for more.
struct Disk {
  testing::MemoryStore store;
  bool full = false;

  [[nodiscard]] Result<void> save(const StateChange& rows) {
    if (full) return fail(Errc::kState, "the disk is full");
    return rows.empty() ? Result<void>() : store.save(rows);
  }
};

}  // namespace tfdude::simulation
