#pragma once

#include <optional>
#include <vector>

#include "tfdude/base/time.hpp"

#include "tree/frames.hpp"
#include "tree/remote_edges.hpp"
#include "tree/segments.hpp"

// What single edges are besides their values. A dynamic edge is listed in `observed_with` with
// itself twice: what was observed is its sample, and a later one has another error. One that drifts
// is listed three times: its later error follows from the earlier one. If the instant is one that
// observations have corrected, and no rows are asked for, it is listed four times: this error does
// not follow from an earlier one that was not corrected.
namespace tfdude {

/// Adds the edges that each single edge was observed with, after its marks.
void tell_observed_with(const std::vector<Ends>& edges, Rows rows, SegmentValues& found);

/// Adds the marks of each single edge, some of them in the memory of their owners.
/// @return false: one cannot be read, or has stamps that its owner has made up since then
[[nodiscard]] bool tell_motion(const std::vector<Ends>& edges, std::optional<Time> timed_since,
                               RemoteReading& reading, SegmentValues& found);

}  // namespace tfdude
