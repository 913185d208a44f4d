#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <string>
#include <unistd.h>

#include "tfdude/transport/fastdds.hpp"
#include "tfdude/transport/loopback.hpp"

// The networks that contract tests run over. Needs TFDUDE_LOOPBACK_PROFILE.
namespace tfdude::testing {

/// Gives each participant of one test a transport of the same network.
using Join = std::function<std::unique_ptr<Transport>(const std::string& partition)>;

[[nodiscard]] inline Join join_loopback() {
  auto network = std::make_shared<LoopbackNetwork>();
  return [network](const std::string&) { return network->join(); };
}

[[nodiscard]] inline Join join_fastdds() {
  // Tests of one machine that run side by side must not meet.
  static std::atomic<std::uint32_t> tests{0};
  const std::uint32_t domain = 20 + (static_cast<std::uint32_t>(getpid()) * 7 + tests++) % 200;
  return [domain](const std::string& partition) {
    return *make_fastdds_transport({domain, TFDUDE_LOOPBACK_PROFILE, partition, nullptr});
  };
}

[[nodiscard]] inline Join joined_by(int transport) {
  return transport == 0 ? join_loopback() : join_fastdds();
}

}  // namespace tfdude::testing
