#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "tfdude/math/observation.hpp"

namespace tfdude {

/// As observe(), while edges that are not given share sources of observations with those that are:
/// common errors of these sources are kept, as those of other sources are.
[[nodiscard]] Result<Observation> observe_beside_others(const std::vector<ObservedEdge>& edges,
                                                        const Transform& Z_AB,
                                                        const std::string& source,
                                                        const ObserveOptions& options);

/// Whether an edge of the path, of which it is not known how it is correlated with the others, may
/// be determined by the measurement as if nothing was known of it: it does not become much less
/// certain by that, and what was measured is known again.
[[nodiscard]] bool is_better_anew(const std::vector<ObservedEdge>& edges, std::size_t index,
                                  const Transform& Z_AB);

}  // namespace tfdude
