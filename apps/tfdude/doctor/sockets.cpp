#include <cstdlib>
#include <sstream>

#include "facts.hpp"

// The participants of a host, by the UDP ports that DDS gives them.
namespace tfdude::cli {
namespace {

constexpr std::uint32_t kLastDomain = 232;
constexpr std::uint32_t kUnicastDiscovery = 10;  // plus 2 n of the n-th participant
constexpr std::uint32_t kLoopback = 0x7F000001;

struct Port {
  std::uint32_t domain;
  std::uint32_t offset;  // 0: discovery by multicast
};

std::optional<Port> port_of(const UdpSocket& socket) {
  if (socket.port < kFirstPort) return std::nullopt;
  const Port port{(socket.port - kFirstPort) / kPortsOfDomain,
                  (socket.port - kFirstPort) % kPortsOfDomain};
  return port.domain <= kLastDomain ? std::optional(port) : std::nullopt;
}

}  // namespace

std::vector<UdpSocket> sockets_in(const std::string& table) {
  std::vector<UdpSocket> sockets;
  std::istringstream lines(table);
  for (std::string line; std::getline(lines, line);) {
    // "slot: ADDRESS:PORT remote state queues timer retransmits uid timeout inode ..."
    std::istringstream words(line);
    std::string slot, local, word;
    words >> slot >> local;
    const auto colon = local.find(':');
    if (colon != 8 || slot.empty() || slot.back() != ':') continue;
    for (int i = 0; i < 7; ++i) words >> word;
    UdpSocket socket;
    // Four bytes in the network's order, printed as a number of the host.
    const auto raw =
        static_cast<std::uint32_t>(std::strtoul(local.substr(0, 8).c_str(), nullptr, 16));
    socket.address = __builtin_bswap32(raw);
    socket.port = static_cast<std::uint16_t>(std::strtoul(local.c_str() + 9, nullptr, 16));
    words >> socket.inode;
    sockets.push_back(socket);
  }
  return sockets;
}

Listeners listeners_in(const std::vector<UdpSocket>& sockets, std::uint32_t domain) {
  Listeners listeners;
  for (const UdpSocket& socket : sockets) {
    const auto port = port_of(socket);
    if (!port || port->domain != domain) continue;
    if (port->offset < kUnicastDiscovery || port->offset % 2 != 0) continue;
    ++(socket.address == kLoopback ? listeners.loopback : listeners.everywhere);
  }
  return listeners;
}

std::map<std::uint32_t, Listeners> listeners_of(const std::vector<UdpSocket>& sockets) {
  std::map<std::uint32_t, Listeners> domains;
  for (const UdpSocket& socket : sockets) {
    const auto port = port_of(socket);
    if (!port || port->offset != 0 || domains.count(port->domain) != 0) continue;
    const Listeners listeners = listeners_in(sockets, port->domain);
    if (listeners.any()) domains.emplace(port->domain, listeners);
  }
  return domains;
}

}  // namespace tfdude::cli
