// How many participants of one host a domain has ports for.

#include <cstdint>
#include <list>
#include <string>
#include <sys/socket.h>
#include <unistd.h>

#include <netinet/in.h>

#include "tfdude/client/client.hpp"
#include "tfdude/client/node.hpp"

#include "support/catch.hpp"
#include "support/domain_lease.hpp"

namespace tfdude::testing {
namespace {

/// A UDP port of 127.0.0.1 that nobody else can take meanwhile; perhaps somebody has it already.
class TakenPort {
 public:
  explicit TakenPort(std::uint16_t port) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    address.sin_port = htons(port);
    (void)bind(fd_, reinterpret_cast<const sockaddr*>(&address), sizeof address);
  }
  ~TakenPort() { close(fd_); }
  TakenPort(const TakenPort&) = delete;
  TakenPort& operator=(const TakenPort&) = delete;

 private:
  const int fd_ = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
};

// The ports of the n-th participant of a host, by the rules of RTPS.
std::uint16_t port_for_discovery(std::uint32_t domain, std::uint32_t n) {
  return static_cast<std::uint16_t>(7400 + 250 * domain + 10 + 2 * n);
}

constexpr std::uint32_t kParticipants = 120;

TEST_CASE("a domain has ports for 120 participants of a host", "[system]") {
  const DomainLease domain;
  Options options;
  options.domain = domain.number();
  options.profile = TFDUDE_LOOPBACK_PROFILE;
  std::list<TakenPort> taken;
  for (std::uint32_t n = 0; n < kParticipants - 2; ++n) {
    const std::uint16_t port = port_for_discovery(domain.number(), n);
    taken.emplace_back(port);
    taken.emplace_back(static_cast<std::uint16_t>(port + 1));
  }

  auto node = Node::open("arm", {{"base", "", {}}, {"tip", "base", {}}}, options);
  REQUIRE(node);
  auto client = Client::open(options);
  REQUIRE(client);
  CHECK(client->lookup("base", "tip"));
}

}  // namespace
}  // namespace tfdude::testing
