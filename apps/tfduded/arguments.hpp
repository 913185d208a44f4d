#pragma once

#include <optional>
#include <string>
#include <vector>

#include "tfdude/client/client.hpp"
#include "tfdude/description/urdf.hpp"

namespace tfdude::daemon {

/// The daemon's command line.
struct Arguments {
  std::string partition;
  std::string config;
  std::vector<std::string> further;  ///< configurations to check together with it
  std::vector<UrdfPart> urdfs;
  /// Of their edges that have none, instead of that of the configuration.
  std::optional<StatedCovariance> covariance;
  bool check = false;         ///< only print what the configuration would change
  bool drop_damaged = false;  ///< leave out stored rows whose checksum is wrong
  std::optional<ClockKind> clock;
  NodeOptions options;
};

/// Prints help and errors of usage itself.
/// @return the exit status if the program should end: after help or wrong usage
[[nodiscard]] std::optional<int> read_arguments(int argc, char** argv, Arguments& arguments);

}  // namespace tfdude::daemon
