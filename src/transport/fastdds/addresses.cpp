#include "transport/fastdds/addresses.hpp"

#include <array>
#include <cstring>
#include <ifaddrs.h>
#include <memory>

#include <net/if.h>
#include <netinet/in.h>

namespace tfdude::fastdds {
namespace {

using Address = std::array<unsigned char, 4>;

std::vector<Address> addresses_of_host() {
  ifaddrs* first = nullptr;
  if (getifaddrs(&first) != 0) return {};
  const std::unique_ptr<ifaddrs, decltype(&freeifaddrs)> owned(first, &freeifaddrs);
  std::vector<Address> addresses;
  for (const ifaddrs* one = first; one != nullptr; one = one->ifa_next) {
    const bool running = (one->ifa_flags & IFF_RUNNING) != 0;
    if (!running || one->ifa_addr == nullptr || one->ifa_addr->sa_family != AF_INET) continue;
    sockaddr_in socket{};
    std::memcpy(&socket, one->ifa_addr, sizeof socket);
    Address address{};
    std::memcpy(address.data(), &socket.sin_addr, address.size());
    if (address[0] != 127) addresses.push_back(address);
  }
  return addresses;
}

}  // namespace

void name_group(ertps::Locator_t& locator) { ertps::IPLocator::setIPv4(locator, 239, 255, 0, 1); }

void name_group(ertps::LocatorList_t& locators) {
  for (ertps::Locator_t& locator : locators) {
    if (locator.kind == LOCATOR_KIND_UDPv4 && ertps::IPLocator::isAny(locator)) name_group(locator);
  }
}

ertps::LocatorList_t named(const ertps::Locator_t& locator,
                           const std::function<bool(const ertps::Locator_t&)>& allowed) {
  ertps::LocatorList_t list;
  ertps::Locator_t own = locator;
  for (const Address& address : addresses_of_host()) {
    ertps::IPLocator::setIPv4(own, address.data());
    if (allowed(own)) list.push_back(own);
  }
  if (list.empty()) {
    ertps::IPLocator::setIPv4(own, 127, 0, 0, 1);
    list.push_back(own);
  }
  return list;
}

}  // namespace tfdude::fastdds
