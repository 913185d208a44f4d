#pragma once

#include <CLI/CLI.hpp>

#include "keys_commands.hpp"

namespace tfdude::cli {

/// Becomes the program tfdude-web, which is beside this one, with all arguments after the first.
/// @return only if that fails: the exit status
[[nodiscard]] int become_web(int argc, char** argv);

/// For the list of commands. It answers only if options stand before it.
void add_web_command(CLI::App& app, LocalCommand& chosen);

}  // namespace tfdude::cli
