#pragma once

#include <cstdint>

#include "partition/state_store.hpp"
#include "store/sqlite.hpp"

namespace tfdude {

/// All that a file of this format or an older one says. @return kState or kInvalidInput: a row that cannot be.
[[nodiscard]] Result<StoredState> read_state(const sqlite::Database& database, std::int64_t format);

}  // namespace tfdude
