#pragma once

#include <functional>

#include <CLI/CLI.hpp>

#include "commands.hpp"

namespace tfdude::cli {

/// A command that needs no participant.
using LocalCommand = std::function<int(const Arguments&)>;

/// Adds `keys` and its commands, which make and check the files of DDS Security.
void add_keys_commands(CLI::App& app, KeysArguments& keys, LocalCommand& chosen);

}  // namespace tfdude::cli
