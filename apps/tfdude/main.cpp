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
#include "command_options.hpp"
#include "commands.hpp"
#include "complete.hpp"
#include "keys_commands.hpp"
#include "recording_options.hpp"
#include "value_options.hpp"
#include "web_command.hpp"

namespace {

using namespace tfdude;
using cli::add_out;
using cli::add_pose_options;
using cli::add_stamp;
using cli::Arguments;
using cli::within;

constexpr long kTimeoutByServer = 3000;  // [ms]
constexpr const char* kWatchHelp = "redraw it twice a second, until interrupted";

constexpr const char* kCovarianceHelp = "print the full covariance";

using Command = std::function<int(Client&, const Arguments&)>;

void add_common_options(CLI::App& app, Arguments& arguments, long& timeout_ms) {
  cli::add_network_options(app, arguments.options);
  cli::add_clock_option(app, [&](ClockKind kind) { arguments.options.clock = kind; });
  app.add_option("--timeout", timeout_ms, "how long to wait for an answer [ms]")
      ->check(CLI::Range(1, 3600000));
  app.add_flag("--json", arguments.json, "one JSON object per answer");
  app.add_flag_callback(
      "--deg", [&arguments] { arguments.angles = cli::kDegree; },
      "angles in degrees instead of radians, typed and printed; JSON always has "
      "radians");
}

CLI::App* add_command(CLI::App& app, const char* name, const char* help, const char* example,
                      Command run, Command& chosen) {
  return cli::add_command(app, name, help, example,
                          [&chosen, run = std::move(run)] { chosen = run; });
}

// A command about one or two frames asks for them, instead of receiving all frames.
void ask_only(CLI::App* command, Arguments& arguments) {
  command->parse_complete_callback([&arguments] { arguments.options.follow.emplace(); });
}

void add_id(CLI::App* command, Arguments& arguments) {
  command->add_option("ID", arguments.id, "the frame")->required();
}

void add_ends(CLI::App* command, Arguments& arguments) {
  command->add_option("A", arguments.id, "the reference frame")->required();
  command->add_option("B", arguments.other, "the frame seen from A")->required();
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
  add_stamp(lookup, "--at", arguments.stamp,
            "the instant: seconds since the epoch or, negative, before now");
  auto* fixed =
      lookup->add_option("--fixed", arguments.fixed,
                         "frame that does not move between --at (for A) and --at-b (for B)");
  add_stamp(lookup, "--at-b", arguments.other_stamp, "the instant for B; --at is for A");
  lookup->get_option("--at-b")->needs(fixed);
  add_milliseconds(lookup, "--extrapolate", arguments.extrapolate_ms,
                   "how far to extrapolate beyond an edge's newest sample");
  lookup->add_flag("--age-noise", arguments.age_noise,
                   "add the edges' process noise from --at until now");
  lookup->add_option("--order", arguments.order, "order of covariance propagation: 2 or 4")
      ->check(CLI::IsMember({2, 4}));
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

void add_measuring_commands(CLI::App& app, Arguments& arguments, Command& chosen) {
  auto* observe =
      add_command(app, "observe", "correct the edges of a path by a measurement of B in A",
                  "observe world tool --xyz 0.8 0.1 1.1 --stddev 1e-3 1e-3 1e-3 "
                  "2e-3 2e-3 2e-3",
                  cli::run_observe, chosen);
  add_ends(observe, arguments);
  auto* fuse = add_command(app, "fuse", "fuse a measurement of an edge with its value",
                           "fuse camera --xyz 0.1 0 0.3 --stddev 1e-3 1e-3 1e-3 2e-3 2e-3 2e-3",
                           cli::run_fuse, chosen);
  add_id(fuse, arguments);
  for (CLI::App* command : {observe, fuse}) {
    add_pose_options(*command, arguments);
    add_stamp(command, "--stamp", arguments.stamp,
              "when it was measured: seconds since the epoch or, negative, before now");
    command
        ->add_option("--gate", arguments.observe.gate,
                     "chi-squared gate probability; 1: accept all")
        ->check([](const std::string& text) {
          const double gate = std::strtod(text.c_str(), nullptr);
          return gate > 0 && gate <= 1 ? "" : text + " is not above 0 and at most 1";
        });
    command->add_flag_callback(
        "--correlated", [&arguments] { arguments.observe.independent = false; },
        "possibly correlated with the edges: use covariance intersection");
  }
}

void add_correlate_command(CLI::App& app, Arguments& arguments, Command& chosen) {
  auto* correlate =
      add_command(app, "correlate", "declare how an edge's error is correlated with others",
                  "correlate elbow --source supply 0 0 0 0 0 0.002", cli::run_correlate, chosen);
  add_id(correlate, arguments);
  correlate->add_flag(
      "--unknown", arguments.unknown,
      "the edge's own error may be correlated with any other; default: independent");
  correlate
      ->add_option(
          "--source", arguments.sources,
          "error shared with all edges that name the same source: this edge's error for one "
          "standard deviation of the source [m m m rad rad rad]; repeat for each dimension")
      ->type_name("NAME 6 NUMBERS")
      ->type_size(cli::kSourceSize)
      ->allow_extra_args(false);
  cli::explain_angles(*correlate);
  correlate->parse_complete_callback([&arguments] {
    for (std::size_t i = 0; i < arguments.sources.size(); ++i) {
      const std::string& said = arguments.sources[i];
      if (i % cli::kSourceSize == 0 || cli::is_number(said)) continue;
      throw CLI::ValidationError("--source", quote(said) + " is not a number");
    }
  });
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
  add_stamp(plot, "--at", arguments.stamp,
            "the instant: seconds since the epoch or, negative, before now");
  cli::add_recording(plot, arguments, local, cli::run_plot);
  auto* graph = add_command(app, "graph", "draw all frames with their owners, ages, deviations",
                            "graph --out frames.svg", cli::run_graph, chosen);
  add_out(graph, arguments, {".svg", ".png", ".dot"});
  cli::add_recording(graph, arguments, local, cli::run_graph);
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

void add_changing_commands(CLI::App& app, Arguments& arguments, Command& chosen) {
  auto* add = add_command(app, "add", "add a frame", "add tool --parent camera --xyz 0.1 0 -0.2",
                          cli::run_add, chosen);
  add_id(add, arguments);
  add->add_option("--parent", arguments.parent, "its parent")->required();
  add->add_option("--partition", arguments.partition, "its owner, if not its parent's");
  add_pose_options(*add, arguments);
  auto* update = add_command(app, "update", "set parts of an edge; other parts stay unchanged",
                             "update tool --rpy 0 0 1.57", cli::run_update, chosen);
  add_id(update, arguments);
  add_pose_options(*update, arguments);
  add_stamp(update, "--stamp", arguments.stamp,
            "make it a sample of this instant: seconds since the epoch or, negative, before now");
  add_id(add_command(app, "remove", "remove a frame and all below it", "remove tool",
                     cli::run_remove, chosen),
         arguments);
  add_command(app, "forget", "delete all data of a partition that will not return", "forget arm",
              cli::run_forget, chosen)
      ->add_option("PARTITION", arguments.id, "the partition; rejected while it is reachable")
      ->required();
  auto* move = add_command(app, "move", "move a frame to a new parent", "move tool --parent arm_2",
                           cli::run_move, chosen);
  add_id(move, arguments);
  move->add_option("--parent", arguments.parent, "the new parent")->required();
  add_pose_options(*move, arguments);
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
  add_changing_commands(app, arguments, command);
  add_measuring_commands(app, arguments, command);
  add_correlate_command(app, arguments, command);
  add_picture_commands(app, arguments, command, local);
  cli::add_value_commands(app, arguments, command, local);
  add_description_command(app, arguments, command);
  cli::add_recording_commands(app, arguments, command, local);
  cli::add_web_command(app, argc, argv, local);
  cli::add_keys_commands(app, arguments.keys, local);
  cli::add_command(app, "doctor", "find out why nobody is met, and what to do", "doctor",
                   [&local] { local = cli::run_doctor; });
  cli::require_numbers(app);
  cli::add_manual(app);
  if (argc > 1 && argv[1] == std::string_view("__complete")) {
    log_fastdds_to_standard_error();
    (void)cli::run_complete(app, {argv + 2, argv + argc});
    (void)std::fflush(stdout);
    _exit(cli::kDone);
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
  // Blocks the signals before any thread starts, so that commands that run until interrupted can
  // wait for them.
  sigset_t stop_signals;
  sigemptyset(&stop_signals);
  sigaddset(&stop_signals, SIGINT);
  sigaddset(&stop_signals, SIGTERM);
  for (const char* name :
       {"watch", "echo", "monitor", "events", "record", "replay", "publish", "joint"}) {
    if (app.got_subcommand(name) || arguments.watch)
      pthread_sigmask(SIG_BLOCK, &stop_signals, nullptr);
  }
  log_fastdds_to_standard_error();
  const int status = run(arguments, command, local);
  const bool written = std::fflush(stdout) == 0 && std::ferror(stdout) == 0;
  if (!written) std::perror("tfdude: standard output");
  // Fast DDS's static destructors would sleep 100 ms.
  _exit(status == cli::kDone && !written ? cli::kRefused : status);
}
