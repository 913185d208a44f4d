#pragma once

#include <condition_variable>
#include <mutex>
#include <string>
#include <utility>

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
  std::mutex mutex;                 ///< of the directory, and of the structure in the forest
  std::condition_variable changed;  ///< told after each change
  Directory directory;
};

}  // namespace tfdude
