#pragma once

#include <vector>

#include "tree/frames.hpp"
#include "tree/remote_edges.hpp"

namespace tfdude {

/// The error of a lookup for which an edge has no data, without a text, explained for people: which
/// edge limits, which samples it has, and when all dynamic edges of these segments have data. Other
/// errors stay as they are. The caller holds an epoch::Guard.
/// @param query  of the lookup
/// @param clock  tells how long ago that was; null: nobody knows
[[nodiscard]] Error explained(Error error, const std::vector<Ends>& segments, const Query& query,
                              const Forest::Clock& clock);
/// The same for a path over edges that others hold.
[[nodiscard]] Error explained(Error error, const Ends& ends, RemoteReading& others,
                              const Query& query, const Forest::Clock& clock);

}  // namespace tfdude
