// Connects the frames, joints and descriptions of ROS 2 with those of tf-dude, until a signal stops
// it.

#include <csignal>
#include <cstdio>

#include <spdlog/spdlog.h>

#include "tfdude/base/id.hpp"

#include "../process.hpp"
#include "arguments.hpp"
#include "bridge.hpp"

namespace {

using tfdude::cli::kRejected;
using tfdude::cli::kWrongUsage;
using tfdude::ros::Bridge;
using tfdude::ros::Settings;

int serve(const Settings& settings, const sigset_t& stop_signals) {
  auto bridge = Bridge::open(settings);
  if (!bridge) {
    spdlog::error("{}", bridge.error().message);
    const auto code = bridge.error().code;
    return code == tfdude::Errc::kConfig || code == tfdude::Errc::kInvalidInput ? kWrongUsage
                                                                                : kRejected;
  }
  std::printf("ready partition=%s ros_domain=%u\n", settings.partition.c_str(),
              settings.ros_domain);
  std::fflush(stdout);
  spdlog::info("bridge of ROS domain {} and domain {}, partition {}", settings.ros_domain,
               settings.options.domain, tfdude::quote(settings.partition));
  return tfdude::cli::wait_until_stopped((*bridge)->node(), stop_signals);
}

}  // namespace

int main(int argc, char** argv) {
  Settings settings;
  if (const auto status = tfdude::ros::read_arguments(argc, argv, settings)) return *status;
  const sigset_t stop_signals = tfdude::cli::block_stop_signals();
  tfdude::cli::log_to_standard_error();
  const int status = serve(settings, stop_signals);
  spdlog::shutdown();
  return status;
}
