// The command line: each run is one query or one change.

#include <algorithm>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <string>
#include <string_view>
#include <unistd.h>
#include <vector>

#include <CLI/CLI.hpp>

#include "tfdude/base/id.hpp"
#include "tfdude/transport/fastdds.hpp"
#include "tfdude/types/version.hpp"

#include "../manual.hpp"
#include "../network_options.hpp"
#include "../numbers.hpp"
#include "changing_options.hpp"
#include "command_options.hpp"
#include "commands.hpp"
#include "complete.hpp"
#include "keys_commands.hpp"
#include "recording_options.hpp"
#include "terminal.hpp"
#include "value_options.hpp"
#include "web_command.hpp"

namespace {

using namespace tfdude;
using cli::add_command;
using cli::add_ends;
using cli::add_id;
using cli::add_out;
using cli::add_stamp;
using cli::Arguments;
using cli::Command;
using cli::within;

constexpr long kTimeoutByServer = 3000;  // [ms]
constexpr const char* kWatchHelp = "redraw it twice a second, until interrupted";

constexpr const char* kCovarianceHelp = "print the full covariance";

void add_common_options(CLI::App& app, Arguments& arguments, long& timeout_ms) {
  cli::add_network_options(app, arguments.options);
  cli::add_clock_option(app, [&](ClockKind kind) { arguments.options.clock = kind; });
  app.add_option("--timeout", timeout_ms, "how long to wait for an answer [ms]")
      ->check(CLI::Range(1, 3600000));
  app.add_flag("--json", arguments.json, "one JSON object per answer");
  app.add_flag_callback(
      "--deg", [&arguments] { arguments.angles = cli::kDegree; },
      "angles in degrees instead of radians, typed and printed; answers in JSON have radians");
}

// A command about one or two frames asks for them, instead of receiving all frames.
void ask_only(CLI::App* command, Arguments& arguments) {
  command->parse_complete_callback([&arguments] { arguments.options.follow.emplace(); });
}

void add_milliseconds(CLI::App* command, const char* name, double& value, const char* help) {
  command->add_option(name, value, help)->type_name("MS")->check(within(0, 3.6e6, "0 to 3600000"));
}

void add_printing(CLI::App* command, Arguments& arguments) {
  command->add_flag("--cov", arguments.covariance, kCovarianceHelp);
  command->add_flag("--matrix", arguments.matrix, "print the pose as homogeneous 4x4 matrix");
  cli::explain_angles(*command);
}

void add_rate(CLI::App* command, double& rate, const char* help) {
  command->add_option("--rate", rate, help)->check(within(0.001, 1000, "0.001 to 1000"));
}

void add_lookup_command(CLI::App& app, Arguments& arguments, Command& chosen,
                        cli::LocalCommand& local) {
  auto* lookup = add_command(
      app, "lookup", "pose of B in A, with its uncertainty", "lookup world hand_left --cov",
      [](Client& client, const Arguments& given) {
        return given.watch ? cli::follow_lookup(client, given) : cli::run_lookup(client, given);
      },
      chosen);
  ask_only(lookup, arguments);
  add_ends(lookup, arguments);
  add_printing(lookup, arguments);
  auto* watch = lookup->add_flag("--watch", arguments.watch, kWatchHelp);
  cli::add_instant(lookup, arguments);
  auto* fixed =
      lookup->add_option("--fixed", arguments.fixed,
                         "frame that does not move between --at (for A) and --at-b (for B)");
  add_stamp(lookup, "--at-b", arguments.other_stamp, "the instant for B; --at is for A");
  lookup->get_option("--at-b")->needs(fixed);
  add_milliseconds(lookup, "--extrapolate", arguments.extrapolate_ms,
                   "how far to extrapolate beyond an edge's newest sample");
  lookup->add_flag("--age-noise", arguments.age_noise,
                   "add the edges' process noise from --at until now");
  cli::add_order(lookup, arguments);
  add_milliseconds(lookup, "--wait", arguments.wait_ms, "how long to wait for frames and data");
  lookup->get_option("--wait")->excludes(fixed);
  cli::add_recording(lookup, arguments, local, cli::run_lookup);
  for (const char* other : {"--at", "--extrapolate", "--age-noise", "--order", "--wait"}) {
    watch->excludes(lookup->get_option(other));
  }
  watch->excludes(fixed);
  watch->excludes(lookup->get_option("--recording"));
}

void add_velocity_command(CLI::App& app, Arguments& arguments, Command& chosen) {
  auto* velocity = add_command(app, "velocity", "mean velocity of B in A over an interval",
                               "velocity world hand_left --over 0.05", cli::run_velocity, chosen);
  ask_only(velocity, arguments);
  add_ends(velocity, arguments);
  velocity->add_flag("--cov", arguments.covariance, kCovarianceHelp);
  cli::explain_angles(*velocity);
  add_stamp(velocity, "--at", arguments.stamp,
            "the middle of the interval: seconds since the epoch or, negative, before now; "
            "default: it ends at the latest common time");
  velocity->add_option("--over", arguments.over, "length of the interval [s]")
      ->check(within(1e-6, 1e6, "1e-6 to 1e6"));
}

// Commands that follow changes, most of them until interrupted.
void add_following_commands(CLI::App& app, Arguments& arguments, Command& chosen,
                            cli::LocalCommand& local) {
  auto* watch = add_command(app, "watch", "follow a path: its owners push what changes",
                            "watch world hand_left --rate 5", cli::run_watch, chosen);
  auto* echo =
      add_command(app, "echo", "follow a path on one page: position, angles, deviations, age",
                  "echo world hand_left", cli::run_echo, chosen);
  for (CLI::App* command : {watch, echo}) {
    add_ends(command, arguments);
    add_rate(command, arguments.rate, "output rate, and the owners' highest rate of sending [Hz]");
    command->add_flag("--composed", arguments.composed,
                      "each owner sends its part of the path as one transform");
  }
  cli::add_recorded(echo, arguments, local, cli::run_recorded_echo);
  add_printing(watch, arguments);
  cli::explain_angles(*echo);
  auto* monitor = add_command(app, "monitor", "rate, age and jitter of all dynamic edges",
                              "monitor --once", cli::run_monitor, chosen);
  add_rate(monitor, arguments.rate, "output rate [Hz]");
  monitor->add_flag("--once", arguments.once, "print it once");
  cli::explain_angles(*monitor);
  add_id(add_command(app, "history", "an edge's history: samples, rate, age, rejected samples",
                     "history hand_left", cli::run_history, chosen),
         arguments);
}

void add_reading_commands(CLI::App& app, Arguments& arguments, Command& chosen,
                          cli::LocalCommand& local) {
  auto* tree =
      add_command(app, "tree", "draw all frames with their owners", "tree", cli::run_tree, chosen);
  cli::add_recording(tree, arguments, local, cli::run_tree);
  tree->add_flag("--watch", arguments.watch, kWatchHelp)->excludes(tree->get_option("--recording"));
  auto* frames =
      add_command(app, "frames", "list all frames", "--json frames", cli::run_frames, chosen);
  cli::add_recording(frames, arguments, local, cli::run_frames);
  add_command(app, "partitions", "list all partitions", "partitions", cli::run_partitions, chosen);
  add_command(app, "roots", "list roots: frames whose parent does not exist", "roots",
              cli::run_roots, chosen);
  add_id(
      add_command(app, "parent", "a frame's parent", "parent hand_left", cli::run_parent, chosen),
      arguments);
  add_id(add_command(app, "children", "a frame's children", "children arm_1", cli::run_children,
                     chosen),
         arguments);
  auto* exists = add_command(app, "exists", "whether a frame exists", "exists camera",
                             cli::run_exists, chosen);
  ask_only(exists, arguments);
  add_id(exists, arguments);
  add_lookup_command(app, arguments, chosen, local);
  add_velocity_command(app, arguments, chosen);
}

void add_picture_commands(CLI::App& app, Arguments& arguments, Command& chosen,
                          cli::LocalCommand& local) {
  auto* plot =
      add_command(app, "plot", "draw where B is in A, with its uncertainty",
                  "plot world hand_left --out hand.svg --samples 2000", cli::run_plot, chosen);
  add_ends(plot, arguments);
  add_out(plot, arguments, {".svg", ".png"});
  plot->add_option("--samples", arguments.samples,
                   "number of points to sample from the edges' errors")
      ->check(CLI::Range(1, 100000));
  cli::add_instant(plot, arguments);
  cli::add_recording(plot, arguments, local, cli::run_plot);
  auto* graph = add_command(app, "graph", "draw all frames with their owners, ages, deviations",
                            "graph --out frames.svg", cli::run_graph, chosen);
  add_out(graph, arguments, {".svg", ".png", ".dot"});
  graph->add_option("--root", arguments.id, "draw this frame and all below it");
  graph->add_option("--depth", arguments.depth,
                    "levels below a root; default: as many as fit a screen");
  cli::add_recording(graph, arguments, local, cli::run_graph);
  for (CLI::App* command : {plot, graph}) cli::explain_angles(*command);
}

void add_description_command(CLI::App& app, Arguments& arguments, Command& chosen) {
  add_command(app, "description", "print the URDF that a partition's daemon serves",
              "description arm > arm.urdf", cli::run_description, chosen)
      ->add_option("PARTITION", arguments.partition, "the partition")
      ->required();
}

void add_events_command(CLI::App& app, Arguments& arguments, Command& chosen,
                        cli::LocalCommand& local) {
  auto* events =
      add_command(app, "events", "print changes: partitions that come and go, frames, conflicts",
                  "--json events", cli::run_events, chosen);
  cli::add_recorded(events, arguments, local, cli::run_recorded_events);
}

int run(Arguments arguments, const Command& command, const cli::LocalCommand& local) {
  if (local) return local(arguments);
  int status = cli::kNeedsAllFrames;
  while (status == cli::kNeedsAllFrames) {
    auto client = Client::open(arguments.options);
    if (!client) {
      (void)cli::report(client.error(), arguments);
      return cli::kWrongUsage;
    }
    status = command(*client, arguments);
    arguments.options.follow.reset();
  }
  return status;
}

}  // namespace

// NOLINTNEXTLINE(bugprone-exception-escape): only a lack of memory throws, and should end it
int main(int argc, char** argv) {
  // It has options of its own.
  if (argc > 1 && argv[1] == std::string_view("web")) return cli::become_web(argc, argv, 1);
  Arguments arguments;
  Command command;
  long timeout_ms = arguments.options.timeout.count();
  CLI::App app{"tfdude: where is frame B seen from frame A, and how sure are we?"};
  app.footer(
      "Exit status: 0 done, 1 request rejected, 2 wrong usage, 3 no answer.\n"
      "Example: tfdude lookup world hand_left");
  app.set_version_flag("--version", version_line());
  app.require_subcommand(1);
  app.fallthrough();
  add_common_options(app, arguments, timeout_ms);
  cli::LocalCommand local;
  add_reading_commands(app, arguments, command, local);
  add_following_commands(app, arguments, command, local);
  add_events_command(app, arguments, command, local);
  cli::add_changing_commands(app, arguments, command);
  add_picture_commands(app, arguments, command, local);
  cli::add_value_commands(app, arguments, command, local);
  add_description_command(app, arguments, command);
  cli::add_recording_commands(app, arguments, command, local);
  cli::add_web_command(app, argc, argv, local);
  cli::add_keys_commands(app, arguments.keys, local);
  auto* doctor = cli::add_command(app, "doctor", "find out why nobody is met, and what to do",
                                  "doctor", [&local] { local = cli::run_doctor; });
  doctor->footer("Exit status: 0 no problem found, 1 problems found, 2 wrong usage.\n" +
                 doctor->get_footer());
  cli::require_numbers(app);
  cli::add_manual(app);
  if (argc > 1 && argv[1] == std::string_view("__complete")) {
    cli::complete(app, {argv + 2, argv + argc});
  }
  try {
    app.name(argv[0]);
    app.parse(cli::arguments_of(argc, argv));
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) return app.exit(error);
    const auto unknown = app.remaining();
    const bool no_command = app.get_subcommands().empty() && !unknown.empty();
    const std::string what = no_command ? "no command " + quote(unknown.front()) : error.what();
    // Looks for --json itself: CLI11 does not fill `arguments` from a wrong command line.
    if (std::find(argv, argv + argc, std::string_view("--json")) != argv + argc) {
      return cli::report_usage(what);
    }
    if (no_command) std::fprintf(stderr, "tfdude: %s\n", what.c_str());
    (void)app.exit(error);
    return cli::kWrongUsage;
  }
  // Discovery by a server takes most of the default timeout of a second.
  const bool by_server = !arguments.options.discovery_server.empty();
  if (by_server && app.count("--timeout") == 0) timeout_ms = kTimeoutByServer;
  arguments.options.timeout = Milliseconds(timeout_ms);
  cli::to_radians(arguments.spec, arguments.angles);
  arguments.options.discovery = arguments.options.timeout;
  // Before any thread starts, so that commands that run until interrupted can wait for them.
  sigset_t stop_signals;
  sigemptyset(&stop_signals);
  sigaddset(&stop_signals, SIGINT);
  sigaddset(&stop_signals, SIGTERM);
  const auto follows = {"watch", "echo", "monitor", "events", "record", "replay"};
  const bool until_interrupted =
      arguments.watch || !arguments.from.empty() ||
      std::any_of(follows.begin(), follows.end(),
                  [&app](const char* name) { return app.got_subcommand(name); });
  if (until_interrupted) pthread_sigmask(SIG_BLOCK, &stop_signals, nullptr);
  log_fastdds_to_standard_error();
  cli::terminal() = cli::terminal_of(STDOUT_FILENO);
  const int status = run(arguments, command, local);
  const bool written = std::fflush(stdout) == 0 && std::ferror(stdout) == 0;
  if (!written) std::perror("tfdude: standard output");
  // Fast DDS's static destructors would sleep 100 ms.
  _exit(status == cli::kDone && !written ? cli::kRefused : status);
}
