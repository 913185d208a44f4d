#pragma once

#include <functional>

#include <CLI/CLI.hpp>

#include "commands.hpp"
#include "recording_options.hpp"

namespace tfdude::cli {

/// Adds the commands about values: joints, points, and samples from a file or pipe.
void add_value_commands(CLI::App& app, Arguments& arguments,
                        std::function<int(Client&, const Arguments&)>& chosen, LocalCommand& local);

}  // namespace tfdude::cli
