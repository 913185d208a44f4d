#pragma once

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

}  // namespace tfdude
