#pragma once

#include <cstdint>
#include <string>

#include "tfdude/base/export.hpp"

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

/// One line for people.
[[nodiscard]] TFDUDE_EXPORT std::string describe(const ConfiguredChange& change);

}  // namespace tfdude
