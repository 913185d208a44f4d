// The command line: each run is one query or one change.

#include <algorithm>
#include <cstdio>
#include <string>
#include <string_view>
#include <unistd.h>

#include <CLI/CLI.hpp>

#include "tfdude/transport/fastdds.hpp"
#include "tfdude/types/version.hpp"

#include "../manual.hpp"
#include "../network_options.hpp"
#include "../numbers.hpp"
#include "../rendering/terminal.hpp"
#include "../standard_descriptors.hpp"
#include "../standard_output.hpp"
#include "../stop_signals.hpp"
#include "../usage.hpp"
#include "answer.hpp"
#include "commands.hpp"
#include "complete.hpp"

namespace {

using namespace tfdude;
using cli::Common;

void add_common_options(CLI::App& app, Common& common) {
  cli::add_network_options(app, common.options);
  cli::add_clock_option(app, [&](ClockKind kind) { common.options.clock = kind; });
  app.add_option_function<long>(
         "--timeout", [&](long ms) { common.options.timeout = Milliseconds(ms); },
         "how long to wait for an answer [ms]")
      ->check(CLI::Range(1, 3600000));
  app.add_flag("--json", common.json, "one JSON object per answer");
  app.add_flag_callback(
      "--deg", [&common] { common.angles = cli::kDegree; },
      "angles in degrees instead of radians, typed and printed; answers in JSON have radians");
}

}  // namespace

int main(int argc, char** argv) {
  cli::hold_standard_descriptors();
  Common common;
  common.argv = argv;
  CLI::App app{"tfdude: where is frame B seen from frame A, and how sure are we?"};
  app.footer(
      "Exit status: 0 done, 1 request rejected, 2 wrong usage, 3 no answer.\n"
      "Example: tfdude lookup world hand_left");
  app.set_version_flag("--version", version_line());
  app.require_subcommand(1);
  app.fallthrough();
  cli::show_commands_first(app);
  add_common_options(app, common);
  const cli::Commands commands(app);
  cli::require_numbers(app);
  cli::add_manual(app);
  if (argc > 1 && argv[1] == std::string_view("__complete")) {
    cli::complete(app, {argv + 2, argv + argc});
  }
  try {
    app.name(argv[0]);
    app.parse(cli::arguments_of(argc, argv));
  } catch (const CLI::ParseError& error) {
    // Looks for --json itself: CLI11 does not fill `common` from a wrong command line.
    const bool json = std::find(argv, argv + argc, std::string_view("--json")) != argv + argc;
    if (json && error.get_exit_code() != 0) {
      return cli::status_with_output("tfdude", cli::report_usage(cli::usage_error(app, error)));
    }
    return cli::end_parsing(app, error);
  }
  // Discovery by a server takes most of the default timeout of a second.
  const bool by_server = !common.options.discovery_server.empty();
  if (by_server && app.count("--timeout") == 0) common.options.timeout = Milliseconds(3000);
  common.options.discovery = common.options.timeout;
  // Before any thread starts.
  if (commands.chosen().until_interrupted) cli::block_stop_signals();
  log_fastdds_to_standard_error();
  cli::terminal() = cli::terminal_of(STDOUT_FILENO);
  const int status = cli::status_with_output("tfdude", commands.chosen().run(common));
  // Fast DDS's static destructors would sleep 100 ms.
  _exit(status);
}
