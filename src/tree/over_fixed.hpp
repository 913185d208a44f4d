#pragma once

#include <string>
#include <vector>

#include "tfdude/math/belief.hpp"
#include "tfdude/types/query.hpp"

#include "tree/forest.hpp"

namespace tfdude {

/// An edge of a path from the fixed frame, at one instant.
struct EdgeFromFixed {
  std::string id;
  Belief X_PC;
  bool up = false;  ///< the path goes from the child to the parent
  bool moving = false;
  bool drifts = false;     ///< as EdgeTiming::drifts
  bool corrected = false;  ///< observations have corrected its value, if it drifts
};

/// Those of a path in one forest.
/// @return as Forest::lookup_segments()
[[nodiscard]] Result<std::vector<EdgeFromFixed>> edges_from_fixed(const Forest& forest,
                                                                  std::string_view fixed,
                                                                  std::string_view frame,
                                                                  const Query& query);

/// The pose of b in a, each at an instant of its own, from their poses in a fixed frame. The stamp
/// is that of b; the unspecified edges are in the order of the path from a to b, each once.
///
/// A static edge on both paths has the same error twice, up to the first dynamic one it cancels. If
/// its values differ, as those of two states do, any relation of their errors is allowed for;
/// that of one that drifts follows from the earlier one (drift_between()). The errors of another
/// dynamic edge at two instants may be correlated in any way, and so may those of a source that it
/// names: the covariance is an upper bound. Its share is bound() of its own two, as different edges
/// err independently, unless an observation has tied it to others.
/// @param X_FA, X_FB  of which only the stamps count if there are edges
/// @param to_a, to_b  of one state, or of two that are meant to differ (Query::believed_at); may be
///   empty if no edge is on both paths
[[nodiscard]] StampedTransform over_fixed(const StampedTransform& X_FA,
                                          const StampedTransform& X_FB,
                                          std::vector<EdgeFromFixed> to_a,
                                          std::vector<EdgeFromFixed> to_b, Order order);

}  // namespace tfdude
