#pragma once

#include <memory>

#include "transport/fastdds/compat.hpp"

namespace tfdude::ros {

/// UDP of which Fast DDS has only what passes the checks of the domain of tf-dude (DatagramGuard):
/// it believes numbers and lengths that anybody can send.
[[nodiscard]] std::shared_ptr<fastdds::etransport::TransportDescriptorInterface> guarded(
    std::shared_ptr<fastdds::etransport::UDPv4TransportDescriptor> udp);

}  // namespace tfdude::ros
