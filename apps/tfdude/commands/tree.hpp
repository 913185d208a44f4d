#pragma once

#include <string>
#include <vector>

#include "tfdude/client/client.hpp"

namespace tfdude::cli {

/// All frames as trees, each with its owner.
/// @param unreachable  the partitions that do not answer
[[nodiscard]] std::string draw_tree(const std::vector<Frame>& frames,
                                    const std::vector<std::string>& unreachable);

}  // namespace tfdude::cli
