#pragma once

#include <string>
#include <utility>

#include "base/mutex.hpp"
#include "partition/directory.hpp"
#include "tree/forest.hpp"

namespace tfdude {

/// What a participant knows of all frames, and the lock of those who change or plan by it. Lookups of values read the forest
/// without it.
struct Structure {
  /// @param clock  of the forest
  /// @param own  the partition that this process serves; empty: none
  Structure(Forest::Clock clock, const std::string& own)
      : forest(std::move(clock)), directory(forest, own) {}

  Forest forest;
  Mutex mutex;        ///< of the directory, and of the structure in the forest
  Condition changed;  ///< told after each change
  Directory directory;
};

}  // namespace tfdude
