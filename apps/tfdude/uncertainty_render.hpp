#pragma once

#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "tfdude/client/client.hpp"

// What has to do with uncertainty, as text for people, and as JSON for programs.
namespace tfdude::cli {

/// The line that says what a covariance rests on; empty where that is as usual.
[[nodiscard]] std::string describe(const Basis& basis);
[[nodiscard]] nlohmann::json basis_json(const Basis& basis);

/// What came of a measurement.
[[nodiscard]] std::string describe(const Observed& observed);
[[nodiscard]] nlohmann::json observed_json(const Observed& observed);

/// Edges that were observed, and whether their covariances agree with that; empty where there are none.
[[nodiscard]] std::string consistency_table(const std::vector<EdgeConsistency>& edges);
[[nodiscard]] nlohmann::json consistency_json(const EdgeConsistency& edge);

}  // namespace tfdude::cli
