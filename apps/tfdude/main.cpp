// The command line: one question or change at a time.

#include <algorithm>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <string>
#include <string_view>
#include <unistd.h>

#include <CLI/CLI.hpp>

#include "tfdude/base/id.hpp"
#include "tfdude/transport/fastdds.hpp"

#include "commands.hpp"

namespace {

using namespace tfdude;
using cli::Arguments;

constexpr long kTimeoutByServer = 3000;  // [ms]

using Command = std::function<int(Client&, const Arguments&)>;

void add_pose_options(CLI::App& command, Arguments& arguments) {
  auto& spec = arguments.spec;
  command.add_option("--xyz", spec.xyz, "translation [m]")->type_name("X Y Z");
  auto* rpy = command.add_option("--rpy", spec.rpy, "rotation about fixed axes X, Y, Z [rad]");
  rpy->type_name("R P Y");
  command.add_option("--quat", spec.quat, "rotation as unit quaternion")
      ->type_name("X Y Z W")
      ->excludes(rpy);
  auto* stddev =
      command.add_option("--stddev", spec.stddev, "standard deviations [m m m rad rad rad]")
          ->type_name("6 NUMBERS");
  command.add_option("--cov", spec.cov, "upper triangle of the covariance row by row")
      ->type_name("21 NUMBERS")
      ->excludes(stddev);
}

void add_common_options(CLI::App& app, Arguments& arguments, long& timeout_ms) {
  app.add_option("--domain", arguments.options.domain, "DDS domain, 0 to 232")
      ->check(CLI::Range(0, 232));
  app.add_option("--profile", arguments.options.profile, "XML file of DDS profiles");
  app.add_option("--discovery-server", arguments.options.discovery_server,
                 "HOST:PORT of a Fast DDS discovery server")
      ->check([](const std::string& text) {
        const auto good = check_discovery_server(text);
        return good ? std::string() : good.error().message;
      });
  app.add_option("--timeout", timeout_ms, "how long to wait for an answer [ms]")
      ->check(CLI::Range(1, 3600000));
  app.add_flag("--json", arguments.json, "one JSON object an answer");
}

CLI::App* add_command(CLI::App& app, const char* name, const char* help, const char* example,
                      Command run, Command& chosen) {
  CLI::App* command = app.add_subcommand(name, help);
  command->footer(std::string("Example: tfdude ") + example);
  command->callback([&chosen, run = std::move(run)] { chosen = run; });
  return command;
}

void add_id(CLI::App* command, Arguments& arguments) {
  command->add_option("ID", arguments.id, "the frame")->required();
}

void add_ends(CLI::App* command, Arguments& arguments) {
  command->add_option("A", arguments.id, "the frame to see from")->required();
  command->add_option("B", arguments.other, "the frame seen")->required();
}

void add_reading_commands(CLI::App& app, Arguments& arguments, Command& chosen) {
  add_command(app, "tree", "draw all frames with their owners", "tree", cli::run_tree, chosen);
  add_command(app, "frames", "list all frames", "--json frames", cli::run_frames, chosen);
  add_command(app, "partitions", "list all partitions", "partitions", cli::run_partitions, chosen);
  add_command(app, "roots", "list frames without a parent", "roots", cli::run_roots, chosen);
  add_id(
      add_command(app, "parent", "a frame's parent", "parent hand_left", cli::run_parent, chosen),
      arguments);
  add_id(add_command(app, "children", "a frame's children", "children arm_1", cli::run_children,
                     chosen),
         arguments);
  add_id(add_command(app, "exists", "whether a frame exists", "exists camera", cli::run_exists,
                     chosen),
         arguments);
  auto* lookup = add_command(app, "lookup", "pose of B in A, with its uncertainty",
                             "lookup world hand_left --cov", cli::run_lookup, chosen);
  add_ends(lookup, arguments);
  lookup->add_flag("--cov", arguments.covariance, "print the full covariance");
  auto* watch = add_command(app, "watch", "look up again and again",
                            "watch world hand_left --rate 5", cli::run_watch, chosen);
  add_ends(watch, arguments);
  watch->add_option("--rate", arguments.rate, "times a second [Hz]")
      ->check([](const std::string& text) {
        // Not CLI::Range, which takes NaN.
        const double rate = std::strtod(text.c_str(), nullptr);
        return rate >= 0.001 && rate <= 1000.0 ? "" : text + " is not within 0.001 to 1000";
      });
}

void add_events_command(CLI::App& app, Command& chosen) {
  add_command(app, "events", "tell what changes: partitions that come and go, frames, conflicts",
              "--json events", cli::run_events, chosen);
}

void add_changing_commands(CLI::App& app, Arguments& arguments, Command& chosen) {
  auto* add = add_command(app, "add", "add a frame", "add tool --parent camera --xyz 0.1 0 -0.2",
                          cli::run_add, chosen);
  add_id(add, arguments);
  add->add_option("--parent", arguments.parent, "its parent")->required();
  add->add_option("--partition", arguments.partition, "its owner, if not its parent's");
  add_pose_options(*add, arguments);
  auto* update = add_command(app, "update", "give an edge a new value",
                             "update tool --rpy 0 0 1.57", cli::run_update, chosen);
  add_id(update, arguments);
  add_pose_options(*update, arguments);
  add_id(add_command(app, "remove", "remove a frame and all below it", "remove tool",
                     cli::run_remove, chosen),
         arguments);
  auto* move = add_command(app, "move", "hang a frame under a new parent",
                           "move tool --parent arm_2", cli::run_move, chosen);
  add_id(move, arguments);
  move->add_option("--parent", arguments.parent, "the new parent")->required();
  add_pose_options(*move, arguments);
}

int run(const Arguments& arguments, const Command& command) {
  auto client = Client::open(arguments.options);
  if (!client) {
    (void)cli::report(client.error(), arguments);
    return cli::kWrongUsage;
  }
  return command(*client, arguments);
}

}  // namespace

// NOLINTNEXTLINE(bugprone-exception-escape): nothing but a lack of memory, which should end it
int main(int argc, char** argv) {
  Arguments arguments;
  Command command;
  long timeout_ms = arguments.options.timeout.count();
  CLI::App app{"tfdude: where is frame B seen from frame A, and how sure are we?"};
  app.footer("Exit status: 0 done, 1 the service said no, 2 wrong usage, 3 no answer.");
  app.require_subcommand(1);
  app.fallthrough();
  add_common_options(app, arguments, timeout_ms);
  add_reading_commands(app, arguments, command);
  add_events_command(app, command);
  add_changing_commands(app, arguments, command);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) return app.exit(error);
    const auto unknown = app.remaining();
    const bool no_command = app.get_subcommands().empty() && !unknown.empty();
    const std::string what = no_command ? "no command " + quote(unknown.front()) : error.what();
    // Not in arguments, which a command line that is wrong has not filled.
    if (std::find(argv, argv + argc, std::string_view("--json")) != argv + argc) {
      return cli::report_usage(what);
    }
    if (no_command) std::fprintf(stderr, "tfdude: %s\n", what.c_str());
    (void)app.exit(error);
    return cli::kWrongUsage;
  }
  // To meet by a server takes most of the usual second.
  const bool by_server = !arguments.options.discovery_server.empty();
  if (by_server && app.count("--timeout") == 0) timeout_ms = kTimeoutByServer;
  arguments.options.timeout = Milliseconds(timeout_ms);
  arguments.options.discovery = arguments.options.timeout;
  // Before any thread starts, so that watch and events can wait for them.
  sigset_t stop_signals;
  sigemptyset(&stop_signals);
  sigaddset(&stop_signals, SIGINT);
  sigaddset(&stop_signals, SIGTERM);
  if (app.got_subcommand("watch") || app.got_subcommand("events"))
    pthread_sigmask(SIG_BLOCK, &stop_signals, nullptr);
  const int status = run(arguments, command);
  const bool written = std::fflush(stdout) == 0 && std::ferror(stdout) == 0;
  if (!written) std::perror("tfdude: standard output");
  // Fast DDS's static destructors would sleep 100 ms.
  _exit(status == cli::kDone && !written ? cli::kRefused : status);
}
