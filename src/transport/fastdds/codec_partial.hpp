#pragma once

#include "transport/fastdds/topics.hpp"
#include "tree/forest.hpp"

// Updates that give only parts of values.
namespace tfdude::fastdds {

[[nodiscard]] wire::PartialEdge wire_partial(const PartialUpdate& edge);

/// @return kInvalidInput naming the frame and the invalid part
[[nodiscard]] Result<PartialUpdate> read_partial(const wire::PartialEdge& in);

}  // namespace tfdude::fastdds
