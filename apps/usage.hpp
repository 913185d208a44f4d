#pragma once

#include <string>

#include <CLI/CLI.hpp>

#include "exit_status.hpp"

// What the programs print instead of running: help, and what is wrong with a command line.
namespace tfdude::cli {

/// The program's name, with which its description begins: "tfdude".
[[nodiscard]] std::string program_name(const CLI::App& app);

/// What is wrong with a command line: what was typed, and what is wanted. One line, without the
/// name of the program.
[[nodiscard]] std::string usage_error(const CLI::App& app, const CLI::ParseError& error);

/// Prints what is wrong after the name of the program, and where its help is; or prints the help
/// that was asked for. @return the exit status
int end_parsing(const CLI::App& app, const CLI::ParseError& error);

/// Help with the commands before the options that all of them have.
void show_commands_first(CLI::App& app);

}  // namespace tfdude::cli
