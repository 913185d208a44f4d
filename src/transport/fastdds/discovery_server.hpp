#pragma once

#include <string>

#include "tfdude/base/result.hpp"

#include "transport/fastdds/compat.hpp"

// Discovery by a server, where the network has no multicast or is to be kept free of it.
namespace tfdude::fastdds {

/// Prepares a participant to discover the others by the server at this address, HOST:PORT. The
/// server need not run yet, but the host's name must be known.
/// @return kInvalidInput naming the address.
[[nodiscard]] Result<void> use_discovery_server(edds::DomainParticipantQos& qos,
                                                const std::string& address);

}  // namespace tfdude::fastdds
