#include "usage.hpp"

#include <algorithm>
#include <cstdio>
#include <vector>

#include "tfdude/base/id.hpp"
#include "tfdude/base/similar.hpp"

#include "numbers.hpp"
#include "standard_output.hpp"

namespace tfdude::cli {
namespace {

// The innermost command of those that were typed.
const CLI::App& chosen(const CLI::App& app) {
  const auto below = app.get_subcommands();
  return below.empty() ? app : chosen(*below.front());
}

// "keys issue"; the program's name if it has no commands.
std::string name_of(const CLI::App& command) {
  const CLI::App* parent = command.get_parent();
  if (parent == nullptr) return program_name(command);
  const std::string name = command.get_name();
  return parent->get_parent() == nullptr ? name : name_of(*parent) + " " + name;
}

// "tfdude tree --help"
std::string help_of(const CLI::App& command) {
  const CLI::App* root = &command;
  while (root->get_parent() != nullptr) root = root->get_parent();
  return program_name(*root) + (&command == root ? "" : " " + name_of(command)) + " --help";
}

std::string listed(const std::vector<std::string>& words, const char* last = ", ") {
  std::string text;
  for (std::size_t i = 0; i < words.size(); ++i) {
    if (i > 0) text += i + 1 < words.size() ? ", " : last;
    text += words[i];
  }
  return text;
}

/// @param before  of each known name: "--" for options, whose hyphens make none similar
std::string did_you_mean(const std::string& typed, const std::vector<std::string>& known,
                         const std::string& before = "") {
  auto similar =
      similar_names(typed.substr(std::min(typed.find_first_not_of('-'), typed.size())), known);
  for (std::string& name : similar) name.insert(0, before);
  return similar.empty() ? "" : "; did you mean " + listed(similar, " or ") + "?";
}

std::vector<const CLI::Option*> shown_options(const CLI::App& command, bool positional) {
  return command.get_options([positional](const CLI::Option* option) {
    return !option->get_group().empty() && option->get_positional() == positional;
  });
}

// Without their hyphens.
std::vector<std::string> option_names(const CLI::App& command) {
  std::vector<std::string> names;
  for (const CLI::Option* option : shown_options(command, false)) {
    const std::string name = option->get_name().substr(2);
    if (name != "help") names.push_back(name);
  }
  return names;
}

// "A B"
std::string positionals_of(const CLI::App& command) {
  std::vector<std::string> names;
  for (const CLI::Option* option : shown_options(command, true)) {
    names.push_back(option->get_name(true));
  }
  return listed(names, " ");
}

std::string unknown_option(const CLI::App& command, const std::string& typed) {
  const std::string option = typed.substr(0, typed.find('='));
  std::vector<std::string> own = option_names(command);
  std::vector<std::string> known = own;
  for (const CLI::App* above = command.get_parent(); above != nullptr;
       above = above->get_parent()) {
    const auto more = option_names(*above);
    known.insert(known.end(), more.begin(), more.end());
  }
  std::string text = name_of(command) + " has no " + printable(option);
  if (const auto meant = did_you_mean(option, known, "--"); !meant.empty()) return text + meant;
  if (own.empty()) return text + ": it has no options of its own";
  for (std::string& name : own) name.insert(0, "--");
  return text + "; its options are " + listed(own, " and ");
}

std::string too_many(const CLI::App& command, const std::string& typed) {
  const std::string takes = positionals_of(command);
  return name_of(command) + " takes " + (takes.empty() ? "no arguments" : takes) + ", and not " +
         quote(typed) + ", too";
}

std::vector<std::string> command_names(const CLI::App& app) {
  std::vector<std::string> names;
  for (const CLI::App* command :
       app.get_subcommands([](const CLI::App* one) { return !one->get_group().empty(); })) {
    names.push_back(command->get_name());
  }
  return names;
}

// The first option that was typed, and nothing takes; empty: there is none.
std::string stray_option(const CLI::App& app) {
  const auto typed = app.remaining(true);
  const auto option = std::find_if(typed.begin(), typed.end(), [](const std::string& one) {
    return one.size() > 1 && one[0] == '-' && !is_number(one);
  });
  return option != typed.end() ? *option : "";
}

// What was typed, and nothing takes.
std::string unexpected(const CLI::App& app) {
  const CLI::App& command = chosen(app);
  const auto typed = app.remaining(true);
  if (const auto option = stray_option(app); !option.empty()) {
    return unknown_option(command, option);
  }
  const auto commands = command_names(command);
  if (commands.empty()) return too_many(command, typed.front());
  const std::string of = &command == &app ? "" : name_of(command) + " has ";
  return of + "no command " + quote(typed.front()) + did_you_mean(typed.front(), commands);
}

// What was not typed.
std::string missing(const CLI::App& app, const CLI::ParseError& error) {
  const CLI::App& command = chosen(app);
  const auto commands = command_names(command);
  // An option that does not exist may be what was meant.
  if (!stray_option(app).empty()) return unexpected(app);
  if (!commands.empty()) {
    if (!app.remaining(true).empty()) return unexpected(app);
    return &command == &app ? "no subcommand given"
                            : name_of(command) + " needs one of " + listed(commands, " or ");
  }
  const std::string takes = positionals_of(command);
  return name_of(command) + ": " + error.what() +
         (takes.empty() ? "" : "; wanted: " + name_of(command) + " " + takes);
}

// An option without all of its values.
std::string incomplete(const CLI::App& app, const CLI::ParseError& error) {
  const std::string text = error.what();
  for (const CLI::App* command = &chosen(app); command != nullptr;
       command = command->get_parent()) {
    for (const CLI::Option* option : command->get_options()) {
      const std::string name = option->get_name(option->get_positional());
      if (name.empty() || text.rfind(name + ":", 0) != 0) continue;
      return name_of(chosen(app)) + ": " + name + " wants " + option->get_type_name() + ": " +
             option->get_description();
    }
  }
  return text;
}

class CommandsFirst final : public CLI::Formatter {
 public:
  // Without what excludes what: the error says it if it matters.
  std::string make_option_opts(const CLI::Option* option) const override {
    const std::string text = CLI::Formatter::make_option_opts(option);
    return text.substr(0, text.find(" Excludes:"));
  }
  std::string make_help(const CLI::App* app, std::string name,
                        CLI::AppFormatMode mode) const override {
    if (app->get_parent() != nullptr || mode != CLI::AppFormatMode::Normal) {
      return CLI::Formatter::make_help(app, std::move(name), mode);
    }
    return make_description(app) + make_usage(app, std::move(name)) + make_subcommands(app, mode) +
           make_groups(app, mode) + '\n' + make_footer(app);
  }
};

}  // namespace

std::string program_name(const CLI::App& app) {
  return app.get_description().substr(0, app.get_description().find(':'));
}

std::string usage_error(const CLI::App& app, const CLI::ParseError& error) {
  if (dynamic_cast<const CLI::ExtrasError*>(&error) != nullptr) return unexpected(app);
  if (dynamic_cast<const CLI::RequiredError*>(&error) != nullptr) return missing(app, error);
  const std::string text = dynamic_cast<const CLI::ArgumentMismatch*>(&error) != nullptr
                               ? incomplete(app, error)
                               : std::string();
  if (!text.empty()) return text;
  const CLI::App& command = chosen(app);
  return (&command == &app ? "" : name_of(command) + ": ") + error.what();
}

int end_parsing(const CLI::App& app, const CLI::ParseError& error) {
  if (error.get_exit_code() == 0) {
    (void)app.exit(error);
    return status_with_output(program_name(app), kDone);
  }
  std::fprintf(stderr, "%s: %s\n%s shows what is possible\n", program_name(app).c_str(),
               usage_error(app, error).c_str(), help_of(chosen(app)).c_str());
  return kWrongUsage;
}

void show_commands_first(CLI::App& app) { app.formatter(std::make_shared<CommandsFirst>()); }

}  // namespace tfdude::cli
