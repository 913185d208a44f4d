#pragma once

#include <string>
#include <vector>

#include "tfdude/description/config.hpp"

#include "arguments.hpp"

namespace tfdude::daemon {

/// Prints what the daemon would serve, and what the configuration would change in the stored state.
/// Checks the keys, too. Joins no domain, and writes no file.
/// @return the exit status: 0, or cli::kWrongUsage if the daemon would not start
[[nodiscard]] int check(const Arguments& arguments, const Config& config);

/// How many of the edges have no covariance, and what to write; empty if all have one.
[[nodiscard]] std::string unspecified_edges(const Config& config);

/// What to write, so that the URDFs are without the links whose frames others own: a line for each
/// of these URDFs; empty if that cannot be found out. Joins the domain.
[[nodiscard]] std::vector<std::string> links_to_write(const Arguments& arguments,
                                                      const Config& config);

/// What is wrong with the configurations of a robot's daemons if they run together: a partition, a
/// frame or a joint of two of them, a parent or a mimicked joint that none has, a cycle. Messages
/// name the places.
[[nodiscard]] std::vector<std::string> contradictions(const std::vector<Config>& configs);

}  // namespace tfdude::daemon
