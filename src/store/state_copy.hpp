#pragma once

#include <string>

#include "partition/state_store.hpp"

namespace tfdude {

/// What a state file says, read from a copy of it: the file may be in use by who serves the partition, and is not touched.
/// Where there is no file nothing is stored.
/// @return kState as open_sqlite_store(); or that no copy can be made, or that the file does not keep still for one.
[[nodiscard]] Result<StoredState> read_state_copy(const std::string& file,
                                                  const std::string& partition);

}  // namespace tfdude
