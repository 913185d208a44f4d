#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace tfdude::faults {

/// What an attacker floods a robot with.
[[nodiscard]] const std::vector<std::string>& attacks();

/// Floods the owners of partitions `base` and `arm` in a domain until the process is ended. Prints
/// "ready" when it begins.
/// @param keys  directory of an identity; empty: none
/// @return only if it cannot begin: the exit status
[[nodiscard]] int attack(const std::string& kind, std::uint32_t domain, const std::string& keys);

}  // namespace tfdude::faults
