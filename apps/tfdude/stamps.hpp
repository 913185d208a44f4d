#pragma once

#include <optional>
#include <string>

#include "command.hpp"
#include "typed_stamp.hpp"

// Stamps of the command line, and the ages of stamps.
namespace tfdude::cli {

/// As parse_stamp(), with the clock of the source, which only a relative stamp needs; no stamp for
/// an empty text. @return also kNotYet
[[nodiscard]] Result<std::optional<Time>> optional_stamp(Source source, const std::string& text);

/// Where a command that goes through a recording begins: at the stamp, or at the beginning.
[[nodiscard]] Result<Time> beginning(Recording& recording, const std::string& at);

/// The time with which to compare the stamps of a path, for ages; nothing if an owner on it uses
/// another clock, or if the time is not known.
[[nodiscard]] std::optional<Time> present(Source source, const Common& common, const std::string& a,
                                          const std::string& b);
/// Likewise, for one partition.
[[nodiscard]] std::optional<Time> present(Source source, const Common& common,
                                          const PartitionInfo& partition);

/// The line with the stamp of a transform on the path from A to B; empty if it has none, or if the
/// answer is in JSON.
[[nodiscard]] std::string stamp_line(Source source, const Common& common, const std::string& a,
                                     const std::string& b, const std::optional<Time>& stamp);

}  // namespace tfdude::cli
