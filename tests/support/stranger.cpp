#include "support/stranger.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <stdexcept>
#include <sys/socket.h>
#include <sys/time.h>
#include <unistd.h>
#include <utility>

#include <arpa/inet.h>
#include <netinet/in.h>

#include "support/domain_lease.hpp"
#include "support/process.hpp"

namespace tfdude::testing {
namespace {

sockaddr_in address(const char* host, std::uint16_t port) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(port);
  inet_pton(AF_INET, host, &address.sin_addr);
  return address;
}

// Those of discovery and of data of the first participants of a host (RTPS 2.2, 9.6.1.1).
constexpr std::uint16_t kFirstUnicast = 10;
constexpr std::uint16_t kUnicastPorts = 24;

}  // namespace

Stranger::Stranger(std::uint32_t domain)
    : domain_(domain),
      listening_(socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0)),
      sending_(socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0)) {
  const int yes = 1;
  setsockopt(listening_, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
  setsockopt(listening_, SOL_SOCKET, SO_REUSEPORT, &yes, sizeof yes);
  const timeval wait{0, 100'000};
  setsockopt(listening_, SOL_SOCKET, SO_RCVTIMEO, &wait, sizeof wait);
  const sockaddr_in group = address("239.255.0.1", announcement_port(domain));
  ip_mreq membership{};
  membership.imr_multiaddr = group.sin_addr;
  membership.imr_interface = address("127.0.0.1", 0).sin_addr;
  if (bind(listening_, reinterpret_cast<const sockaddr*>(&group), sizeof group) != 0 ||
      setsockopt(listening_, IPPROTO_IP, IP_ADD_MEMBERSHIP, &membership, sizeof membership) != 0) {
    throw std::runtime_error("cannot listen to announcements");
  }
}

Stranger::~Stranger() {
  close(listening_);
  close(sending_);
}

std::vector<Prefix> Stranger::await_participants(std::size_t count) {
  std::set<Prefix> found;
  std::array<std::uint8_t, 65536> bytes{};
  for (const Deadline deadline = in_time(); found.size() < count;) {
    if (Clock::now() > deadline) throw std::runtime_error("too few participants announced");
    const ssize_t size = recv(listening_, bytes.data(), bytes.size(), 0);
    if (size < 20) continue;
    Prefix prefix;
    std::copy_n(bytes.begin() + 8, prefix.size(), prefix.begin());
    found.insert(prefix);
  }
  return {found.begin(), found.end()};
}

void Stranger::send(const Datagram& datagram) {
  for (std::uint16_t i = 0; i < kUnicastPorts; ++i) {
    const std::uint16_t port =
        static_cast<std::uint16_t>(announcement_port(domain_) + kFirstUnicast + i);
    const sockaddr_in to = address("127.0.0.1", port);
    (void)sendto(sending_, datagram.bytes().data(), datagram.bytes().size(), 0,
                 reinterpret_cast<const sockaddr*>(&to), sizeof to);
  }
}

void send_huge_ranges(Stranger& stranger, const std::vector<Prefix>& participants) {
  // The built-in writers of discovery and of the exchange of keys, and who reads them.
  constexpr std::array<std::pair<Entity, Entity>, 6> kEndpoints{
      {{{0, 0, 3, 0xC2}, {0, 0, 3, 0xC7}},
       {{0, 0, 4, 0xC2}, {0, 0, 4, 0xC7}},
       {{0xFF, 0, 3, 0xC2}, {0xFF, 0, 3, 0xC7}},
       {{0xFF, 0, 4, 0xC2}, {0xFF, 0, 4, 0xC7}},
       {{0xFF, 2, 2, 0xC3}, {0xFF, 2, 2, 0xC4}},
       {{0, 2, 0, 0xC2}, {0, 2, 0, 0xC7}}}};
  constexpr std::uint64_t kHuge = std::uint64_t{0x7FFFFF00} << 32U;
  for (const Prefix& from : participants) {
    for (const Prefix& to : participants) {
      if (from == to) continue;
      for (const auto& [writer, reader] : kEndpoints) {
        stranger.send(Datagram(from).to(to).gap(reader, writer, 1, kHuge));
        stranger.send(Datagram(from).to(to).heartbeat(reader, writer, kHuge, kHuge, 0x7FFFFFFF));
        stranger.send(Datagram(from).to(to).acknack(reader, writer, kHuge));
        stranger.send(Datagram(from).to(to).acknack(reader, writer, 0));
        // Each range is short, and ends far ahead.
        stranger.send(Datagram(from).to(to).gap(reader, writer, kHuge, kHuge + 9));
      }
    }
  }
}

}  // namespace tfdude::testing
