#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "tfdude/types/configured_change.hpp"

#include "partition/state_store.hpp"

namespace tfdude {

/// What a configuration changes of a partition that was left so. An entry counts where it is not what it was when the
/// configuration was taken last; a frame goes where its entry has gone, and nothing below it does: what was changed at
/// run time stays but for that. An empty configuration is none, and changes nothing. In the order of the
/// configuration, then removals and orphans by id. O(n log n) of the frames.
[[nodiscard]] std::vector<ConfiguredChange> configured_changes(
    const StoredState& state, const std::vector<FrameSpec>& configured);

/// Those stored positions of joints that mean today what they meant: not of a joint that turns where one of its name slid, or
/// slides where it turned, nor of those that follow such a one.
[[nodiscard]] std::vector<StoredJoint> still_meant(const std::vector<StoredJoint>& joints,
                                                   const std::vector<FrameSpec>& configured);

}  // namespace tfdude
