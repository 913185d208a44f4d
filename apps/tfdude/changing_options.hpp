#pragma once

#include <CLI/CLI.hpp>

#include "command_options.hpp"

namespace tfdude::cli {

/// Adds the commands that change frames, their values and their uncertainty.
void add_changing_commands(CLI::App& app, Arguments& arguments, Command& chosen);

}  // namespace tfdude::cli
