#pragma once

#include <cstdint>
#include <vector>

#include "tree/held_edge.hpp"
#include "tree/revised_sample.hpp"
#include "tree/segments.hpp"

// What the walk of an edge that drifts makes of its values beside rows (sample_rows.hpp), and
// between them.
namespace tfdude {

/// How an edge has moved from one instant to a later one, as it was told, and what the drift has
/// added at the later one.
struct Way {
  Pose increment;
  Matrix6d added = Matrix6d::Zero();

  [[nodiscard]] Matrix6d carry() const { return adjoint(increment.inverse()); }
};

/// One way, and then another one.
[[nodiscard]] Way operator*(const Way& first, const Way& second);

/// Sample by sample, as the values of the samples were computed.
[[nodiscard]] Way way_between(const HeldVersion& edge, std::int64_t from, std::int64_t to);

/// A value at an instant beside some rows. What it has of their own parts is in its own part.
struct Tied {
  Pose X_PC;
  Matrix6d own = Matrix6d::Zero();
  bool unknown = false;
  std::vector<CommonError> common_errors;
};

[[nodiscard]] Tied after_row(const RowOfSample& row, const Way& way);
[[nodiscard]] Tied before_row(const Way& way, const RowOfSample& row);
/// The walk between two rows is a Brownian bridge.
[[nodiscard]] Tied between_rows(const RowOfSample& first, const Way& to, const Way& from,
                                const RowOfSample& second);

/// A sample as it is stored. @param segment  of the answer that it is for
[[nodiscard]] RowOfSample as_stored(const Sample& sample, std::size_t segment,
                                    const Correlation* said);

/// The values of the samples between two rows, in order.
/// @param first, second  numbers of the rows' samples, which are kept
[[nodiscard]] std::vector<CorrelatedValue> values_between(const HeldVersion& edge,
                                                          std::uint64_t first,
                                                          std::uint64_t second);

}  // namespace tfdude
