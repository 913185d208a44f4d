#pragma once

#include <string>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include "support/cli_json.hpp"
#include "support/thesis.hpp"

namespace tfdude::testing {

/// The answer of a command in JSON.
[[nodiscard]] inline nlohmann::json answered(const ThesisDaemons& d,
                                             std::vector<std::string> arguments, int status = 0) {
  return answered(d.domain, std::move(arguments), status);
}

}  // namespace tfdude::testing
