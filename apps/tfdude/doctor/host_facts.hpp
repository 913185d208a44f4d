#pragma once

#include "facts.hpp"

// Facts about this host.
namespace tfdude::cli {

/// The interfaces; those that a participant uses are tried with a multicast message.
/// @param loopback  it uses 127.0.0.1 only
[[nodiscard]] std::vector<NetworkInterface> read_interfaces(bool loopback);

/// The UDP sockets of this host's network namespace.
[[nodiscard]] std::vector<UdpSocket> read_sockets();
/// The numbers of this process's own sockets.
[[nodiscard]] std::vector<std::uint64_t> own_sockets();

/// Why nobody can listen at the address of a discovery server (HOST:PORT): its host has no address,
/// or rejects messages to the port. Empty: somebody may listen.
[[nodiscard]] std::string fault_of_server(const std::string& server);

/// How much of a requested buffer a UDP socket gets [bytes].
[[nodiscard]] std::size_t granted_receive_buffer(std::size_t wanted);
[[nodiscard]] std::size_t granted_send_buffer(std::size_t wanted);

/// The rules of nftables, which include those of iptables-nft; nothing if they cannot be read.
[[nodiscard]] std::optional<std::string> read_firewall();

}  // namespace tfdude::cli
