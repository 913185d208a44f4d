// The daemon of one subsystem: loads its frames, owns them, and serves them until a signal stops
// it.

#include <atomic>
#include <csignal>
#include <cstdio>
#include <string>
#include <unistd.h>

#include <spdlog/async.h>
#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>

#include "tfdude/base/id.hpp"
#include "tfdude/client/client.hpp"
#include "tfdude/client/config_preview.hpp"
#include "tfdude/client/node.hpp"
#include "tfdude/description/config.hpp"
#include "tfdude/transport/fastdds.hpp"

#include "arguments.hpp"

namespace {

using tfdude::daemon::Arguments;
using tfdude::daemon::kWrongUsage;

constexpr int kRefused = 1;

tfdude::Result<tfdude::Config> configure(const Arguments& arguments) {
  tfdude::Config config;
  if (!arguments.config.empty()) {
    auto loaded = tfdude::load_config(arguments.config);
    if (!loaded) return loaded;
    config = *std::move(loaded);
  }
  for (tfdude::UrdfPart part : arguments.urdfs) {
    part.fixed = config.covariance;
    if (auto ok = tfdude::add_urdf(config, part); !ok) return tl::unexpected(ok.error());
  }
  if (config.partition.empty()) config.partition = arguments.partition;
  if (!arguments.partition.empty() && config.partition != arguments.partition) {
    return tfdude::fail(tfdude::Errc::kConfig, arguments.config + ": partition '" +
                                                   config.partition + "' is not the '" +
                                                   arguments.partition + "' of --partition");
  }
  if (arguments.clock && config.clock && *arguments.clock != *config.clock) {
    return tfdude::fail(tfdude::Errc::kConfig, arguments.config + ": clock '" +
                                                   to_string(*config.clock) + "' is not the '" +
                                                   to_string(*arguments.clock) + "' of --clock");
  }
  if (arguments.clock) config.clock = arguments.clock;
  if (config.partition.empty()) {
    return tfdude::fail(tfdude::Errc::kConfig,
                        "no partition: give --partition, or name it in --config");
  }
  return config;
}

// Waits for a signal to stop, or until another process has taken the partition.
// @return the exit status
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

// Prints what the configuration would change in the stored state. @return the exit status
int check(const Arguments& arguments, const tfdude::Config& config) {
  const auto preview = tfdude::preview_config(config.partition, config.frames, arguments.options);
  if (!preview) {
    spdlog::error("partition {}: {}", tfdude::quote(config.partition), preview.error().message);
    return kWrongUsage;
  }
  const std::string kept = preview->file.empty() ? "(none)" : preview->file;
  std::printf("state %s: frames=%zu\n", kept.c_str(), preview->frames);
  for (const tfdude::ConfiguredChange& change : preview->changes) {
    std::printf("%s\n", describe(change).c_str());
  }
  if (preview->changes.empty()) std::puts("nothing changes");
  return std::fflush(stdout) == 0 ? 0 : kRefused;
}

int serve(const Arguments& arguments, const sigset_t& stop_signals) {
  const auto config = configure(arguments);
  if (!config) {
    spdlog::error("{}", config.error().message);
    return kWrongUsage;
  }
  if (arguments.check) return check(arguments, *config);
  tfdude::Options options = arguments.options;
  options.history = config->history;
  options.clock = config->clock.value_or(tfdude::ClockKind::kSystem);
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

// NOLINTNEXTLINE(bugprone-exception-escape): only a lack of memory throws, and should end it
int main(int argc, char** argv) {
  Arguments arguments;
  if (const auto status = read_arguments(argc, argv, arguments)) return *status;
  // Blocks the signals before any thread starts: all threads inherit this, so sigwait() gets them.
  sigset_t stop_signals;
  sigemptyset(&stop_signals);
  sigaddset(&stop_signals, SIGINT);
  sigaddset(&stop_signals, SIGTERM);
  pthread_sigmask(SIG_BLOCK, &stop_signals, nullptr);
  // Logs go to standard error: standard output has only the line "ready", or the result of --check.
  // The library uses the logger of this name. If nobody reads the log, lines are lost rather than
  // delaying the daemon.
  spdlog::set_default_logger(
      spdlog::create_async_nb<spdlog::sinks::stderr_color_sink_mt>("tfdude"));
  tfdude::log_fastdds_to_standard_error();
  const int status = serve(arguments, stop_signals);
  spdlog::shutdown();
  return status;
}
