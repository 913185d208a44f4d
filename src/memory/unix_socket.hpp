#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>

#include "tfdude/base/result.hpp"

namespace tfdude {

/// A file descriptor, closed with its object.
class Descriptor {
 public:
  explicit Descriptor(int fd = -1) : fd_(fd) {}
  ~Descriptor();
  Descriptor(Descriptor&& other) noexcept : fd_(std::exchange(other.fd_, -1)) {}
  Descriptor& operator=(Descriptor&& other) noexcept {
    std::swap(fd_, other.fd_);
    return *this;
  }

  [[nodiscard]] int get() const { return fd_; }
  [[nodiscard]] bool valid() const { return fd_ >= 0; }

 private:
  int fd_;
};

// Sockets of one computer that keep the bounds of messages, with abstract names, which leave no
// files. Such names are known in one network namespace only.

/// What a reader says first.
struct Hello {
  std::uint64_t magic = 0x4F4C4C45'48464454;
  std::uint64_t token = 0;  ///< the first half
  std::uint64_t layout = 0;
};

/// What the owner answers, with the descriptor of its memory.
struct Welcome {
  std::uint64_t token = 0;  ///< the second half, which shows that it is the owner; 0: rejected
};

/// What a reader says later: whether it waits for what the owner writes.
struct Wish {
  std::uint64_t magic = 0x48534957'48464454;
  std::uint64_t waits = 0;
};

/// @return kUnsupported
[[nodiscard]] Result<Descriptor> listen_at(const std::string& name);
/// @return kUnsupported: nobody listens there
[[nodiscard]] Result<Descriptor> connect_to(const std::string& name);
/// Without waiting; invalid: nobody has called.
[[nodiscard]] Descriptor accept_one(const Descriptor& listening);

[[nodiscard]] bool send_hello(const Descriptor& socket, const Hello& hello);
/// Without waiting.
[[nodiscard]] bool receive_hello(const Descriptor& socket, Hello& hello);
/// Lets the other side know at once, although another thread may be waiting for the socket.
void hang_up(const Descriptor& socket);

bool send_wish(const Descriptor& socket, const Wish& wish);
/// Without waiting.
[[nodiscard]] bool receive_wish(const Descriptor& socket, Wish& wish);

/// Whether who was connected there, or listens there, is of this process's user.
[[nodiscard]] bool is_of_this_user(const Descriptor& socket);
/// Without waiting. @return false also if nobody receives, or too many messages wait
[[nodiscard]] bool send_message(const Descriptor& socket, std::string_view message);
/// Without waiting. @return empty: there is none, or it is longer than that
[[nodiscard]] std::string receive_message(const Descriptor& socket, std::size_t most);

/// @param memory  -1: none
[[nodiscard]] bool send_welcome(const Descriptor& socket, const Welcome& welcome, int memory);
/// Without waiting.
[[nodiscard]] bool receive_welcome(const Descriptor& socket, Welcome& welcome, Descriptor& memory);

}  // namespace tfdude
