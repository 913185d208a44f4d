#pragma once

#include <cstdint>
#include <string>

#include "tfdude/base/export.hpp"

namespace tfdude {

/// A change that a configuration makes to a frame as it was stored.
struct ConfiguredChange {
  enum class Kind : std::uint8_t {
    kAdd,        ///< adds a frame: an entry for a frame that does not exist
    kReplace,    ///< a new or changed entry: sets parent, value and correlation
    kCorrelate,  ///< a changed entry that differs in its correlation only
    kRemove,     ///< removes the frame: its entry is gone
    kRest,       ///< drops the joint's stored position, because the joint's type changed
    kOrphan,     ///< keeps the frame as a root that waits for its removed parent
  };
  Kind kind = Kind::kAdd;
  std::string frame;
  std::string parent;  ///< of an added or replaced frame (empty: a root), or of an orphan
  std::string why{};   ///< for kRest: which joint has changed, and how

  friend bool operator==(const ConfiguredChange& a, const ConfiguredChange& b) {
    return a.kind == b.kind && a.frame == b.frame && a.parent == b.parent && a.why == b.why;
  }
};

/// One human-readable line.
[[nodiscard]] TFDUDE_EXPORT std::string describe(const ConfiguredChange& change);

}  // namespace tfdude
