#pragma once

#include <string>
#include <utility>
#include <vector>

#include <CLI/CLI.hpp>

namespace tfdude::cli {

/// A section of a manual page: its title, and text without markup.
using ManualSection = std::pair<std::string, std::string>;

/// Adds the hidden option --manual DIR, which writes a manual page of the program and one of each
/// command, and ends the program. The pages are made of what --help prints: options, commands, and
/// the footers, of which the lines "Exit status: " and "Example: " have sections of their own. So
/// they cannot differ from it.
/// Call it before parse(), after all options and commands are added.
/// @param more  further sections of the program's page
void add_manual(CLI::App& app, std::vector<ManualSection> more = {});

}  // namespace tfdude::cli
