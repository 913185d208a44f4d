#include "support/test_domain.hpp"

#include <algorithm>
#include <stdexcept>

namespace tfdude::testing {

Options TestDomain::options(Milliseconds timeout) const {
  Options options;
  options.domain = number();
  options.profile = TFDUDE_LOOPBACK_PROFILE;
  options.timeout = timeout;
  return options;
}

std::vector<std::string> TestDomain::command(const char* program,
                                             const std::vector<std::string>& arguments) const {
  const auto given = [&](const char* option) {
    return std::count(arguments.begin(), arguments.end(), option) > 0;
  };
  std::vector<std::string> command{program};
  if (!given("--domain")) command.insert(command.end(), {"--domain", std::to_string(number())});
  if (!given("--profile")) command.insert(command.end(), {"--profile", TFDUDE_LOOPBACK_PROFILE});
  command.insert(command.end(), arguments.begin(), arguments.end());
  return command;
}

Process TestDomain::start_daemon(const std::vector<std::string>& arguments) const {
  const bool keeps = std::count(arguments.begin(), arguments.end(), "--state") > 0;
  auto daemon = command(TFDUDE_DAEMON, arguments);
  if (!keeps) daemon.emplace_back("--no-state");
  return Process(daemon);
}

Process TestDomain::serve(const std::string& config) const {
  Process daemon = start_daemon({"--config", config});
  await_ready(daemon);
  return daemon;
}

Process TestDomain::start_cli(const std::vector<std::string>& arguments) const {
  return Process(command(TFDUDE_CLI, arguments));
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
