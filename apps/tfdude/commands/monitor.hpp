#pragma once

#include <optional>
#include <string>
#include <vector>

#include "tfdude/client/client.hpp"

#include "../../rendering/angles.hpp"

namespace tfdude::cli {

/// One partition's dynamic edges as a table.
/// @param now  absent: ages are not known
[[nodiscard]] std::string monitor_table(const std::string& partition,
                                        const std::vector<HistoryInfo>& histories,
                                        std::optional<Time> now);

/// Observed edges, and whether their covariances agree with the observations; empty if there are
/// none.
[[nodiscard]] std::string consistency_table(const std::vector<EdgeConsistency>& edges);

/// The joints that received positions outside their limits; empty if there are none.
[[nodiscard]] std::string outside_table(const std::vector<JointInfo>& joints,
                                        const AngleUnit& angles);

}  // namespace tfdude::cli
