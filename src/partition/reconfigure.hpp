#pragma once

#include <cstdint>
#include <set>
#include <string>
#include <vector>

#include "tfdude/types/configured_change.hpp"

#include "partition/state_store.hpp"

namespace tfdude {

/// The changes that a configuration makes to the stored state of a partition. An entry counts if it
/// differs from the previous configuration. A frame is removed if its entry was removed, but frames
/// below it stay: changes made at run time are kept otherwise. An empty configuration counts as
/// none, and changes nothing. Sorted by the order of the configuration, then removals and orphans
/// by id. O(n log n) of the frames.
[[nodiscard]] std::vector<ConfiguredChange> configured_changes(
    const StoredState& state, const std::vector<FrameSpec>& configured);

/// The frames that requests have moved or added again, and that have had no sample since, if their
/// entries are as before: they are static until their next sample. O(n log n) of the frames.
[[nodiscard]] std::set<std::string> left_static(const StoredState& state,
                                                const std::vector<FrameSpec>& configured);

/// The stored joint positions that are still valid: those of joints that the configuration
/// describes, except a joint whose unit has changed between rotation and translation, joints that
/// follow it, and one that follows another joint than before, of which nothing is stored.
[[nodiscard]] std::vector<StoredJoint> still_meant(const StoredState& state,
                                                   const std::vector<FrameSpec>& configured);

}  // namespace tfdude
