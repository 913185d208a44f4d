#include <CLI/CLI.hpp>

#include "tfdude/types/version.hpp"

#include "../command_line.hpp"
#include "../network_options.hpp"
#include "settings.hpp"

namespace tfdude::web {

std::optional<int> read_arguments(int argc, char** argv, Settings& settings) {
  CLI::App app{"tfdude-web: shows all frames and their uncertainty in a browser"};
  app.footer(
      "Then open the address that it prints.\n"
      "Exit status: 0 stopped by a signal, 1 the port or DDS cannot be opened, 2 wrong usage, or a "
      "file is missing.\n"
      "Example: tfdude web --domain 7");
  app.set_version_flag("--version", version_line());
  app.add_option("--bind", settings.server.address,
                 "address to listen on; if others can reach it, a token is needed, which is "
                 "printed")
      ->capture_default_str();
  app.add_option("--port", settings.server.port, "port to listen on; 0: any that is free")
      ->capture_default_str()
      ->check(CLI::Range(0, 65535));
  app.add_option("--rate", settings.server.rate, "pictures a second, at most [Hz]")
      ->capture_default_str()
      ->check(CLI::Range(1.0, 60.0));
  app.add_option("--allow-origin", settings.origins,
                 "other pages that may connect, such as https://app.foxglove.dev; may be repeated")
      ->allow_extra_args(false);
  app.add_option("--urdf", settings.urdf, "URDF of the robot: shows the shapes of its links");
  app.add_option("--packages", settings.packages,
                 "folder of packages, in which the URDF's meshes are found; may be repeated")
      ->allow_extra_args(false);
  app.add_option("--max-recording", settings.most_recording,
                 "largest recording that may be dropped on the page [MiB]; 0: none")
      ->capture_default_str()
      ->check(CLI::Range(0, 1 << 20));
  cli::add_network_options(app, settings.options);
  cli::add_clock_option(app, [&](ClockKind kind) { settings.options.clock = kind; });
  return cli::read_command_line(app, argc, argv);
}

}  // namespace tfdude::web
