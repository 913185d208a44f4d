#include "command_options.hpp"

#include <cstdint>
#include <cstdlib>

#include "commands.hpp"

namespace tfdude::cli {

CLI::App* add_command(CLI::App& app, const char* name, const char* help, const char* example,
                      const std::function<void()>& choose) {
  CLI::App* command = app.add_subcommand(name, help);
  command->footer(std::string("Example: tfdude ") + example);
  command->callback(choose);
  return command;
}

CLI::Option* add_stamp(CLI::App* command, const char* name, std::string& stamp, const char* help) {
  return command->add_option(name, stamp, help)
      ->type_name("SECONDS")
      ->check([](const std::string& text) {
        const auto parsed = parse_stamp(text, Time(std::chrono::seconds(INT32_MAX)));
        return parsed ? std::string() : parsed.error().message;
      });
}

std::function<std::string(const std::string&)> within(double least, double most,
                                                      const char* range) {
  return [=](const std::string& text) {
    const double value = std::strtod(text.c_str(), nullptr);
    return value >= least && value <= most ? "" : text + " is not within " + range;
  };
}

}  // namespace tfdude::cli
