#pragma once

#include <array>
#include <csignal>
#include <fstream>
#include <iterator>
#include <optional>
#include <string>
#include <vector>

#include "tfdude/client/client.hpp"
#include "tfdude/description/config.hpp"

#include "support/agreement.hpp"
#include "support/catch.hpp"
#include "support/hosts.hpp"
#include "support/test_domain.hpp"
#include "support/thesis.hpp"

namespace tfdude::testing {

inline const Transform kX{exp((Twist() << 0.1, -0.2, 0.3, 0.4, 0.5, -0.6).finished()),
                          *Covariance::from_stddev({1e-3, 2e-3, 3e-3, 4e-3, 5e-3, 6e-3})};
inline const Transform kY{exp((Twist() << -0.4, 0.1, 0.2, -0.7, 0.1, 0.9).finished()),
                          *Covariance::from_stddev({6e-3, 1e-3, 2e-3, 1e-3, 3e-3, 2e-3})};

/// The thesis's robot, with each partition on its own host: robot, arms, and a third with a tool in
/// the left hand. The test's process has its own host, and so has the discovery server, if any.
class RobotHosts {
 public:
  static constexpr std::size_t kOwn = 0;
  static constexpr std::size_t kRobot = 1;
  static constexpr std::size_t kArms = 2;
  static constexpr std::size_t kTools = 3;
  static constexpr std::size_t kServer = 4;

  explicit RobotHosts(bool by_server) : by_server_(by_server) {
    hosts.enter(kOwn);
    for (const std::string& file : {kRobotFile, kArmsFile, tools_file_}) {
      const auto config = load_config(file);
      for (const FrameSpec& frame : config->frames) {
        oracle.add(frame.id, frame.parent, frame.X_PC);
      }
    }
  }

  void start_server() { server.emplace(start_discovery_server(hosts, kServer)); }

  /// So that it may end and be started again: with what its predecessor knew, where it can read
  /// that.
  void start_server_again() {
    const std::string kept = discovery_server_reads_backup() ? directory_.path() : std::string();
    server.emplace(start_discovery_server(hosts, kServer, kept));
  }

  /// Kills the server if it can read its backup afterwards; else it ends in order.
  void end_server() {
    if (discovery_server_reads_backup()) return server->kill();
    server->signal(SIGINT);
    REQUIRE(server->wait(in_time()));
  }

  /// Starts the daemons, and waits until they serve.
  void start_daemons() {
    robot.emplace(start_daemon(kRobot, kRobotFile));
    arms.emplace(start_daemon(kArms, kArmsFile));
    tools.emplace(start_daemon(kTools, tools_file_));
    for (Process* daemon : {&*robot, &*arms, &*tools}) (void)await_ready(*daemon);
  }

  [[nodiscard]] Process start_daemon(std::size_t host, const std::string& config) const {
    return start(host, TFDUDE_DAEMON, {"--no-state", "--config", config});
  }

  /// A run of the command line on a host.
  [[nodiscard]] CliResult cli(std::size_t host, const std::vector<std::string>& arguments) const {
    Process process = start(host, TFDUDE_CLI, arguments);
    return finish(process);
  }

  [[nodiscard]] Options options() const {
    Options options;
    options.timeout = Milliseconds(20000);
    options.discovery = Milliseconds(20000);
    if (by_server_) options.discovery_server = discovery_address(kServer);
    return options;
  }

  [[nodiscard]] Client open_client(std::size_t host) const {
    return hosts.on(host, [this] { return Client::open(options()).value(); });
  }

  Hosts hosts{kServer + 1};
  std::optional<Process> server;
  std::optional<Process> robot;
  std::optional<Process> arms;
  std::optional<Process> tools;
  Oracle oracle;

 private:
  [[nodiscard]] Process start(std::size_t host, const char* program,
                              const std::vector<std::string>& arguments) const {
    std::vector<std::string> command{program};
    if (by_server_)
      command.insert(command.end(), {"--discovery-server", discovery_address(kServer)});
    command.insert(command.end(), arguments.begin(), arguments.end());
    return hosts.start(host, command);
  }

  bool by_server_;
  TemporaryDirectory directory_;
  std::string tools_file_ = directory_.write("tools.yaml",
                                             "partition: tools\n"
                                             "frames:\n"
                                             "  - id: tool\n"
                                             "    parent: hand_left\n"
                                             "    xyz: [0, 0.1, 0.2]\n"
                                             "    rpy: [0.3, 0, 0.1]\n"
                                             "    stddev: [0.001, 0, 0, 0, 0.002, 0]\n");
};

}  // namespace tfdude::testing
