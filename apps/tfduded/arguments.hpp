#pragma once

#include <optional>
#include <string>
#include <vector>

#include "tfdude/client/client.hpp"
#include "tfdude/description/urdf.hpp"

namespace tfdude::daemon {

inline constexpr int kWrongUsage = 2;

/// What the daemon's command line says.
struct Arguments {
  std::string partition;
  std::string config;
  std::vector<UrdfPart> urdfs;
  bool check = false;  ///< say what the configuration changes, and serve nothing
  Options options;
};

/// @return the exit status where there is nothing to serve: help, or wrong usage, which it has told.
[[nodiscard]] std::optional<int> read_arguments(int argc, char** argv, Arguments& arguments);

}  // namespace tfdude::daemon
