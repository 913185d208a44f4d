#pragma once

#include <string>

#include "partition/state_store.hpp"

namespace tfdude {

/// Reads a state file from a copy of it, because the partition's owner may be using the file. The
/// file itself is not changed. If there is no file, the state is empty.
/// @return kState as open_sqlite_store(); or if no copy can be made, or the file changes during
///   each attempt to copy it
[[nodiscard]] Result<StoredState> read_state_copy(const std::string& file,
                                                  const std::string& partition);

}  // namespace tfdude
