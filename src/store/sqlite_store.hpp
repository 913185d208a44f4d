#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "partition/state_store.hpp"

namespace tfdude {

/// The file of a partition's state: DIRECTORY/domain-N/PARTITION.sqlite. All characters except
/// letters, digits, dashes, underscores and dots (not the first) are written as % and two
/// hexadecimal digits. Names that are too long for a file are cut, and end in their FNV-1a hash.
[[nodiscard]] std::string state_file(const std::string& directory, std::uint32_t domain,
                                     const std::string& partition);

/// When written data must have reached the disk (SQLite's "PRAGMA synchronous").
enum class StoreSync {
  /// NORMAL: if the computer stops, the last changes may be lost, except for the first one of each
  /// process; the file stays intact.
  kAtCheckpoints,
  kEachChange,  ///< FULL: no change is lost; each waits for the disk
};

/// Opens a partition's state, or creates an empty one, and prevents others from opening it. It is
/// an SQLite file in WAL mode: saved data survives the end of the process at any instant.
/// @return kState naming the file and what to do: in use, damaged, of another program, of a newer
///   format, of another partition, or cannot be created. A file that cannot be read is not changed.
[[nodiscard]] Result<std::unique_ptr<StateStore>> open_sqlite_store(
    const std::string& file, const std::string& partition,
    StoreSync sync = StoreSync::kAtCheckpoints);

/// Erases the rows of a state file whose checksums are wrong, and what belongs to them; and what
/// its log has behind the first damage, see find_damage().
/// @return each of them, such as "frames 'hand'"; kState as open_sqlite_store()
[[nodiscard]] Result<std::vector<std::string>> drop_wrong_rows(const std::string& file,
                                                               const std::string& partition);

}  // namespace tfdude
