#include "web_command.hpp"

#include <cerrno>
#include <cstdio>
#include <filesystem>
#include <string>
#include <string_view>
#include <system_error>
#include <unistd.h>
#include <vector>

#include "commands.hpp"

namespace tfdude::cli {

int become_web(int argc, char** argv, int command) {
  std::error_code ignored;
  const auto own = std::filesystem::read_symlink("/proc/self/exe", ignored);
  std::string program = (own.parent_path() / "tfdude-web").string();
  std::vector<char*> arguments{program.data()};
  for (int i = 1; i < argc; ++i) {
    if (i != command) arguments.push_back(argv[i]);
  }
  arguments.push_back(nullptr);
  execv(program.c_str(), arguments.data());
  const std::error_code why(errno, std::generic_category());
  std::fprintf(stderr, "tfdude: cannot start %s: %s\n", program.c_str(), why.message().c_str());
  return kWrongUsage;
}

void add_web_command(CLI::App& app, int argc, char** argv, LocalCommand& chosen) {
  app.add_subcommand("web", "show all frames and their uncertainty in a browser")
      ->fallthrough(false)
      ->allow_extras()
      ->footer("Example: tfdude web --port 8765")
      ->callback([&chosen, argc, argv] {
        chosen = [argc, argv](const Arguments& /*arguments*/) {
          int command = 1;
          while (argv[command] != std::string_view("web")) ++command;
          return become_web(argc, argv, command);
        };
      });
}

}  // namespace tfdude::cli
