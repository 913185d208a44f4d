#pragma once

#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "support/thesis.hpp"

namespace tfdude::testing {

/// The answer of a command in JSON.
[[nodiscard]] inline nlohmann::json answered(const ThesisDaemons& d,
                                             std::vector<std::string> arguments, int status = 0) {
  arguments.insert(arguments.begin(), "--json");
  const CliResult result = d.domain.cli(arguments);
  INFO(result.out << result.err);
  CHECK(result.status == status);
  return nlohmann::json::parse(result.out);
}

}  // namespace tfdude::testing
