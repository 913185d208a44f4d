#pragma once

#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "tfdude/client/client.hpp"

#include "render.hpp"

// Uncertainty as text for people, and as JSON for programs.
namespace tfdude::cli {

/// What a covariance is based on, in words; empty for second order without correlation.
[[nodiscard]] std::string describe(const Basis& basis);
[[nodiscard]] nlohmann::json basis_json(const Basis& basis);

/// The result of a measurement.
[[nodiscard]] std::string describe(const Observed& observed);
[[nodiscard]] nlohmann::json observed_json(const Observed& observed);

/// Observed edges, and whether their covariances agree with the observations; empty if there are
/// none.
[[nodiscard]] std::string consistency_table(const std::vector<EdgeConsistency>& edges);
[[nodiscard]] nlohmann::json consistency_json(const EdgeConsistency& edge);

/// A velocity of B in A.
[[nodiscard]] std::string describe(const Velocity& velocity, const Shown& shown);
[[nodiscard]] nlohmann::json velocity_json(const std::string& a, const std::string& b,
                                           const Velocity& velocity);

}  // namespace tfdude::cli
