#include "support/test_domain.hpp"

#include <algorithm>
#include <cstdlib>
#include <iostream>
#include <stdexcept>

namespace tfdude::testing {

namespace {

constexpr std::size_t kOwnHost = 0;
constexpr std::size_t kFirstDaemonHost = 1;
constexpr std::size_t kDaemonHosts = 3;
constexpr std::size_t kCommandHost = 4;

// The time-out while packets are lost, which delays discovery.
constexpr Milliseconds kLossyTimeout{20000};

std::string environment(const char* name) {
  const char* value = std::getenv(name);
  return value != nullptr ? value : "";
}

}  // namespace

TestDomain::TestDomain() {
  const std::string loss = environment("TFDUDE_TEST_LOSS");
  if (loss.empty()) return;
  if (skip_without_hosts()) throw std::runtime_error("there can be no hosts here");
  hosts_.emplace(kCommandHost + 1);
  hosts_->lose(std::stoi(loss));
  hosts_->enter(kOwnHost);
  if (environment("TFDUDE_TEST_DISCOVERY") != "server") return;
  server_.emplace(start_discovery_server(*hosts_, kCommandHost));
  server_address_ = discovery_address(kCommandHost);
}

TestDomain::~TestDomain() {
  if (!hosts_) return;
  std::cout << "lost packets: " << hosts_->lost() << std::endl;
}

Options TestDomain::options(Milliseconds timeout) const {
  Options options;
  options.domain = number();
  options.timeout = timeout;
  options.profile = hosts_ ? "" : TFDUDE_LOOPBACK_PROFILE;
  if (hosts_) options.discovery = kLossyTimeout;
  options.discovery_server = server_address_;
  return options;
}

std::vector<std::string> TestDomain::command(const char* program,
                                             const std::vector<std::string>& arguments) const {
  const auto given = [&](const char* option) {
    return std::count(arguments.begin(), arguments.end(), option) > 0;
  };
  std::vector<std::string> command{program};
  if (!given("--domain")) command.insert(command.end(), {"--domain", std::to_string(number())});
  if (!given("--profile") && !hosts_) {
    command.insert(command.end(), {"--profile", TFDUDE_LOOPBACK_PROFILE});
  }
  if (!server_address_.empty()) {
    command.insert(command.end(), {"--discovery-server", server_address_});
  }
  command.insert(command.end(), arguments.begin(), arguments.end());
  return command;
}

Process TestDomain::start_daemon(const std::vector<std::string>& arguments,
                                 const std::vector<std::string>& wrapper) const {
  const bool keeps = std::count(arguments.begin(), arguments.end(), "--state") > 0;
  auto daemon = command(TFDUDE_DAEMON, arguments);
  if (!keeps) daemon.emplace_back("--no-state");
  daemon.insert(daemon.begin(), wrapper.begin(), wrapper.end());
  return start(kFirstDaemonHost + daemons_++ % kDaemonHosts, daemon);
}

Process TestDomain::serve(const std::string& config) const {
  Process daemon = start_daemon({"--config", config});
  await_ready(daemon);
  return daemon;
}

Process TestDomain::start_cli(const std::vector<std::string>& arguments) const {
  auto patient = command(TFDUDE_CLI, arguments);
  if (hosts_) {
    patient.insert(patient.begin() + 1, {"--timeout", std::to_string(kLossyTimeout.count())});
  }
  return start(kCommandHost, patient);
}

Process TestDomain::start(std::size_t host, const std::vector<std::string>& command) const {
  return hosts_ ? hosts_->start(host, command) : Process(command);
}

CliResult TestDomain::cli(const std::vector<std::string>& arguments) const {
  Process process = start_cli(arguments);
  return finish(process);
}

std::string await_ready(Process& daemon) {
  if (auto line = daemon.wait_for_line("ready ", in_time())) return *line;
  throw std::runtime_error("the daemon did not get ready: " + daemon.err());
}

CliResult finish(Process& process) {
  const auto status = process.wait(in_time());
  if (!status) throw std::runtime_error("a process does not end; it wrote: " + process.err());
  return {*status, process.out(), process.err()};
}

}  // namespace tfdude::testing
