#include "support/domain_lease.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <cstddef>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <set>
#include <stdexcept>
#include <string>
#include <sys/socket.h>
#include <sys/un.h>
#include <system_error>
#include <unistd.h>

namespace tfdude::testing {
namespace {

namespace fs = std::filesystem;

// RTPS 2.2, section 9.6.1.1.
constexpr std::uint32_t kFirstPort = 7400;
constexpr std::uint32_t kPortsOfDomain = 250;

// A name in the kernel's abstract namespace of sockets: only one process can have it at a time, and
// the kernel frees it when the process ends.
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

// The sockets of UDP that are bound to ports from the first to the last, as the kernel names them.
std::set<std::string> sockets_at(std::uint32_t first, std::uint32_t last) {
  std::set<std::string> sockets;
  for (const char* table : {"/proc/thread-self/net/udp", "/proc/thread-self/net/udp6"}) {
    std::ifstream lines(table);
    std::string line;
    std::getline(lines, line);  // the heading
    std::string number;
    std::string local;
    std::string other;
    std::string inode;
    while (lines >> number >> local) {
      for (int column = 2; column < 9; ++column) lines >> other;
      lines >> inode;
      std::getline(lines, line);
      const auto port = std::stoul(local.substr(local.find(':') + 1), nullptr, 16);
      if (port >= first && port <= last) sockets.insert("socket:[" + inode + "]");
    }
  }
  return sockets;
}

// The parent of a process; 0: none, or it has ended.
int parent_of(int pid) {
  std::ifstream status("/proc/" + std::to_string(pid) + "/status");
  for (std::string line; std::getline(status, line);) {
    if (line.rfind("PPid:", 0) == 0) return std::stoi(line.substr(5));
  }
  return 0;
}

bool is_own(int pid) {
  for (; pid > 1; pid = parent_of(pid)) {
    if (pid == getpid()) return true;
  }
  return false;
}

std::string name_of(int pid) {
  std::string name;
  std::getline(std::ifstream("/proc/" + std::to_string(pid) + "/comm"), name);
  return "process " + std::to_string(pid) + " (" + name + ")";
}

// Names the processes that have one of the sockets. @param others_only  none of this test
std::string holders(const std::set<std::string>& sockets, bool others_only) {
  std::string names;
  std::error_code error;
  for (const auto& process : fs::directory_iterator("/proc", error)) {
    const std::string pid = process.path().filename();
    if (pid.find_first_not_of("0123456789") != std::string::npos) continue;
    bool holds = false;
    for (const auto& file : fs::directory_iterator(process.path() / "fd", error)) {
      holds = holds || sockets.count(fs::read_symlink(file.path(), error).string()) != 0;
    }
    if (!holds || (others_only && is_own(std::stoi(pid)))) continue;
    names += (names.empty() ? "" : ", ") + name_of(std::stoi(pid));
  }
  return names;
}

}  // namespace

std::uint16_t announcement_port(std::uint32_t domain) {
  return static_cast<std::uint16_t>(kFirstPort + kPortsOfDomain * domain);
}

DomainLease::DomainLease(const Domains& domains) {
  static std::atomic<std::uint32_t> tests{0};
  const std::uint32_t wish = static_cast<std::uint32_t>(getpid()) * 7 + tests++;
  std::string taken;
  for (std::uint32_t i = 0; i < domains.count; ++i) {
    number_ = domains.first + (wish + i) % domains.count;
    claim_ = claim(number_);
    if (claim_ < 0) continue;
    const std::uint32_t port = announcement_port(number_);
    const auto sockets = sockets_at(port, port + kPortsOfDomain - 1);
    if (sockets.empty()) return;
    close(claim_);
    claim_ = -1;
    if (taken.size() > 1000) continue;
    const std::string who = holders(sockets, false);
    taken += "\ndomain " + std::to_string(number_) + " has sockets of " +
             (who.empty() ? "a process that is not visible" : who);
  }
  throw std::runtime_error("all DDS domains for tests are taken" + taken);
}

DomainLease::~DomainLease() {
  const std::uint32_t port = announcement_port(number_);
  const std::string others = holders(sockets_at(port, port), true);
  if (!others.empty()) {
    std::cout << "WARNING: during this test its DDS domain " << number_ << " was also used by "
              << others << std::endl;
  }
  close(claim_);
}

}  // namespace tfdude::testing
