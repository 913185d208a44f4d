#pragma once

#include <cstdint>
#include <string>

#include "partition/state_store.hpp"
#include "store/sqlite.hpp"

// Read and check the rows of a state. @return kState or kInvalidInput if a row is invalid
namespace tfdude {

[[nodiscard]] Result<std::uint64_t> read_count(const sqlite::Statement& row, int column);
/// Rows come in the order of their ids. @param before  the id of the previous row
[[nodiscard]] Result<FrameSpec> read_frame(const sqlite::Statement& row, const std::string& before);
[[nodiscard]] Result<Tombstone> read_tombstone(const sqlite::Statement& row,
                                               const std::string& before);
[[nodiscard]] Result<StoredCorrelation> read_stored_correlation(const sqlite::Statement& row);
/// Of an entry of the configuration.
[[nodiscard]] Result<Correlation> read_said(const sqlite::Statement& row);
/// The names of an entry's joint.
[[nodiscard]] Result<PageJoint> read_entry_joint(const sqlite::Statement& row);
/// Of a joint whose type is not known.
inline constexpr std::uint64_t kNoType = 0;
[[nodiscard]] Result<StoredJoint> read_joint(const sqlite::Statement& row);
/// Of a frame whose value is a sample, or was cleared.
[[nodiscard]] Result<StoredTime> read_time(const sqlite::Statement& row);
[[nodiscard]] Result<Absent> read_absent(const sqlite::Statement& row);

}  // namespace tfdude
