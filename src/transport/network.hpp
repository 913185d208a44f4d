#pragma once

#include <cstdint>
#include <string>

namespace tfdude {

/// Tells apart which participants of this computer discover each other by multicast and without
/// keys: those for which this text is the same, in one namespace of the network. It depends on the
/// domain, on the profiles and not on their file's name, and on the environment that Fast DDS
/// reads.
/// @param profile  as of Options
/// @return empty: the file of profiles cannot be read
[[nodiscard]] std::string network_of(std::uint32_t domain, const std::string& profile);

}  // namespace tfdude
