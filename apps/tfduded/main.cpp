// The daemon of one subsystem: loads its frames, owns them, and serves them until a signal stops
// it.

#include <algorithm>
#include <csignal>
#include <cstdio>
#include <malloc.h>
#include <string>
#include <utility>
#include <vector>

#include <spdlog/spdlog.h>

#include "tfdude/base/id.hpp"
#include "tfdude/client/client.hpp"
#include "tfdude/client/node.hpp"
#include "tfdude/client/state_repair.hpp"
#include "tfdude/description/config.hpp"

#include "../process.hpp"
#include "arguments.hpp"
#include "check.hpp"

namespace {

using tfdude::cli::kRejected;
using tfdude::cli::kWrongUsage;
using tfdude::daemon::Arguments;

tfdude::Result<tfdude::Config> configure(const Arguments& arguments) {
  tfdude::Config config;
  if (!arguments.config.empty()) {
    auto loaded = tfdude::load_config(arguments.config);
    if (!loaded) return loaded;
    config = *std::move(loaded);
  }
  for (tfdude::UrdfPart part : arguments.urdfs) {
    part.fixed = arguments.covariance.value_or(config.covariance);
    part.X_root.covariance = part.fixed;
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

// Each as its daemon would see it, and whether all fit together.
int check_all(Arguments arguments) {
  std::vector<std::string> files = std::exchange(arguments.further, {});
  files.insert(files.begin(), arguments.config);
  std::vector<tfdude::Config> configs;
  int status = 0;
  for (const std::string& file : files) {
    arguments.config = file;
    auto config = configure(arguments);
    if (!config) {
      spdlog::error("{}", config.error().message);
      return kWrongUsage;
    }
    status = std::max(status, tfdude::daemon::check(arguments, *config));
    configs.push_back(*std::move(config));
  }
  for (const std::string& wrong : tfdude::daemon::contradictions(configs)) {
    spdlog::error("{}", wrong);
    status = kWrongUsage;
  }
  return status;
}

int serve(const Arguments& arguments, const sigset_t& stop_signals) {
  if (!arguments.further.empty()) return check_all(arguments);
  const auto config = [&] {
    const tfdude::cli::EndAtSignals may_end;
    return configure(arguments);
  }();
  if (!config) {
    spdlog::error("{}", config.error().message);
    return kWrongUsage;
  }
  if (arguments.check) return tfdude::daemon::check(arguments, *config);
  if (arguments.drop_damaged) {
    const auto dropped = tfdude::drop_damaged_state(config->partition, arguments.options);
    if (!dropped) {
      spdlog::error("{}", dropped.error().message);
      return kWrongUsage;
    }
    for (const std::string& row : *dropped) spdlog::warn("left out of the stored state: {}", row);
  }
  tfdude::NodeOptions options = arguments.options;
  options.history = config->history;
  options.clock = config->clock.value_or(tfdude::ClockKind::kSystem);
  // One of several would be taken for the whole.
  if (config->robots.size() == 1) options.description = config->robots.front();
  auto node = tfdude::Node::open(config->partition, config->frames, options);
  if (!node) {
    spdlog::error("partition {}: {}", tfdude::quote(config->partition), node.error().message);
    const auto code = node.error().code;
    if (code == tfdude::Errc::kAlreadyExists) {
      for (const std::string& line : tfdude::daemon::links_to_write(arguments, *config)) {
        spdlog::error("partition {}: {}", tfdude::quote(config->partition), line);
      }
    }
    // Another start would not help. A configuration may be invalid only beside the stored state.
    const bool is_wrong = code == tfdude::Errc::kConfig || code == tfdude::Errc::kState ||
                          code == tfdude::Errc::kInvalidInput || code == tfdude::Errc::kCycle;
    return is_wrong ? kWrongUsage : kRejected;
  }
  if (const auto line = tfdude::daemon::unspecified_edges(*config); !line.empty()) {
    spdlog::info("partition {}: {}", tfdude::quote(config->partition), line);
  }
  std::printf("ready partition=%s frames=%zu\n", config->partition.c_str(), node->own_frames());
  std::fflush(stdout);
  spdlog::info("serving partition {} in domain {}", tfdude::quote(config->partition),
               arguments.options.domain);
  return tfdude::cli::wait_until_stopped(*node, stop_signals);
}

}  // namespace

int main(int argc, char** argv) {
  // Larger blocks go back to the system when they are freed, whatever lies beside them. By default
  // the C library keeps more and more after large ones, and anybody may send large samples.
  constexpr int kLarge = 256 << 10;
  (void)mallopt(M_MMAP_THRESHOLD, kLarge);
  Arguments arguments;
  if (const auto status = read_arguments(argc, argv, arguments)) return *status;
  const sigset_t stop_signals = tfdude::cli::block_stop_signals();
  // Standard output has only the line "ready", or the result of --check.
  tfdude::cli::log_to_standard_error();
  const int status = serve(arguments, stop_signals);
  spdlog::shutdown();
  return status;
}
