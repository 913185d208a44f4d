#pragma once

#include <vector>

#include "tfdude/types/frame.hpp"

#include "partition/directory.hpp"
#include "tree/forest.hpp"

namespace tfdude {

/// Whether no other partition owns one of the frames.
/// @return kAlreadyExists naming the frames and their owners.
[[nodiscard]] Result<void> check_all_free(const Forest& forest, const Directory& directory,
                                          const std::vector<FrameSpec>& frames);

}  // namespace tfdude
