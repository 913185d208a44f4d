#pragma once

#include <cstdint>

#include "tfdude/base/result.hpp"

#include "tree/versions.hpp"

namespace tfdude {

/// Whether a dynamic edge accepts a sample. It may be older than other samples, but not than the
/// kept history, unless it completes the row with which the history restarts
/// (EdgeTiming::restart_after). For the forest's writer.
/// @return kTooOld, kStampTaken; counts both
[[nodiscard]] Result<void> check_sample(const HeldVersion& newest, std::int64_t stamp);

}  // namespace tfdude
