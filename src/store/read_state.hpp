#pragma once

#include <cstdint>

#include "partition/state_store.hpp"
#include "store/sqlite.hpp"

namespace tfdude {

/// Reads the whole state from a file of this format. @return kState or kInvalidInput: invalid row
[[nodiscard]] Result<StoredState> read_state(const sqlite::Database& database, std::int64_t format);

}  // namespace tfdude
