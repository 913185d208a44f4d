#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "partition/state_store.hpp"

namespace tfdude {

/// The file of a partition's state: DIRECTORY/domain-N/PARTITION.sqlite, where whatever is not a letter, digit,
/// dash, dot or underscore is written as % and two digits. Names too long for a file end in their FNV-1a hash.
[[nodiscard]] std::string state_file(const std::string& directory, std::uint32_t domain,
                                     const std::string& partition);

/// When what is written must have reached the disk (SQLite's "PRAGMA synchronous").
enum class StoreSync {
  kAtCheckpoints,  ///< NORMAL: where the computer stops, the last changes may be lost; the file stays whole
  kEachChange,  ///< FULL: none is lost; each change waits for the disk
};

/// Opens a partition's state, or makes an empty one, and keeps others from opening it. An SQLite file in WAL mode: what
/// was saved survives the end of the process at any instant.
/// @return kState naming the file and what to do: in use, damaged, of another program, of a newer format, of
///   another partition, not to be created. A file that cannot be read is not changed.
[[nodiscard]] Result<std::unique_ptr<StateStore>> open_sqlite_store(
    const std::string& file, const std::string& partition,
    StoreSync sync = StoreSync::kAtCheckpoints);

}  // namespace tfdude
