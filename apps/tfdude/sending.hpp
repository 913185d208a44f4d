#pragma once

#include <optional>
#include <string>

#include <CLI/CLI.hpp>

#include "command.hpp"

namespace tfdude::cli {

/// Samples from the lines of a file or pipe.
struct SampleLines {
  /// Adds --rate. @param input  the option of the file
  void add_rate(CLI::App& app, CLI::Option* input);
  /// Sends all of them, until their end or an interrupt.
  /// @param acknowledged  joints only, each line one commit of each owner
  /// @return the exit status
  int send(Client& client, const Common& common, bool acknowledged) const;

  std::string file;            ///< "-": standard input
  std::optional<double> rate;  ///< lines per second
};

}  // namespace tfdude::cli
