#include "support/test_domain.hpp"

#include <algorithm>
#include <atomic>
#include <stdexcept>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

namespace tfdude::testing {
namespace {

constexpr std::uint32_t kFirst = 20;
constexpr std::uint32_t kCount = 200;

// A name in the abstract namespace of the kernel: one process has it at a time, and loses it as it ends.
int claim(std::uint32_t domain) {
  const std::string name = "tfdude-test-domain-" + std::to_string(domain);
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  std::copy(name.begin(), name.end(), address.sun_path + 1);
  const int fd = socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  const auto size = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + 1 + name.size());
  if (bind(fd, reinterpret_cast<const sockaddr*>(&address), size) == 0) return fd;
  close(fd);
  return -1;
}

}  // namespace

TestDomain::TestDomain() {
  static std::atomic<std::uint32_t> tests{0};
  const std::uint32_t wish = static_cast<std::uint32_t>(getpid()) * 7 + tests++;
  for (std::uint32_t i = 0; i < kCount && claim_ < 0; ++i) {
    number_ = kFirst + (wish + i) % kCount;
    claim_ = claim(number_);
  }
  if (claim_ < 0) throw std::runtime_error("all DDS domains for tests are taken");
}

TestDomain::~TestDomain() { close(claim_); }

Options TestDomain::options(Milliseconds timeout) const {
  Options options;
  options.domain = number_;
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
  if (!given("--domain")) command.insert(command.end(), {"--domain", std::to_string(number_)});
  if (!given("--profile")) command.insert(command.end(), {"--profile", TFDUDE_LOOPBACK_PROFILE});
  command.insert(command.end(), arguments.begin(), arguments.end());
  return command;
}

Process TestDomain::start_daemon(const std::vector<std::string>& arguments) const {
  return Process(command(TFDUDE_DAEMON, arguments));
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
