#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "tfdude/base/result.hpp"
#include "tfdude/keys/key_files.hpp"
#include "tfdude/types/clock_difference.hpp"
#include "tfdude/types/partition_info.hpp"

// What `tfdude doctor` finds out about this host, its network and the domain.
namespace tfdude::cli {

struct NetworkInterface {
  std::string name;
  std::string address;  ///< IPv4
  bool up = false;
  bool multicast = false;
  bool loopback = false;
  std::optional<bool> returns{};  ///< whether a multicast message came back; absent: not tried
};

/// A UDP socket of this host.
struct UdpSocket {
  std::uint32_t address = 0;  ///< in the order of the host
  std::uint16_t port = 0;
  std::uint64_t inode = 0;
};

/// DDS participants of this host in one domain, by the sockets that they listen on.
struct Listeners {
  std::size_t everywhere = 0;
  std::size_t loopback = 0;  ///< on 127.0.0.1 only

  [[nodiscard]] bool any() const { return everywhere + loopback > 0; }
};

/// A partition that was discovered, and the clock of its host.
struct Met {
  PartitionInfo partition;
  std::optional<ClockDifference> clock{};  ///< absent: it did not answer
};

struct Facts {
  // What was asked for.
  std::uint32_t domain = 0;
  std::string profile;  ///< in words
  std::string discovery_server;
  std::string server_fault{};  ///< why nobody can listen at its address; empty: not known
  bool loopback = false;       ///< this participant uses 127.0.0.1 only

  // This host.
  std::vector<NetworkInterface> interfaces{};
  std::map<std::uint32_t, Listeners> others{};  ///< by their domains, without this process
  std::optional<std::string> firewall{};        ///< its rules; absent: not readable
  std::size_t receive_buffer = 0;               ///< that the kernel grants [bytes]
  std::size_t send_buffer = 0;

  // The domain.
  std::vector<Met> met{};
  std::optional<Error> failed{};  ///< why the partitions could not be asked for
  /// Those that a participant with the other of the two built-in profiles discovers, if that is in
  /// use here.
  std::vector<PartitionInfo> of_other_profile{};
  /// The names of partitions in other domains that this host has participants of, if none was
  /// discovered in this one.
  std::map<std::uint32_t, std::vector<std::string>> elsewhere{};

  std::optional<Result<KeyFiles>> keys{};  ///< absent: none are used
  Time now{};

  /// Others in the same domain.
  [[nodiscard]] Listeners others_here() const {
    const auto here = others.find(domain);
    return here != others.end() ? here->second : Listeners{};
  }
};

/// What is wrong, and what to do.
struct Finding {
  std::string code;
  std::string what;
  std::string remedy;
};

/// Judges the facts. The most likely reason why no partition answers comes first.
[[nodiscard]] std::vector<Finding> findings_of(const Facts& facts);

/// What could not be checked, and how it could: one sentence each.
[[nodiscard]] std::vector<std::string> unchecked_of(const Facts& facts);

/// The UDP ports that DDS gives to a domain, both included.
struct Ports {
  std::uint32_t first;
  std::uint32_t last;
};
inline constexpr std::uint32_t kFirstPort = 7400;
inline constexpr std::uint32_t kPortsOfDomain = 250;
[[nodiscard]] constexpr Ports ports_of(std::uint32_t domain) {
  const std::uint32_t first = kFirstPort + kPortsOfDomain * domain;
  return {first, first + kPortsOfDomain - 1};
}

/// Reads the kernel's list of UDP sockets (/proc/net/udp).
[[nodiscard]] std::vector<UdpSocket> sockets_in(const std::string& table);

/// The participants of a domain that have these sockets.
[[nodiscard]] Listeners listeners_in(const std::vector<UdpSocket>& sockets, std::uint32_t domain);

/// The same for all domains in which somebody listens to multicast, as daemons do. Other ports
/// may be of any program.
[[nodiscard]] std::map<std::uint32_t, Listeners> listeners_of(
    const std::vector<UdpSocket>& sockets);

/// The chains and rules of nftables that may drop messages of a domain: a rule that drops, or a
/// chain whose policy is to drop and that does not accept its ports.
[[nodiscard]] std::vector<std::string> blocking_rules(const std::string& ruleset,
                                                      std::uint32_t domain);

/// What Fast DDS asks for (profiles/tfdude.xml).
inline constexpr std::size_t kReceiveBuffer = 4194304;
inline constexpr std::size_t kSendBuffer = 1048576;
/// Clocks that differ by less are not mentioned: the distance of samples at 100 Hz.
inline constexpr std::chrono::milliseconds kClockTolerance{10};
/// Keys that are valid for less are mentioned.
inline constexpr std::chrono::hours kKeysTolerance{24 * 30};

}  // namespace tfdude::cli
