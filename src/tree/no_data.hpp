#pragma once

#include <vector>

#include "tree/frames.hpp"

namespace tfdude {

/// The error of a lookup for which an edge has no data, without a text, explained for people: which
/// edge limits, which samples it has, and when all dynamic edges of these segments have data. Other
/// errors stay as they are. The caller holds an epoch::Guard.
/// @param query  of the lookup
/// @param clock  tells how long ago that was; null: nobody knows
[[nodiscard]] Error explained(Error error, const std::vector<Ends>& segments, const Query& query,
                              const Forest::Clock& clock);

}  // namespace tfdude
