#pragma once

#include <cstdint>

#include "tfdude/base/result.hpp"

#include "tree/versions.hpp"

namespace tfdude {

/// Whether a moving edge takes a sample: it may be older than others, but not than all that is kept, unless so many in a row
/// are that the history starts again (EdgeTiming::restart_after). For the forest's writer.
/// @return kTooOld, kStampTaken; both are counted
[[nodiscard]] Result<void> check_sample(const HeldVersion& newest, std::int64_t stamp);

}  // namespace tfdude
