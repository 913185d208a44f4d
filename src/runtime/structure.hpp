#pragma once

#include <memory>
#include <string>
#include <utility>

#include "base/mutex.hpp"
#include "partition/directory.hpp"
#include "runtime/source_clock.hpp"
#include "tree/forest.hpp"

namespace tfdude {

/// A participant's knowledge of all frames, and the lock for those that change it or plan with it.
/// Lookups of values read the forest without it. Also the clock of its stamps.
struct Structure {
  /// @param own  the partition that this process serves; empty: none
  /// @param arena  as for Forest
  Structure(ClockKind kind, const std::string& own, std::shared_ptr<Arena> arena = nullptr)
      : clock(kind),
        forest([this] { return clock.now(); }, std::move(arena)),
        directory(forest, own) {}

  SourceClock clock;
  Forest forest;
  Mutex mutex{LockRank::kStructure};  ///< also for writing structure in the forest
  Condition changed;                  ///< notified after each change
  Directory directory TFDUDE_GUARDED_BY(mutex);
};

}  // namespace tfdude
