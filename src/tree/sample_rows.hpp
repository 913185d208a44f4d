#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "tree/held_edge.hpp"
#include "tree/segments.hpp"

// A dynamic edge, observed at several instants in any order. Its errors at these instants are rows
// of one joint covariance (delayed states): an observation at one of them corrects all.
namespace tfdude {

/// How many instants are kept as rows, at most. An observation costs that many more edges.
inline constexpr std::size_t kMostRows = 8;

/// How many are kept of an edge that has not been observed late, too, if few samples follow them:
/// the past that lookups mostly ask for, of sensors that take time.
inline constexpr std::size_t kFewestRows = 4;

/// For how many instants that are observed in order each further row is kept longer than the one
/// before it, after an observation that needed it.
inline constexpr std::size_t kRowLasts = 31;

/// RowInfo::lasts of so many rows.
[[nodiscard]] constexpr std::uint8_t lasting(std::size_t rows) {
  return static_cast<std::uint8_t>(kRowLasts * std::min(rows, kMostRows));
}
static_assert(lasting(kMostRows) == kRowLasts * kMostRows);

/// The newest sample that was observed itself; null: none. From it the edge's newest value follows.
[[nodiscard]] const Sample* last_observed(const HeldVersion& edge);

/// Of an edge that does not drift: the newest sample that takes part in all observations of what it
/// was observed with; null: none.
[[nodiscard]] const Sample* last_row(const HeldVersion& edge);

/// At how many instants after this one, up to kMostRows, the edge was observed.
[[nodiscard]] std::size_t observed_since(const HeldVersion& edge, std::int64_t t);

/// Adds the rows of a dynamic edge to what was found of it at an instant, and makes the value there
/// one that is correlated with them. If the edge drifts, the value between two rows is tied to
/// both, as the walk in between is known (a Brownian bridge). Before the first row only that is
/// known by how much the edge may have drifted until then, but not how this is correlated with what
/// was seen since: it counts as of unknown correlation. If it does not drift, its samples err
/// independently, and only the last one that was observed is a row. The edge's observations since
/// then may have left out other samples that were observed: these count as of unknown correlation.
/// @param segment  of `found`, whose value at the instant was looked up
/// @return the edges that it was observed with
[[nodiscard]] std::vector<std::string> tell_rows(const HeldVersion& edge, std::size_t segment,
                                                 std::int64_t t, Rows asked, SegmentValues& found);

}  // namespace tfdude
