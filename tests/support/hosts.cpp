#include "support/hosts.hpp"

#include <cerrno>
#include <cstring>
#include <fcntl.h>
#include <iostream>
#include <sched.h>
#include <stdexcept>
#include <thread>
#include <unistd.h>
#include <utility>

#include "support/interfaces.hpp"

namespace tfdude::testing {
namespace {

// With its own shared memory, because hosts share only the network.
constexpr const char* kOwnMemory =
    "exec unshare --mount /bin/sh -c 'mount -t tmpfs none /dev/shm && exec \"$@\"' sh \"$@\"";

// Folders of the tools that may be missing in a user's path.
constexpr const char* kPath = "PATH=/usr/sbin:/sbin:$PATH; set -e\n";

std::string port(std::size_t host) { return "port" + std::to_string(host); }

// The network namespace of the calling thread; -1 if it cannot be opened.
int open_own_network() { return open("/proc/thread-self/ns/net", O_RDONLY | O_CLOEXEC); }

std::vector<std::string> shell(const std::string& script) {
  return {"/bin/sh", "-c", kPath + script};
}

// A new, empty namespace; -1 with errno if that is not permitted.
int make_network() {
  int fd = -1;
  int error = 0;
  std::thread([&] {
    if (unshare(CLONE_NEWNET) == 0) fd = open_own_network();
    error = errno;
  }).join();
  errno = error;
  return fd;
}

}  // namespace

Hosts::Network::Network() : fd_(make_network()) {
  if (fd_ < 0) throw std::runtime_error(std::string("no new network: ") + std::strerror(errno));
}

Hosts::Network::~Network() {
  if (fd_ >= 0) close(fd_);
}

Hosts::Network::Network(Network&& other) noexcept : fd_(std::exchange(other.fd_, -1)) {}

// Tries what the tests do.
std::string Hosts::missing() {
  try {
    const Hosts probe(2);
    probe.lose(1);
    (void)probe.lost();
    probe.cut(1);
    probe.heal(1);
    Process program = probe.start(0, {"/bin/true"});
    if (program.wait(in_time()) != 0) throw std::runtime_error(program.err());
  } catch (const std::exception& error) {
    return std::string("no hosts can be made here: ") + error.what();
  }
  return "";
}

std::string Hosts::run(const Network& where, const std::string& script) {
  Process process(shell(script), where.fd());
  if (process.wait(in_time()) != 0) {
    throw std::runtime_error("failed: " + script + "\n" + process.err());
  }
  return process.out();
}

Hosts::Hosts(std::size_t count) : home_(open_own_network()), hosts_(count) {
  // Snooping would need a querier for the members of multicast groups.
  run(switch_, "ip link add switch type bridge mcast_snooping 0 && ip link set switch up");
  for (std::size_t i = 0; i < count; ++i) {
    const std::string network =
        "/proc/" + std::to_string(getpid()) + "/fd/" + std::to_string(hosts_[i].fd());
    run(switch_, "ip link add " + port(i) + " type veth peer name eth0 netns " + network +
                     "\nip link set " + port(i) + " master switch up");
    run(hosts_[i], "ip link set lo up\nip addr add " + address(i) +
                       "/24 dev eth0\nip link set eth0 up\n"
                       "nft -f - <<END\n"
                       "table inet loss {\n"
                       "  counter dropped {}\n"
                       // Runs before fragments are reassembled, because each may be lost.
                       "  chain arriving { type filter hook prerouting priority raw; }\n"
                       "}\nEND\n");
  }
}

Hosts::~Hosts() {
  (void)setns(home_, CLONE_NEWNET);
  close(home_);
}

std::string Hosts::address(std::size_t host) { return "10.77.0." + std::to_string(host + 1); }

Process Hosts::start(std::size_t host, const std::vector<std::string>& argv) const {
  std::vector<std::string> command = shell(kOwnMemory);
  command.emplace_back("sh");
  command.insert(command.end(), argv.begin(), argv.end());
  return Process(command, hosts_.at(host).fd());
}

void Hosts::enter(std::size_t host) const {
  if (setns(hosts_.at(host).fd(), CLONE_NEWNET) != 0) {
    throw std::runtime_error(std::string("a host cannot be entered: ") + std::strerror(errno));
  }
  read_interfaces();
}

void Hosts::lose(int percent) const {
  for (const Network& host : hosts_) {
    run(host,
        "nft flush chain inet loss arriving\n"
        "nft add rule inet loss arriving iifname eth0 numgen random mod 100 '<' " +
            std::to_string(percent) + " counter name dropped drop");
  }
}

std::uint64_t Hosts::lost() const {
  std::uint64_t sum = 0;
  for (const Network& host : hosts_) {
    const std::string counter = run(host, "nft list counter inet loss dropped");
    const std::string before = "packets ";
    sum += std::stoull(counter.substr(counter.find(before) + before.size()));
  }
  return sum;
}

void Hosts::cut(std::size_t host) const { run(switch_, "ip link set " + port(host) + " down"); }

void Hosts::heal(std::size_t host) const { run(switch_, "ip link set " + port(host) + " up"); }

Process start_discovery_server(const Hosts& hosts, std::size_t host, const std::string& backup) {
  // Listens on this address: Fast DDS 3.1 cannot listen on all at once.
  const std::string command =
      "exec fast-discovery-server -i 0 -l " + Hosts::address(host) + " -p 11811";
  Process server = hosts.start(
      host, shell(backup.empty() ? command : "cd '" + backup + "'; " + command + " -b"));
  if (!server.wait_for_line("### Server is running ###", in_time())) {
    throw std::runtime_error("the discovery server does not run: " + server.out() + server.err());
  }
  return server;
}

std::string discovery_address(std::size_t host) { return Hosts::address(host) + ":11811"; }

bool skip_without_hosts() {
  static const std::string missing = Hosts::missing();
  if (!missing.empty()) std::cout << "SKIPPED: " << missing << std::endl;
  return !missing.empty();
}

}  // namespace tfdude::testing
