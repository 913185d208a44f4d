#include "web_command.hpp"

#include <cerrno>
#include <cstdio>
#include <filesystem>
#include <string>
#include <system_error>
#include <unistd.h>
#include <vector>

#include "commands.hpp"

namespace tfdude::cli {

int become_web(int argc, char** argv) {
  std::error_code ignored;
  const auto own = std::filesystem::read_symlink("/proc/self/exe", ignored);
  std::string program = (own.parent_path() / "tfdude-web").string();
  std::vector<char*> arguments{program.data()};
  for (int i = 2; i < argc; ++i) arguments.push_back(argv[i]);
  arguments.push_back(nullptr);
  execv(program.c_str(), arguments.data());
  const std::error_code why(errno, std::generic_category());
  std::fprintf(stderr, "tfdude: cannot start %s: %s\n", program.c_str(), why.message().c_str());
  return kWrongUsage;
}

void add_web_command(CLI::App& app, LocalCommand& chosen) {
  app.add_subcommand("web", "show all frames and their uncertainty in a browser")
      ->callback([&chosen] {
        chosen = [](const Arguments& /*arguments*/) {
          std::fputs("tfdude: write web first, and its options behind it\n", stderr);
          return kWrongUsage;
        };
      });
}

}  // namespace tfdude::cli
