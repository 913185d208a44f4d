#include "support/domain_lease.hpp"

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <stdexcept>
#include <string>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

namespace tfdude::testing {
namespace {

constexpr std::uint32_t kFirst = 20;
constexpr std::uint32_t kCount = 200;

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

}  // namespace

DomainLease::DomainLease() {
  static std::atomic<std::uint32_t> tests{0};
  const std::uint32_t wish = static_cast<std::uint32_t>(getpid()) * 7 + tests++;
  for (std::uint32_t i = 0; i < kCount && claim_ < 0; ++i) {
    number_ = kFirst + (wish + i) % kCount;
    claim_ = claim(number_);
  }
  if (claim_ < 0) throw std::runtime_error("all DDS domains for tests are taken");
}

DomainLease::~DomainLease() { close(claim_); }

}  // namespace tfdude::testing
