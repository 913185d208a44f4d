#include <cerrno>
#include <cstdio>
#include <filesystem>
#include <string>
#include <string_view>
#include <system_error>
#include <unistd.h>
#include <vector>

#include "../commands.hpp"

namespace tfdude::cli {
namespace {

// Another program, with options of its own.
struct Web final : Command {
  explicit Web(CLI::App& app) { app.fallthrough(false)->allow_extras()->set_help_flag(); }

  // Becomes the program tfdude-web, with all arguments but the one that names the command.
  int run(const Common& common) const override {
    std::error_code ignored;
    const auto own = std::filesystem::read_symlink("/proc/self/exe", ignored);
    const auto programs = own.parent_path() / TFDUDE_PROGRAMS;
    std::string program = (programs / "tfdude-web").lexically_normal().string();
    std::vector<char*> arguments{program.data()};
    bool named = false;
    for (char** argument = common.argv + 1; *argument != nullptr; ++argument) {
      const bool names = !named && *argument == std::string_view("web");
      if (!names) arguments.push_back(*argument);
      named = named || names;
    }
    arguments.push_back(nullptr);
    execv(program.c_str(), arguments.data());
    const std::error_code why(errno, std::generic_category());
    std::fprintf(stderr, "tfdude: cannot start %s: %s\n", program.c_str(), why.message().c_str());
    return kWrongUsage;
  }
};

}  // namespace

void add_web(Commands& commands) {
  commands.add<Web>("web", "show all frames and their uncertainty in a browser", "web --port 8765");
}

}  // namespace tfdude::cli
