#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <string>

#include "tfdude/base/export.hpp"
#include "tfdude/base/result.hpp"
#include "tfdude/transport/transport.hpp"

namespace tfdude {

/// What came to a participant's readers of requests and updates, before and after the filters; what never
/// came to them woke nobody. And what it has made.
struct FastDdsCounters {
  std::atomic<std::uint64_t> requests_arrived{0};
  std::atomic<std::uint64_t> requests_passed{0};
  std::atomic<std::uint64_t> updates_arrived{0};
  std::atomic<std::uint64_t> updates_passed{0};
  std::atomic<std::uint64_t> malformed{0};  ///< dropped: not well formed
  std::atomic<std::uint64_t> writers{0};    ///< DDS writers that there are now
};

struct FastDdsOptions {
  std::uint32_t domain = 0;  ///< 0 to 232
  /// XML file, or kLocalProfile (options.hpp); profiles that it lacks are taken from the built-in ones.
  std::string profile;
  std::string partition;     ///< the one that the participant is going to serve; empty: none
  std::shared_ptr<FastDdsCounters> counters;  ///< counted into, where given
  /// HOST:PORT of a Fast DDS discovery server with id 0; empty: participants meet by multicast
  std::string discovery_server = {};
};

/// Whether this is the address of a discovery server, HOST:PORT with a name or an IPv4 address. Looks nothing up.
/// @return kInvalidInput naming it.
[[nodiscard]] TFDUDE_EXPORT Result<void> check_discovery_server(const std::string& address);

/// Sends what Fast DDS logs in this process to standard error alone: warnings go to standard output else. For programs
/// whose output is read; a library leaves the log to its host.
TFDUDE_EXPORT void log_fastdds_to_standard_error();

/// A participant's access to a DDS domain by Fast DDS. It may live beside others of the process, ours or not, and changes
/// none of Fast DDS's settings that they share; its profile is its own. Delivery inside the process, which calls handlers
/// under the writer's locks, is not used whatever is set.
/// @return kInvalidInput (domain, discovery server). start() may fail with kConfig (profile), kTransport, and
///   kInvalidInput where the discovery server's host has no IPv4 address.
[[nodiscard]] TFDUDE_EXPORT Result<TransportPtr> make_fastdds_transport(
    const FastDdsOptions& options);

}  // namespace tfdude
