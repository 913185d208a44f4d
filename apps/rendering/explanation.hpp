#pragma once

#include <optional>
#include <string>

#include <nlohmann/json.hpp>

#include "tfdude/types/explanation.hpp"

// Why an answer is as it is, for people and programs.
namespace tfdude::cli {

/// An explanation of B in A, one fact a line.
[[nodiscard]] std::string describe(const std::string& a, const std::string& b,
                                   const Explanation& why);
[[nodiscard]] nlohmann::json why_json(const std::string& a, const std::string& b,
                                      const Explanation& why);

}  // namespace tfdude::cli
