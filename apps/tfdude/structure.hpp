#pragma once

#include <string>
#include <vector>

#include "command.hpp"

namespace tfdude::cli {

/// All frames, and the partitions that are not reachable.
struct Structure {
  [[nodiscard]] static Result<Structure> of(Source source);

  [[nodiscard]] std::vector<std::string> absent_names() const;
  /// A line for each partition that is not reachable, or of which frames are missing.
  [[nodiscard]] std::string warnings() const;
  /// Prints the frames as JSON, or as this text and the warnings to standard error.
  /// @return the exit status
  int print(const Common& common, const std::string& text) const;

  std::vector<Frame> frames;
  std::vector<PartitionInfo> absent;
  std::vector<std::string> incomplete;  ///< partitions of which frames are missing here
};

}  // namespace tfdude::cli
