// The daemon of one subsystem: loads its frames, owns them, serves them until it is told to stop.

#include <csignal>
#include <cstdio>
#include <string>

#include <CLI/CLI.hpp>
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
  tfdude::Options options;
};

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

int serve(const Arguments& arguments, const sigset_t& stop_signals) {
  const auto config = configure(arguments);
  if (!config) {
    spdlog::error("{}", config.error().message);
    return kWrongUsage;
  }
  auto node = tfdude::Node::open(config->partition, config->frames, arguments.options);
  if (!node) {
    spdlog::error("partition {}: {}", tfdude::quote(config->partition), node.error().message);
    return node.error().code == tfdude::Errc::kConfig ? kWrongUsage : kRefused;
  }
  std::printf("ready partition=%s frames=%zu\n", config->partition.c_str(), config->frames.size());
  std::fflush(stdout);
  spdlog::info("serving partition {} in domain {}", tfdude::quote(config->partition),
               arguments.options.domain);
  int signal = 0;
  sigwait(&stop_signals, &signal);
  spdlog::info("stopping on signal {}", signal);
  return 0;
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
  // Standard output is for the line "ready" alone.
  // The library takes the logger of this name for its own.
  spdlog::set_default_logger(spdlog::stderr_color_mt("tfdude"));
  // Before any thread starts, so that all inherit it and sigwait() gets the signals.
  sigset_t stop_signals;
  sigemptyset(&stop_signals);
  sigaddset(&stop_signals, SIGINT);
  sigaddset(&stop_signals, SIGTERM);
  pthread_sigmask(SIG_BLOCK, &stop_signals, nullptr);
  return serve(arguments, stop_signals);
}
