#pragma once

#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "support/catch.hpp"
#include "support/test_domain.hpp"

namespace tfdude::testing {

/// The answer of a command in JSON.
[[nodiscard]] inline nlohmann::json answered(const TestDomain& domain,
                                             std::vector<std::string> arguments, int status = 0) {
  arguments.insert(arguments.begin(), "--json");
  const CliResult result = domain.cli(arguments);
  INFO(result.out << result.err);
  CHECK(result.status == status);
  return nlohmann::json::parse(result.out);
}

/// A joint as `tfdude joints` has it; null: there is none of that name.
[[nodiscard]] inline nlohmann::json joint_of(const TestDomain& domain, const std::string& name) {
  const nlohmann::json all = answered(domain, {"joints"});
  for (const nlohmann::json& partition : all.at("partitions")) {
    for (const nlohmann::json& one : partition.at("joints")) {
      if (one.at("name") == name) return one;
    }
  }
  return {};
}

}  // namespace tfdude::testing
