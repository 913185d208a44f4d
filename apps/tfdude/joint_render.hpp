#pragma once

#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "tfdude/types/joint_spec.hpp"

// Joints as text for people, and as JSON for programs.
namespace tfdude::cli {

/// All joints of a partition as a table.
[[nodiscard]] std::string joint_table(const std::vector<JointInfo>& joints);

/// The joints that received positions outside their limits; empty if there are none.
[[nodiscard]] std::string outside_table(const std::vector<JointInfo>& joints);

[[nodiscard]] nlohmann::json joint_json(const JointInfo& joint);

}  // namespace tfdude::cli
