// The daemon of one subsystem: loads its frames, owns them, serves them until it is told to stop.

#include <atomic>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <spdlog/async.h>
#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>

#include "tfdude/base/id.hpp"
#include "tfdude/client/client.hpp"
#include "tfdude/client/config.hpp"
#include "tfdude/transport/fastdds.hpp"

namespace {

constexpr int kRefused = 1;
constexpr int kWrongUsage = 2;

struct Arguments {
  std::string partition;
  std::string config;
  bool no_state = false;
  int save_every_ms = 1000;
  tfdude::Options options;
};

// Of the XDG base directory specification. @return empty where there is no home
std::string default_state() {
  const char* state = std::getenv("XDG_STATE_HOME");
  if (state != nullptr && *state == '/') return std::string(state) + "/tfdude";
  const char* home = std::getenv("HOME");
  return home != nullptr && *home != 0 ? std::string(home) + "/.local/state/tfdude" : std::string();
}

tfdude::Result<tfdude::Config> configure(const Arguments& arguments) {
  tfdude::Config config;
  if (!arguments.config.empty()) {
    auto loaded = tfdude::load_config(arguments.config);
    if (!loaded) return loaded;
    config = *std::move(loaded);
  }
  if (config.partition.empty()) config.partition = arguments.partition;
  if (!arguments.partition.empty() && config.partition != arguments.partition) {
    return tfdude::fail(tfdude::Errc::kConfig, arguments.config + ": partition '" +
                                                   config.partition + "' is not the '" +
                                                   arguments.partition + "' of --partition");
  }
  if (config.partition.empty()) {
    return tfdude::fail(tfdude::Errc::kConfig,
                        "no partition: give --partition, or name it in --config");
  }
  return config;
}

// Waits for a signal to stop, or until another process has the partition. @return the exit status
int run(tfdude::Node& node, const sigset_t& stop_signals) {
  std::atomic<bool> given_up{false};
  const auto subscription = node.on_change([&](const tfdude::Change& change) {
    const bool own = change.partition == node.partition() && change.frame.empty();
    if (change.kind != tfdude::ChangeKind::kConflict || !own) return;
    given_up = true;
    kill(getpid(), SIGTERM);
  });
  int signal = 0;
  sigwait(&stop_signals, &signal);
  if (given_up) return kRefused;
  spdlog::info("stopping on signal {}", signal);
  return 0;
}

int serve(const Arguments& arguments, const sigset_t& stop_signals) {
  const auto config = configure(arguments);
  if (!config) {
    spdlog::error("{}", config.error().message);
    return kWrongUsage;
  }
  tfdude::Options options = arguments.options;
  options.history = config->history;
  auto node = tfdude::Node::open(config->partition, config->frames, options);
  if (!node) {
    spdlog::error("partition {}: {}", tfdude::quote(config->partition), node.error().message);
    const auto code = node.error().code;
    return code == tfdude::Errc::kConfig || code == tfdude::Errc::kState ? kWrongUsage : kRefused;
  }
  std::printf("ready partition=%s frames=%zu\n", config->partition.c_str(), node->own_frames());
  std::fflush(stdout);
  spdlog::info("serving partition {} in domain {}", tfdude::quote(config->partition),
               arguments.options.domain);
  return run(*node, stop_signals);
}

}  // namespace

// NOLINTNEXTLINE(bugprone-exception-escape): nothing but a lack of memory, which should end it
int main(int argc, char** argv) {
  Arguments arguments;
  CLI::App app{"tfduded: owns a partition of the coordinate frames and serves it over DDS"};
  app.footer("Example: tfduded --partition arms --config examples/thesis/arms.yaml --domain 7");
  app.add_option("--partition", arguments.partition, "the partition's name");
  app.add_option("--config", arguments.config, "YAML file of frames");
  app.add_option("--domain", arguments.options.domain, "DDS domain, 0 to 232")
      ->check(CLI::Range(0, 232));
  app.add_option("--profile", arguments.options.profile, "XML file of DDS profiles");
  auto* state = app.add_option("--state", arguments.options.state,
                               "directory in which to keep the frames "
                               "(default: $XDG_STATE_HOME/tfdude or ~/.local/state/tfdude)");
  app.add_flag("--no-state", arguments.no_state, "keep nothing: begin with --config each time")
      ->excludes(state);
  app.add_option("--save-every", arguments.save_every_ms,
                 "how often at most streamed values are stored [ms]")
      ->check(CLI::Range(1, 86'400'000));
  app.add_option("--discovery-server", arguments.options.discovery_server,
                 "HOST:PORT of a Fast DDS discovery server")
      ->check([](const std::string& text) {
        const auto good = tfdude::check_discovery_server(text);
        return good ? std::string() : good.error().message;
      });
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : kWrongUsage;
  }
  arguments.options.save_every = tfdude::Milliseconds(arguments.save_every_ms);
  if (arguments.options.state.empty() && !arguments.no_state) {
    arguments.options.state = default_state();
    if (arguments.options.state.empty()) {
      std::fputs("tfduded: no home for the state: give --state DIR or --no-state\n", stderr);
      return kWrongUsage;
    }
  }
  // Before any thread starts, so that all inherit it and sigwait() gets the signals.
  sigset_t stop_signals;
  sigemptyset(&stop_signals);
  sigaddset(&stop_signals, SIGINT);
  sigaddset(&stop_signals, SIGTERM);
  pthread_sigmask(SIG_BLOCK, &stop_signals, nullptr);
  // Standard output is for the line "ready" alone. The library takes the logger of this name for its own. A reader
  // of the log that does not read must not hold up who serves: rather lines are lost.
  spdlog::set_default_logger(
      spdlog::create_async_nb<spdlog::sinks::stderr_color_sink_mt>("tfdude"));
  const int status = serve(arguments, stop_signals);
  spdlog::shutdown();
  return status;
}
