#pragma once

#include <memory>

#include <CLI/CLI.hpp>

#include "answer.hpp"
#include "command.hpp"
#include "options.hpp"
#include "stamps.hpp"

// All that the file of a command needs.
namespace tfdude::cli {

/// The commands of the program, and the one that the command line chooses.
class Commands {
 public:
  /// Adds all commands, in their groups.
  explicit Commands(CLI::App& app);

  /// Adds a command.
  /// @param example  of a command line, without "tfdude"
  template <class Chosen>
  void add(const char* name, const char* help, const char* example) {
    add<Chosen>(app_, name, help, example);
  }
  /// The same below another command.
  template <class Chosen>
  void add(CLI::App& parent, const char* name, const char* help, const char* example) {
    CLI::App& app = add_app(parent, name, help, example);
    app.callback([this, command = std::make_shared<Chosen>(app)] { chosen_ = command; });
  }
  /// Adds a command that has others below it.
  CLI::App& add_parent_command(const char* name, const char* help, const char* example);

  /// After parsing.
  [[nodiscard]] const Command& chosen() const { return *chosen_; }

 private:
  CLI::App& add_app(CLI::App& parent, const char* name, const char* help, const char* example);

  CLI::App& app_;
  const char* group_ = "";
  std::shared_ptr<const Command> chosen_;
};

}  // namespace tfdude::cli
