#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "tfdude/partition/state_store.hpp"

namespace tfdude {

/// What a configuration changes of a frame as it was left.
struct ConfiguredChange {
  enum class Kind : std::uint8_t {
    kAdd,        ///< an entry of a frame that is not there
    kReplace,    ///< one that is new, or differs: parent, value and correlation are as it says
    kCorrelate,  ///< one of which only the correlation differs
    kRemove,     ///< the entry is gone
    kRest,       ///< its joint's stored position means nothing any more, see still_meant()
    kOrphan,     ///< the frame stays, as a root that waits for its parent, which is removed
  };
  Kind kind = Kind::kAdd;
  std::string frame;
  std::string parent;  ///< of what is added or replaced (empty: a root), and of an orphan
  std::string why{};   ///< of what is at rest: which joint has changed, and how

  friend bool operator==(const ConfiguredChange& a, const ConfiguredChange& b) {
    return a.kind == b.kind && a.frame == b.frame && a.parent == b.parent && a.why == b.why;
  }
};

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

/// One line for people.
[[nodiscard]] std::string describe(const ConfiguredChange& change);

}  // namespace tfdude
