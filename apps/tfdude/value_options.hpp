#pragma once

#include <CLI/CLI.hpp>

#include "command_options.hpp"
#include "recording_options.hpp"

namespace tfdude::cli {

/// Adds the commands about values: joints, points, and samples from a file or pipe.
void add_value_commands(CLI::App& app, Arguments& arguments, Command& chosen, LocalCommand& local);

}  // namespace tfdude::cli
