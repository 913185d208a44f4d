#pragma once

#include <utility>

#include "tfdude/base/result.hpp"

#include "tree/remote_edges.hpp"

namespace tfdude {

// A test shows that it notices when this is left out.
#ifdef TFDUDE_WITHOUT_HORIZON
inline constexpr bool kAsksForHorizon = false;
#else
inline constexpr bool kAsksForHorizon = true;
#endif

/// Repeats what `compute` does with a reading as long as an owner overwrites meanwhile what was
/// read: a writer at full speed lets one of several thousand lookups begin again. The caller holds
/// an epoch::Guard.
/// @param compute  gets the reading and the value to set; returns a Result<void>
/// @return false: it was overwritten each time
template <class Value, class Compute>
bool read_intact(RemoteReading& reading, Result<Value>& found, Compute compute) {
  constexpr int kTries = 16;
  bool intact = false;
  for (int tries = 0; tries < kTries && !intact; ++tries) {
    reading.clear();
    if (tries > 0) found = Value();
    if (Result<void> ok = compute(reading, *found); !ok) {
      found = tl::unexpected(std::move(ok.error()));
    }
    intact = !kAsksForHorizon || reading.intact();
  }
  return intact;
}

}  // namespace tfdude
