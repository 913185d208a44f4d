#pragma once

#include <cstdint>
#include <optional>
#include <string>

namespace tfdude {

/// What SQLite would leave out without a word, because it takes the first frame of a log that fails
/// for the log's end.
struct DamagedLog {
  std::uint64_t frame = 0;    ///< the first that fails, from 1; 0: the header
  std::uint64_t commits = 0;  ///< that follow it
};

/// Looks for commits behind the first wrong frame of a database's log. So a last frame that is
/// incomplete, as a crash leaves it, is not damage, nor is what a rejected transaction left behind.
/// A log that was last written before this computer started is not looked at: if a computer stops,
/// any of the last blocks may be missing. Reads the log once, in memory for one frame.
/// @param log  the file; nothing is wrong with one that does not exist
[[nodiscard]] std::optional<DamagedLog> find_damage(const std::string& log);

/// "frame 12 of 'arms.sqlite-wal', and 7 or more changes behind it", for a message.
[[nodiscard]] std::string to_string(const DamagedLog& damaged, const std::string& log);

}  // namespace tfdude
