#pragma once

#include <cstddef>

#include "simulation/traffic.hpp"

namespace tfdude::simulation {

/// The bytes of a message as the DDS transport serializes it: the payload of the DDS sample,
/// without the headers of RTPS, UDP and IP.
[[nodiscard]] std::size_t wire_size(const Message& message);

}  // namespace tfdude::simulation
