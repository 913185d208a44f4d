#pragma once

#include <string>

#include <nlohmann/json.hpp>

#include "../../rendering/text.hpp"

namespace tfdude::cli {

/// A velocity of B in A.
[[nodiscard]] std::string describe(const Velocity& velocity, const Shown& shown);
[[nodiscard]] nlohmann::json velocity_json(const std::string& a, const std::string& b,
                                           const Velocity& velocity);

}  // namespace tfdude::cli
