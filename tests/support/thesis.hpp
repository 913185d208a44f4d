#pragma once

#include <optional>
#include <string>
#include <vector>

#include "support/catch.hpp"
#include "support/test_domain.hpp"

namespace tfdude::testing {

/// The thesis's robot: its base with the world, and its arms.
inline const std::string kRobotFile = TFDUDE_EXAMPLES "/thesis/robot.yaml";
inline const std::string kArmsFile = TFDUDE_EXAMPLES "/thesis/arms.yaml";

/// Both served by daemons.
struct ThesisDaemons {
  TestDomain domain;
  Process robot = domain.serve(kRobotFile);
  std::optional<Process> arms = domain.serve(kArmsFile);
};

/// The text output of a command that must succeed.
[[nodiscard]] inline std::string text(const ThesisDaemons& d,
                                      const std::vector<std::string>& arguments) {
  const CliResult result = d.domain.cli(arguments);
  INFO(result.err);
  CHECK(result.status == 0);
  CHECK(result.err.empty());
  return result.out;
}

}  // namespace tfdude::testing
