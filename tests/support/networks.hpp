#pragma once

#include <deque>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "tfdude/transport/fastdds.hpp"
#include "tfdude/transport/loopback.hpp"

#include "support/domain_lease.hpp"
#include "support/sanitizers.hpp"

// The networks that contract tests run over. Needs TFDUDE_LOOPBACK_PROFILE.
namespace tfdude::testing {

/// Gives each participant of one test a transport of the same network.
using Join = std::function<TransportPtr(const std::string& partition)>;

[[nodiscard]] inline Join join_loopback() {
  auto network = std::make_shared<LoopbackNetwork>();
  return [network](const std::string&) { return network->join(); };
}

[[nodiscard]] inline Join join_fastdds() {
  // Kept until the process ends, because participants may live longer than the returned function.
  static std::deque<DomainLease> leases;
  const std::uint32_t domain = leases.emplace_back().number();
  return [domain](const std::string& partition) {
    return *make_fastdds_transport({domain, TFDUDE_LOOPBACK_PROFILE, partition, nullptr});
  };
}

[[nodiscard]] inline Join joined_by(int transport) {
  return transport == 0 ? join_loopback() : join_fastdds();
}

/// The values for joined_by(). ThreadSanitizer does not see the locks of Fast DDS.
[[nodiscard]] inline std::vector<int> networks() {
#ifdef TFDUDE_THREAD_SANITIZER
  return {0};
#else
  return {0, 1};
#endif
}

}  // namespace tfdude::testing
