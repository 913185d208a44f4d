#include "transport/fastdds/discovery_server.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cstdint>
#include <cstring>
#include <memory>
#include <netdb.h>
#include <optional>
#include <sys/socket.h>

#include "tfdude/base/id.hpp"
#include "tfdude/transport/fastdds.hpp"

namespace tfdude {
namespace {

struct HostAndPort {
  std::string host;
  std::uint16_t port = 0;
};

std::optional<HostAndPort> parse(const std::string& text) {
  const auto colon = text.rfind(':');
  if (colon == std::string::npos || colon == 0) return std::nullopt;
  HostAndPort address{text.substr(0, colon), 0};
  const bool name = std::none_of(address.host.begin(), address.host.end(), [](unsigned char c) {
    return c <= ' ' || c == ':' || c == '[' || c == ']' || c == 0x7F;
  });
  const char* end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(text.data() + colon + 1, end, address.port);
  if (!name || error != std::errc() || stop != end || address.port == 0) return std::nullopt;
  return address;
}

tl::unexpected<Error> malformed(const std::string& text) {
  return fail(Errc::kInvalidInput,
              "discovery server " + quote(text) +
                  " is not HOST:PORT with a name or an IPv4 address and a port from 1 to 65535");
}

}  // namespace

Result<void> check_discovery_server(const std::string& address) {
  if (!parse(address)) return malformed(address);
  return {};
}

namespace fastdds {
namespace {

// Names are not resolved by Fast DDS, because its versions differ in this.
Result<ertps::Locator_t> resolve(const std::string& host) {
  addrinfo hints{};
  hints.ai_family = AF_INET;
  hints.ai_socktype = SOCK_DGRAM;
  addrinfo* found = nullptr;
  const int status = getaddrinfo(host.c_str(), nullptr, &hints, &found);
  if (status != 0) {
    return fail(Errc::kInvalidInput,
                "host " + quote(host) + " has no IPv4 address: " + gai_strerror(status));
  }
  const std::unique_ptr<addrinfo, decltype(&freeaddrinfo)> owned(found, &freeaddrinfo);
  sockaddr_in address{};
  std::memcpy(&address, found->ai_addr, sizeof address);
  // Not as text, which Fast DDS reads with the locale of the program.
  std::array<unsigned char, sizeof address.sin_addr> bytes{};
  std::memcpy(bytes.data(), &address.sin_addr, bytes.size());
  ertps::Locator_t at;
  ertps::IPLocator::setIPv4(at, bytes.data());
  return at;
}

}  // namespace

Result<void> use_discovery_server(edds::DomainParticipantQos& qos, const std::string& address) {
  const auto parsed = parse(address);
  if (!parsed) return malformed(address);
  const auto resolved = resolve(parsed->host);
  if (!resolved) {
    return fail(Errc::kInvalidInput,
                "discovery server " + quote(address) + ": " + resolved.error().message);
  }
  ertps::Locator_t at = *resolved;
  at.port = parsed->port;
  auto& discovery = qos.wire_protocol().builtin.discovery_config;
  // The period of calls to a server that has not answered yet.
  discovery.discoveryServer_client_syncperiod = {0, 100'000'000};
  discover_by_server(discovery, at);
  return {};
}

}  // namespace fastdds
}  // namespace tfdude
