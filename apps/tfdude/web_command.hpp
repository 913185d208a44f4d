#pragma once

#include <CLI/CLI.hpp>

#include "keys_commands.hpp"

namespace tfdude::cli {

/// Becomes the program tfdude-web, which is beside this one, with all arguments but the one that
/// names the command.
/// @return only if that fails: the exit status
[[nodiscard]] int become_web(int argc, char** argv, int command);

/// The command behind options of discovery: `tfdude --domain 7 web`.
void add_web_command(CLI::App& app, int argc, char** argv, LocalCommand& chosen);

}  // namespace tfdude::cli
