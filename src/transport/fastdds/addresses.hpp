#pragma once

#include <functional>

#include "transport/fastdds/compat.hpp"

// Addresses of IPv4 that Fast DDS knows only as text. Nothing here depends on the locale.
namespace tfdude::fastdds {

/// Sets the address at which the participants of a domain announce themselves: the multicast group
/// of RTPS 2.2, section 9.6.1.4.1.
void name_group(ertps::Locator_t& locator);

/// The same for those of UDP that have no address.
void name_group(ertps::LocatorList_t& locators);

/// A locator without an address stands for this host: the same with each of its addresses that is
/// allowed. Those of the loopback interface are left out, unless there are no others.
[[nodiscard]] ertps::LocatorList_t named(
    const ertps::Locator_t& locator, const std::function<bool(const ertps::Locator_t&)>& allowed);

}  // namespace tfdude::fastdds
