#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "tree/frames.hpp"

namespace tfdude {

/// The ids of the edges of a path whose covariance is unspecified at an instant, in the order from
/// a to b. For a path that was walked at that instant, or, if it has no dynamic edges, at any. The
/// caller holds an epoch::Guard. Allocates: only for paths of which it is known that they have
/// some.
[[nodiscard]] std::vector<std::string> unspecified_edges(const Ends& ends, std::int64_t t);

}  // namespace tfdude
