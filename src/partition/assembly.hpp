#pragma once

#include <vector>

#include "partition/messages.hpp"
#include "partition/routing.hpp"

// Puts the answers of owners together.
namespace tfdude {

/// X_AB from the answers to a plan's parts (same order); the identity if the plan has none. The
/// values must be at one instant (one_instant()).
/// @return kNotOwner if the number of transforms in an answer does not match the request; kTooOld
///   if the instant is negative, and an edge is dynamic.
[[nodiscard]] Result<StampedTransform> assemble(const LookupPlan& plan,
                                                const std::vector<SegmentValues>& answers);

}  // namespace tfdude
