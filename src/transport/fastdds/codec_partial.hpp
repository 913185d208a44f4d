#pragma once

#include "transport/fastdds/topics.hpp"
#include "tree/forest.hpp"

// Updates that give only parts of values.
namespace tfdude::fastdds {

[[nodiscard]] wire::PartialEdge wire_partial(const PartialUpdate& edge);

/// @return kInvalidInput naming the frame and what of the parts that are given breaks its rule.
[[nodiscard]] Result<PartialUpdate> read_partial(const wire::PartialEdge& in);

}  // namespace tfdude::fastdds
