#pragma once

#include <string>
#include <vector>

#include "tfdude/base/export.hpp"
#include "tfdude/types/configured_change.hpp"
#include "tfdude/types/frame.hpp"
#include "tfdude/types/options.hpp"

namespace tfdude {

/// What a Node that is opened with some frames would make of what is kept of its partition.
struct ConfigPreview {
  std::string file;        ///< in which that is kept; empty: nothing is kept
  std::size_t frames = 0;  ///< that are kept now
  std::vector<ConfiguredChange> changes;
};

/// Says beforehand what Node::open() with these frames and options would change; serves nothing, meets nobody. It works on a
/// copy of the state, which may be in use meanwhile and stays as it is. Of frames of other partitions that would
/// wait for one that is removed it knows nothing.
/// @return kState (naming the file), the first bad frame's error, as Node::open(). Thread-safe.
[[nodiscard]] TFDUDE_EXPORT Result<ConfigPreview> preview_config(
    const std::string& partition, const std::vector<FrameSpec>& frames, const Options& options);

}  // namespace tfdude
