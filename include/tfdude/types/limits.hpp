#pragma once

#include <cstddef>
#include <cstdint>

#include "tfdude/math/belief.hpp"

namespace tfdude {

/// Maximum number of edges, subtrees, segments or entries per message.
inline constexpr std::size_t kMaxItems = 4096;

/// Maximum number of edges of one owner that are observed at once, or correlated with others on one
/// path; also the maximum number of common errors of each.
inline constexpr std::uint32_t kMaxCorrelated = kMaxCommonErrors;

}  // namespace tfdude
