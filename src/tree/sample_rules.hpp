#pragma once

#include <cstdint>

#include "tfdude/base/result.hpp"

#include "tree/versions.hpp"

namespace tfdude {

/// check_sample() for a sample that is not the newest.
[[nodiscard]] Result<void> check_late_sample(const HeldVersion& newest, std::int64_t stamp);

/// Whether the history restarts with this sample (EdgeTiming::restart_after); counts it. For the
/// forest's writer.
[[nodiscard]] bool history_restarts(const HeldVersion& newest, std::int64_t stamp);

/// Whether a dynamic edge accepts a sample. It may be older than other samples, but not than the
/// kept history, unless it completes the row with which the history restarts
/// (EdgeTiming::restart_after). For the forest's writer.
/// @return kTooOld, kStampTaken; counts both
[[nodiscard]] inline Result<void> check_sample(const HeldVersion& newest, std::int64_t stamp) {
  if (!newest.moving() || stamp > newest.stamp || stamp == kAlways) return {};
  return check_late_sample(newest, stamp);
}

}  // namespace tfdude
