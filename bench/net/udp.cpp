#include "net/udp.hpp"

#include <array>
#include <cstring>
#include <sys/socket.h>
#include <sys/time.h>
#include <unistd.h>

#include <arpa/inet.h>
#include <netinet/in.h>

#include "net/harness.hpp"

namespace bench {
namespace {

constexpr std::size_t kLargest = 65536;

/// The first bytes of a datagram.
struct Head {
  std::uint32_t number;
  std::uint32_t reply_bytes;
};

sockaddr_in loopback(std::uint16_t port) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(port);
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  return address;
}

sockaddr* generic(sockaddr_in& address) { return reinterpret_cast<sockaddr*>(&address); }

}  // namespace

UdpSocket::UdpSocket() : socket_(::socket(AF_INET, SOCK_DGRAM, 0)), buffer_(kLargest) {
  sockaddr_in address = loopback(0);
  const timeval patience{1, 0};
  if (socket_ < 0 || ::bind(socket_, generic(address), sizeof address) != 0 ||
      ::setsockopt(socket_, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience) != 0) {
    give_up("no UDP socket on 127.0.0.1");
  }
}

UdpSocket::~UdpSocket() { ::close(socket_); }

std::uint16_t UdpSocket::port() const {
  sockaddr_in address{};
  socklen_t size = sizeof address;
  ::getsockname(socket_, generic(address), &size);
  return ntohs(address.sin_port);
}

void UdpSocket::ask(std::uint16_t port, std::uint32_t number, std::size_t bytes,
                    std::size_t reply_bytes) {
  const Head head{number, static_cast<std::uint32_t>(reply_bytes)};
  std::memcpy(buffer_.data(), &head, sizeof head);
  sockaddr_in to = loopback(port);
  ::sendto(socket_, buffer_.data(), bytes, 0, generic(to), sizeof to);
}

std::uint32_t UdpSocket::await_reply() {
  if (::recv(socket_, buffer_.data(), buffer_.size(), 0) < static_cast<ssize_t>(sizeof(Head))) {
    give_up("a UDP echo was lost");
  }
  Head head{};
  std::memcpy(&head, buffer_.data(), sizeof head);
  return head.number;
}

void UdpSocket::echo() {
  while (true) {
    sockaddr_in from{};
    socklen_t size = sizeof from;
    const auto got = ::recvfrom(socket_, buffer_.data(), buffer_.size(), 0, generic(from), &size);
    if (got < static_cast<ssize_t>(sizeof(Head))) continue;
    Head head{};
    std::memcpy(&head, buffer_.data(), sizeof head);
    ::sendto(socket_, buffer_.data(), head.reply_bytes, 0, generic(from), size);
  }
}

}  // namespace bench
