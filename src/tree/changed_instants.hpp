#pragma once

#include <cstdint>
#include <vector>

#include "tree/frames.hpp"
#include "tree/segments.hpp"

// What a watcher of segments does not know yet. The caller holds an epoch::Guard.
namespace tfdude {

/// As SegmentValues::said.
[[nodiscard]] std::uint64_t said_of(const std::vector<Ends>& segments);

/// The stamps of samples for which these segments have other values than were known from `seen`,
/// sorted. Complexity: linear in the samples since then.
/// @param said  as SegmentValues::said, now
[[nodiscard]] std::vector<std::int64_t> changed_instants(const std::vector<Ends>& segments,
                                                         const SeenSegments& seen,
                                                         std::uint64_t said);

}  // namespace tfdude
