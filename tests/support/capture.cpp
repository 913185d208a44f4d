#include "support/capture.hpp"

#include <array>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <arpa/inet.h>
#include <linux/if_ether.h>
#include <linux/if_packet.h>
#include <net/if.h>

namespace tfdude::testing {

Capture::Capture() {
  socket_ = socket(AF_PACKET, SOCK_DGRAM | SOCK_CLOEXEC, htons(ETH_P_IP));
  if (socket_ < 0) return;
  constexpr int kBuffer = 1 << 24;
  (void)setsockopt(socket_, SOL_SOCKET, SO_RCVBUFFORCE, &kBuffer, sizeof kBuffer);
  sockaddr_ll address{};
  address.sll_family = AF_PACKET;
  address.sll_protocol = htons(ETH_P_IP);
  address.sll_ifindex = static_cast<int>(if_nametoindex("lo"));
  if (bind(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) {
    close(socket_);
    socket_ = -1;
    return;
  }
  thread_ = std::thread([this] { run(); });
}

Capture::~Capture() {
  stopping_ = true;
  if (thread_.joinable()) thread_.join();
  if (socket_ >= 0) close(socket_);
}

std::string Capture::bytes() const {
  const std::lock_guard lock(mutex_);
  return bytes_;
}

void Capture::run() {
  std::array<char, 65536> packet{};
  while (!stopping_) {
    pollfd ready{socket_, POLLIN, 0};
    if (poll(&ready, 1, 20) <= 0) continue;
    const ssize_t size = recv(socket_, packet.data(), packet.size(), 0);
    if (size <= 0) continue;
    const std::lock_guard lock(mutex_);
    bytes_.append(packet.data(), static_cast<std::size_t>(size));
  }
}

}  // namespace tfdude::testing
