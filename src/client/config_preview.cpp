#include "tfdude/client/config_preview.hpp"

#include <utility>

#include "tfdude/base/id.hpp"

#include "partition/partition.hpp"
#include "partition/reconfigure.hpp"
#include "store/sqlite_store.hpp"
#include "store/state_copy.hpp"

namespace tfdude {

Result<ConfigPreview> preview_config(const std::string& partition,
                                     const std::vector<FrameSpec>& frames,
                                     const NodeOptions& options) {
  if (auto ok = check_new_partition_name(partition); !ok)
    return tl::unexpected(std::move(ok.error()));
  ConfigPreview preview;
  StoredState state;
  if (!options.state.empty()) {
    preview.file = state_file(options.state, options.domain, partition);
    auto kept = read_state_copy(preview.file, partition);
    if (!kept) return tl::unexpected(std::move(kept.error()));
    state = *std::move(kept);
  }
  preview.frames = state.frames.size();
  preview.changes = configured_changes(state, frames);
  // Loads it as the Node would, but without other participants: errors of that are returned here.
  Forest forest;
  Directory directory(forest, partition);
  Partition taken(partition, 1, forest, directory);
  if (auto ok = taken.restore(state, frames, Time{}); !ok) return tl::unexpected(ok.error());
  for (FrameInfo& frame : forest.frames()) {
    preview.served.push_back(
        {std::move(frame.id), std::move(frame.parent), partition, frame.attached});
  }
  return preview;
}

}  // namespace tfdude
