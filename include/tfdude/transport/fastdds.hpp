#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <string>

#include "tfdude/base/export.hpp"
#include "tfdude/base/result.hpp"
#include "tfdude/transport/transport.hpp"

namespace tfdude {

/// Counts the messages that reached a participant's readers of requests and updates, before and
/// after the filters, and its writers. Messages that never reached them woke no thread.
struct FastDdsCounters {
  std::atomic<std::uint64_t> requests_arrived{0};
  std::atomic<std::uint64_t> requests_passed{0};
  std::atomic<std::uint64_t> updates_arrived{0};
  std::atomic<std::uint64_t> updates_passed{0};
  std::atomic<std::uint64_t> malformed{0};  ///< dropped as malformed
  std::atomic<std::uint64_t> writers{0};    ///< current number of DDS writers
};

struct FastDdsOptions {
  std::uint32_t domain = 0;  ///< 0 to 232
  /// XML file, or kLocalProfile (options.hpp); the built-in profiles replace those that it lacks.
  std::string profile;
  std::string partition;  ///< the one the participant is going to serve; empty: none
  std::shared_ptr<FastDdsCounters> counters;  ///< updated if given
  /// HOST:PORT of a Fast DDS discovery server with id 0; empty: discovery by multicast.
  std::string discovery_server = {};
  std::string keys = {};  ///< directory of an identity (tfdude keys); empty: no keys
};

/// Checks the address of a discovery server: HOST:PORT, with a name or an IPv4 address. Does not
/// resolve it.
/// @return kInvalidInput naming the address.
[[nodiscard]] TFDUDE_EXPORT Result<void> check_discovery_server(const std::string& address);

/// Sends the log of Fast DDS in this process to standard error only. By default its warnings go to
/// standard output. For programs whose output is parsed; the library itself leaves the log to its
/// host.
TFDUDE_EXPORT void log_fastdds_to_standard_error();

/// Creates a participant's access to a DDS domain by Fast DDS. It can coexist with other
/// participants of the process, of this library or not: it changes no Fast DDS settings that they
/// share, and has its own profile. Intra-process delivery, which calls handlers under the writer's
/// locks, is always off.
/// @return kInvalidInput (domain, discovery server). start() may fail with kConfig (profile),
///   kTransport, kInvalidInput if the discovery server's host has no IPv4 address, and, for the
///   keys, as find_keys() and kNotPermitted if they are not those of the partition's daemon.
[[nodiscard]] TFDUDE_EXPORT Result<TransportPtr> make_fastdds_transport(
    const FastDdsOptions& options);

}  // namespace tfdude
