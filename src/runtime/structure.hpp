#pragma once

#include <string>
#include <utility>

#include "base/mutex.hpp"
#include "partition/directory.hpp"
#include "tree/forest.hpp"

namespace tfdude {

/// A participant's knowledge of all frames, and the lock for those that change it or plan with it.
/// Lookups of values read the forest without it.
struct Structure {
  /// @param clock  for the forest
  /// @param own  the partition that this process serves; empty: none
  Structure(Forest::Clock clock, const std::string& own)
      : forest(std::move(clock)), directory(forest, own) {}

  Forest forest;
  Mutex mutex{LockRank::kStructure};  ///< also for writing structure in the forest
  Condition changed;                  ///< notified after each change
  Directory directory TFDUDE_GUARDED_BY(mutex);
};

}  // namespace tfdude
