#pragma once

#include <functional>
#include <optional>
#include <utility>
#include <vector>

#include <CLI/CLI.hpp>

#include "manual.hpp"
#include "numbers.hpp"
#include "standard_descriptors.hpp"
#include "usage.hpp"

namespace tfdude::cli {

/// Reads the command line of a program without commands, after all options are added. Prints help
/// and errors itself.
/// @param sections  as add_manual()
/// @param check  what else may be wrong: may throw CLI::ParseError
/// @return the exit status if the program ends here
[[nodiscard]] inline std::optional<int> read_command_line(
    CLI::App& app, int argc, char** argv, std::vector<ManualSection> sections = {},
    const std::function<void()>& check = [] {}) {
  hold_standard_descriptors();
  require_numbers(app);
  add_manual(app, std::move(sections));
  try {
    app.name(argv[0]);
    app.parse(arguments_of(argc, argv));
    check();
  } catch (const CLI::ParseError& error) {
    return end_parsing(app, error);
  }
  return std::nullopt;
}

}  // namespace tfdude::cli
