#pragma once

#include <cstdint>
#include <vector>

// Bare UDP on 127.0.0.1: the floor below DDS.
namespace bench {

class UdpSocket {
 public:
  /// Bound to any free port; receives block for at most a second.
  UdpSocket();
  ~UdpSocket();
  UdpSocket(const UdpSocket&) = delete;
  UdpSocket& operator=(const UdpSocket&) = delete;

  [[nodiscard]] std::uint16_t port() const;

  /// Sends a datagram that asks for a reply of `reply_bytes`; both have at least 8 bytes.
  void ask(std::uint16_t port, std::uint32_t number, std::size_t bytes, std::size_t reply_bytes);

  /// The number of the next reply; ends the program if none comes.
  std::uint32_t await_reply();

  /// Answers forever.
  [[noreturn]] void echo();

 private:
  int socket_;
  std::vector<char> buffer_;
};

}  // namespace bench
