#pragma once

#include <string>
#include <vector>

#include "tfdude/base/export.hpp"
#include "tfdude/types/configured_change.hpp"
#include "tfdude/types/frame.hpp"
#include "tfdude/types/options.hpp"

namespace tfdude {

/// The effect that opening a Node with some frames would have on its partition's stored state.
struct ConfigPreview {
  std::string file;        ///< file of the stored state; empty: nothing is stored
  std::size_t frames = 0;  ///< number of stored frames
  std::vector<ConfiguredChange> changes;
  /// The frames that it would then serve. `attached`: their parents are among them.
  std::vector<Frame> served;
};

/// Reports what Node::open() with these frames and options would change. Does not join the
/// domain. Works on a copy of the state, so the state may be in use and stays unchanged. Frames of
/// other partitions whose parent would be removed are not reported.
/// @return kState (naming the file), the error of the first invalid frame, as Node::open().
///   Thread-safe.
[[nodiscard]] TFDUDE_EXPORT Result<ConfigPreview> preview_config(
    const std::string& partition, const std::vector<FrameSpec>& frames, const NodeOptions& options);

}  // namespace tfdude
