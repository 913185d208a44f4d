// Connects the frames, joints and descriptions of ROS 2 with those of tf-dude, until a signal stops
// it.

#include <csignal>
#include <cstdio>
#include <unistd.h>

#include <spdlog/async.h>
#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>

#include "tfdude/base/id.hpp"
#include "tfdude/transport/fastdds.hpp"

#include "arguments.hpp"
#include "bridge.hpp"

namespace {

using tfdude::ros::Bridge;
using tfdude::ros::kWrongUsage;
using tfdude::ros::Settings;

constexpr int kRefused = 1;

// Waits for a signal to stop, or until another process has taken the partition.
// @return the exit status
int run(Bridge& bridge, const sigset_t& stop_signals) {
  std::atomic<bool> given_up{false};
  const auto& partition = bridge.node().partition();
  const auto subscription = bridge.node().on_change([&](const tfdude::Change& change) {
    const bool own = change.partition == partition && change.frame.empty();
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

int serve(const Settings& settings, const sigset_t& stop_signals) {
  auto bridge = Bridge::open(settings);
  if (!bridge) {
    spdlog::error("{}", bridge.error().message);
    const auto code = bridge.error().code;
    return code == tfdude::Errc::kConfig || code == tfdude::Errc::kInvalidInput ? kWrongUsage
                                                                                : kRefused;
  }
  std::printf("ready partition=%s ros_domain=%u\n", settings.partition.c_str(),
              settings.ros_domain);
  std::fflush(stdout);
  spdlog::info("bridge of ROS domain {} and domain {}, partition {}", settings.ros_domain,
               settings.options.domain, tfdude::quote(settings.partition));
  return run(**bridge, stop_signals);
}

}  // namespace

// NOLINTNEXTLINE(bugprone-exception-escape): only a lack of memory throws, and should end it
int main(int argc, char** argv) {
  Settings settings;
  if (const auto status = tfdude::ros::read_arguments(argc, argv, settings)) return *status;
  // Blocks the signals before any thread starts: all threads inherit this, so sigwait() gets them.
  sigset_t stop_signals;
  sigemptyset(&stop_signals);
  sigaddset(&stop_signals, SIGINT);
  sigaddset(&stop_signals, SIGTERM);
  pthread_sigmask(SIG_BLOCK, &stop_signals, nullptr);
  // Logs go to standard error, under the name that the library uses, too. If nobody reads the log,
  // lines are lost rather than delaying the bridge.
  spdlog::set_default_logger(
      spdlog::create_async_nb<spdlog::sinks::stderr_color_sink_mt>("tfdude"));
  tfdude::log_fastdds_to_standard_error();
  const int status = serve(settings, stop_signals);
  spdlog::shutdown();
  return status;
}
