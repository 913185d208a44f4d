#include "memory/unix_socket.hpp"

#include <algorithm>
#include <cerrno>
#include <cstddef>
#include <cstring>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include "tfdude/base/id.hpp"

namespace tfdude {
namespace {

struct Address {
  explicit Address(const std::string& name) {
    at.sun_family = AF_UNIX;
    // A zero before the name makes it an abstract one.
    const std::size_t size = std::min(name.size(), sizeof(at.sun_path) - 1);
    std::memcpy(at.sun_path + 1, name.data(), size);
    length = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + 1 + size);
  }
  [[nodiscard]] const sockaddr* get() const {
    return reinterpret_cast<const sockaddr*>(&at);  // NOLINT(*-reinterpret-cast): as POSIX wants
  }

  sockaddr_un at{};
  socklen_t length = 0;
};

Descriptor new_socket() {
  return Descriptor(socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
}

tl::unexpected<Error> failed(const char* what) {
  return fail(Errc::kUnsupported, std::string(what) + ": " + std::strerror(errno));
}

}  // namespace

Descriptor::~Descriptor() {
  if (fd_ >= 0) close(fd_);
}

Result<Descriptor> listen_at(const std::string& name) {
  Descriptor listening = new_socket();
  const Address address(name);
  constexpr int kWaiting = 128;
  if (!listening.valid() || bind(listening.get(), address.get(), address.length) != 0 ||
      listen(listening.get(), kWaiting) != 0) {
    return failed("no unix socket");
  }
  return listening;
}

Result<Descriptor> connect_to(const std::string& name) {
  Descriptor connected = new_socket();
  const Address address(name);
  if (!connected.valid() || connect(connected.get(), address.get(), address.length) != 0) {
    return failed("its socket is not to be reached from here, as in a container");
  }
  return connected;
}

Descriptor accept_one(const Descriptor& listening) {
  return Descriptor(accept4(listening.get(), nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK));
}

bool send_hello(const Descriptor& socket, const Hello& hello) {
  return send(socket.get(), &hello, sizeof(hello), MSG_NOSIGNAL) == sizeof(hello);
}

bool receive_hello(const Descriptor& socket, Hello& hello) {
  const auto size = recv(socket.get(), &hello, sizeof(hello), MSG_DONTWAIT);
  return size == sizeof(hello) && hello.magic == Hello().magic;
}

void hang_up(const Descriptor& socket) { (void)shutdown(socket.get(), SHUT_RDWR); }

bool send_wish(const Descriptor& socket, const Wish& wish) {
  return send(socket.get(), &wish, sizeof(wish), MSG_NOSIGNAL) == sizeof(wish);
}

bool receive_wish(const Descriptor& socket, Wish& wish) {
  const auto size = recv(socket.get(), &wish, sizeof(wish), MSG_DONTWAIT);
  return size == sizeof(wish) && wish.magic == Wish().magic;
}

bool is_of_this_user(const Descriptor& socket) {
  ucred peer{};
  socklen_t size = sizeof(peer);
  return getsockopt(socket.get(), SOL_SOCKET, SO_PEERCRED, &peer, &size) == 0 &&
         size == sizeof(peer) && peer.uid == geteuid();
}

bool send_message(const Descriptor& socket, std::string_view message) {
  const auto sent = send(socket.get(), message.data(), message.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
  return sent == static_cast<ssize_t>(message.size());
}

std::string receive_message(const Descriptor& socket, std::size_t most) {
  // Of all of it, however little is read.
  const auto size = recv(socket.get(), nullptr, 0, MSG_PEEK | MSG_TRUNC | MSG_DONTWAIT);
  if (size <= 0 || static_cast<std::size_t>(size) > most) return {};
  std::string message(static_cast<std::size_t>(size), '\0');
  const auto received = recv(socket.get(), message.data(), message.size(), MSG_DONTWAIT);
  if (received != size) message.clear();
  return message;
}

bool send_welcome(const Descriptor& socket, const Welcome& welcome, int memory) {
  Welcome copy = welcome;
  iovec bytes{&copy, sizeof(copy)};
  alignas(cmsghdr) std::array<char, CMSG_SPACE(sizeof(int))> control{};
  msghdr message{};
  message.msg_iov = &bytes;
  message.msg_iovlen = 1;
  if (memory >= 0) {
    message.msg_control = control.data();
    message.msg_controllen = control.size();
    cmsghdr* header = CMSG_FIRSTHDR(&message);
    header->cmsg_level = SOL_SOCKET;
    header->cmsg_type = SCM_RIGHTS;
    header->cmsg_len = CMSG_LEN(sizeof(int));
    std::memcpy(CMSG_DATA(header), &memory, sizeof(int));
  }
  return sendmsg(socket.get(), &message, MSG_NOSIGNAL) == sizeof(copy);
}

bool receive_welcome(const Descriptor& socket, Welcome& welcome, Descriptor& memory) {
  iovec bytes{&welcome, sizeof(welcome)};
  alignas(cmsghdr) std::array<char, CMSG_SPACE(sizeof(int))> control{};
  msghdr message{};
  message.msg_iov = &bytes;
  message.msg_iovlen = 1;
  message.msg_control = control.data();
  message.msg_controllen = control.size();
  const auto size = recvmsg(socket.get(), &message, MSG_CMSG_CLOEXEC | MSG_DONTWAIT);
  for (cmsghdr* header = CMSG_FIRSTHDR(&message); header != nullptr && size >= 0;
       header = CMSG_NXTHDR(&message, header)) {
    if (header->cmsg_level != SOL_SOCKET || header->cmsg_type != SCM_RIGHTS) continue;
    int fd = -1;
    std::memcpy(&fd, CMSG_DATA(header), sizeof(fd));
    memory = Descriptor(fd);
  }
  return size == sizeof(welcome);
}

}  // namespace tfdude
