#pragma once

#include <optional>
#include <string>

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

}  // namespace tfdude::testing
