#include "host_facts.hpp"

#include <algorithm>
#include <array>
#include <filesystem>
#include <fstream>
#include <ifaddrs.h>
#include <iterator>
#include <netdb.h>
#include <poll.h>
#include <sys/socket.h>
#include <system_error>
#include <unistd.h>

#include <arpa/inet.h>
#include <net/if.h>
#include <netinet/in.h>

#include "../program.hpp"

namespace tfdude::cli {
namespace {

// A group that nobody uses, for messages that do not leave the network.
constexpr const char* kTestGroup = "239.255.116.102";
constexpr int kWait = 200;  // [ms]

class Socket : public Descriptor {
 public:
  Socket() : Descriptor(socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0)) {}
  template <class Value>
  [[nodiscard]] bool set(int level, int name, const Value& value) const {
    return setsockopt(get(), level, name, &value, sizeof(value)) == 0;
  }
};

// Sends a message to a group of its own through an interface, and waits for it.
// @return nothing if it could not be sent
std::optional<bool> multicast_returns(const in_addr& interface) {
  const Socket receiver;
  const Socket sender;
  sockaddr_in at{};
  at.sin_family = AF_INET;
  inet_pton(AF_INET, kTestGroup, &at.sin_addr);
  socklen_t size = sizeof(at);
  ip_mreq group{at.sin_addr, interface};
  auto* address = reinterpret_cast<sockaddr*>(&at);  // NOLINT: as the socket interface wants
  if (bind(receiver.get(), address, size) != 0) return std::nullopt;
  if (getsockname(receiver.get(), address, &size) != 0) return std::nullopt;
  if (!receiver.set(IPPROTO_IP, IP_ADD_MEMBERSHIP, group)) return std::nullopt;
  if (!sender.set(IPPROTO_IP, IP_MULTICAST_IF, interface)) return std::nullopt;
  const std::string text = "tfdude doctor " + std::to_string(getpid());
  // A firewall may reject the message at once: then it does not come back, either.
  if (sendto(sender.get(), text.data(), text.size(), 0, address, size) < 0) {
    return errno == EPERM ? std::optional(false) : std::nullopt;
  }
  pollfd waiting{receiver.get(), POLLIN, 0};
  while (poll(&waiting, 1, kWait) > 0) {
    std::array<char, 64> got{};
    const ssize_t length = recv(receiver.get(), got.data(), got.size(), 0);
    if (length > 0 && text == std::string(got.data(), static_cast<std::size_t>(length))) {
      return true;
    }
  }
  return false;
}

std::size_t granted(int option, std::size_t wanted) {
  const Socket socket;
  int value = static_cast<int>(wanted);
  socklen_t size = sizeof(value);
  if (!socket.set(SOL_SOCKET, option, value)) return 0;
  if (getsockopt(socket.get(), SOL_SOCKET, option, &value, &size) != 0) return 0;
  return static_cast<std::size_t>(value) / 2;  // the kernel doubles it, for its own data
}

}  // namespace

std::vector<NetworkInterface> read_interfaces(bool loopback) {
  std::vector<NetworkInterface> interfaces;
  ifaddrs* all = nullptr;
  if (getifaddrs(&all) != 0) return interfaces;
  for (const ifaddrs* one = all; one != nullptr; one = one->ifa_next) {
    const bool ipv4 = one->ifa_addr != nullptr && one->ifa_addr->sa_family == AF_INET;
    // Each is listed once without an address (AF_PACKET), so also those that have none.
    const bool bare = one->ifa_addr != nullptr && one->ifa_addr->sa_family == AF_PACKET;
    if (!ipv4 && !bare) continue;
    NetworkInterface interface;
    interface.name = one->ifa_name;
    interface.up = (one->ifa_flags & IFF_UP) != 0 && (one->ifa_flags & IFF_RUNNING) != 0;
    interface.multicast = (one->ifa_flags & IFF_MULTICAST) != 0;
    interface.loopback = (one->ifa_flags & IFF_LOOPBACK) != 0;
    if (ipv4) {
      const auto& address =
          reinterpret_cast<const sockaddr_in*>(one->ifa_addr)->sin_addr;  // NOLINT
      std::array<char, INET_ADDRSTRLEN> text{};
      interface.address = inet_ntop(AF_INET, &address, text.data(), text.size());
      const bool used = interface.up && interface.loopback == loopback &&
                        (interface.multicast || interface.loopback);
      if (used) interface.returns = multicast_returns(address);
    }
    interfaces.push_back(std::move(interface));
  }
  freeifaddrs(all);
  const auto listed_again = [&interfaces](const NetworkInterface& bare) {
    return bare.address.empty() &&
           std::any_of(interfaces.begin(), interfaces.end(), [&](const NetworkInterface& one) {
             return one.name == bare.name && !one.address.empty();
           });
  };
  interfaces.erase(std::remove_if(interfaces.begin(), interfaces.end(), listed_again),
                   interfaces.end());
  return interfaces;
}

std::vector<UdpSocket> read_sockets() {
  std::ifstream file("/proc/net/udp");
  return sockets_in({std::istreambuf_iterator<char>(file), {}});
}

std::vector<std::uint64_t> own_sockets() {
  std::vector<std::uint64_t> inodes;
  std::error_code ignored;
  for (const auto& entry : std::filesystem::directory_iterator("/proc/self/fd", ignored)) {
    const std::string target = std::filesystem::read_symlink(entry.path(), ignored).string();
    constexpr std::string_view kBegin = "socket:[";
    if (target.rfind(kBegin, 0) != 0) continue;
    inodes.push_back(std::strtoull(target.c_str() + kBegin.size(), nullptr, 10));
  }
  return inodes;
}

std::string fault_of_server(const std::string& server) {
  const auto colon = server.rfind(':');
  const std::string host = server.substr(0, colon);
  addrinfo wanted{};
  wanted.ai_family = AF_INET;
  wanted.ai_socktype = SOCK_DGRAM;
  addrinfo* found = nullptr;
  const int failed = getaddrinfo(host.c_str(), server.substr(colon + 1).c_str(), &wanted, &found);
  if (failed != 0) return std::string("its host is not known: ") + gai_strerror(failed);
  const Socket socket;
  const bool connected = connect(socket.get(), found->ai_addr, found->ai_addrlen) == 0;
  freeaddrinfo(found);
  // DDS ignores the message. If nobody listens, the host says so.
  char byte = 0;
  if (!connected || send(socket.get(), &byte, 1, 0) < 0) {
    return std::generic_category().message(errno);
  }
  pollfd waiting{socket.get(), POLLIN, 0};
  if (poll(&waiting, 1, kWait) <= 0) return "";
  if (recv(socket.get(), &byte, 1, 0) >= 0 || errno != ECONNREFUSED) return "";
  return "nobody listens there";
}

std::size_t granted_receive_buffer(std::size_t wanted) { return granted(SO_RCVBUF, wanted); }
std::size_t granted_send_buffer(std::size_t wanted) { return granted(SO_SNDBUF, wanted); }

std::optional<std::string> read_firewall() {
  if (geteuid() != 0) return std::nullopt;
  for (const char* nft : {"/usr/sbin/nft", "/sbin/nft"}) {
    if (access(nft, X_OK) != 0) continue;
    if (auto rules = run_program({{nft, "list", "ruleset"}, "nftables"}, "")) return *rules;
  }
  return std::nullopt;
}

}  // namespace tfdude::cli
