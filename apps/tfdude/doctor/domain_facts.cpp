#include "domain_facts.hpp"

#include <algorithm>

#include "tfdude/client/client.hpp"

#include "../../rendering/table.hpp"
#include "../answer.hpp"
#include "../stamps.hpp"
#include "host_facts.hpp"

namespace tfdude::cli {
namespace {

// Long enough to discover all participants of this host.
constexpr Milliseconds kMoment{400};
// Of the domains that this host has participants of.
constexpr std::size_t kMostDomains = 5;

// The sockets of others, or of this process.
std::vector<UdpSocket> sockets_of(bool own) {
  const auto mine = own_sockets();
  std::vector<UdpSocket> sockets = read_sockets();
  const auto of_others = [&](const UdpSocket& socket) {
    return (std::find(mine.begin(), mine.end(), socket.inode) != mine.end()) != own;
  };
  sockets.erase(std::remove_if(sockets.begin(), sockets.end(), of_others), sockets.end());
  return sockets;
}

// The partitions that a participant with these options discovers within a moment.
std::vector<PartitionInfo> discovered_by(Options options) {
  options.timeout = options.discovery = kMoment;
  auto client = Client::open(options);
  if (!client) return {};
  return client->partitions().value_or(std::vector<PartitionInfo>());
}

// While a participant exists: a profile of a file may be of either kind.
void read_own_sockets(Facts& facts) {
  const Listeners own = listeners_in(sockets_of(true), facts.domain);
  if (own.any()) facts.loopback = own.everywhere == 0;
}

void ask_domain(Client& client, Facts& facts) {
  client.find_memory();
  auto partitions = client.partitions();
  if (!partitions) {
    facts.failed = std::move(partitions.error());
    return;
  }
  for (PartitionInfo& partition : *partitions) {
    std::optional<ClockDifference> clock;
    if (partition.reachable && partition.compatible()) {
      const auto difference = client.clock_difference(partition.name);
      if (difference) clock = *difference;
    }
    facts.met.push_back({std::move(partition), clock});
  }
}

void search_elsewhere(const Options& options, Facts& facts) {
  const Listeners others = facts.others_here();
  if ((facts.loopback ? others.everywhere : others.loopback) > 0) {
    Options other = options;
    other.profile = facts.loopback ? "" : kLocalProfile;
    facts.of_other_profile = discovered_by(other);
  }
  if (!facts.met.empty()) return;
  for (const auto& [domain, listeners] : facts.others) {
    if (domain == facts.domain || facts.elsewhere.size() == kMostDomains) continue;
    Options other = options;
    other.domain = domain;
    if (options.profile.empty() || options.profile == kLocalProfile) {
      other.profile = listeners.everywhere > 0 ? "" : kLocalProfile;
    }
    facts.elsewhere.emplace(domain, names_of(discovered_by(other), &PartitionInfo::name));
  }
}

}  // namespace

Facts gather_facts(const Options& options) {
  Facts facts;
  facts.now = wall_clock();
  facts.domain = options.domain;
  facts.profile = profile_of(options);
  facts.discovery_server = options.discovery_server;
  facts.loopback = options.profile == kLocalProfile;
  if (!options.discovery_server.empty()) {
    facts.server_fault = fault_of_server(options.discovery_server);
  }
  if (!options.keys.empty()) facts.keys = find_keys(options.keys, facts.now);
  facts.others = listeners_of(sockets_of(false));
  if (auto client = Client::open(options)) {
    read_own_sockets(facts);
    ask_domain(*client, facts);
  } else {
    facts.failed = client.error();
    // Perhaps because of its keys.
    Options plain = options;
    plain.keys.clear();
    if (client = Client::open(plain); client) read_own_sockets(facts);
  }
  search_elsewhere(options, facts);
  facts.interfaces = read_interfaces(facts.loopback);
  facts.receive_buffer = granted_receive_buffer(kReceiveBuffer);
  facts.send_buffer = granted_send_buffer(kSendBuffer);
  facts.firewall = read_firewall();
  return facts;
}

}  // namespace tfdude::cli
