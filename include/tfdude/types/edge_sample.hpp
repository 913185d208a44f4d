#pragma once

#include <cstddef>

#include "tfdude/base/time.hpp"
#include "tfdude/math/transform.hpp"

namespace tfdude {

/// A sample of an edge: its value X_PC at an instant.
struct EdgeSample {
  Time stamp{};
  Transform X_PC;
};

/// The time from one instant to another, with both.
struct TimeInterval {
  Time from{};
  Time to{};
};

/// Maximum number of samples of one rewrite, with those after its interval: ten minutes at 100 Hz.
/// Watchers get them as one commit, and recordings have them in one message.
inline constexpr std::size_t kMaxRewritten = 65'536;

}  // namespace tfdude
