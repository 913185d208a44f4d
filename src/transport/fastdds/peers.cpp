#include "transport/fastdds/peers.hpp"

#include <algorithm>

#include "base/log.hpp"
#include "base/mutex.hpp"

namespace tfdude::fastdds {
PeerId peer_of(const ertps::GuidPrefix_t& prefix) {
  PeerId peer{};
  std::copy_n(prefix.value, peer.size(), peer.begin());
  return peer;
}

std::string reply_partition(const PeerId& peer) {
  constexpr const char* kDigits = "0123456789abcdef";
  std::string name = "tfdude-peer-";
  for (const std::uint8_t byte : peer) {
    name += kDigits[byte >> 4U];
    name += kDigits[byte & 15U];
  }
  return name;
}

void Peers::met(const ertps::GuidPrefix_t& prefix, const Announcement& said) {
  const Lock lock(mutex_);
  last_met_ = Clock::now();
  if (said.compatible()) {
    if (!said.partition.empty()) servers_.try_emplace(peer_of(prefix));
    return;
  }
  IncompatiblePeer peer{said.partition, said.protocol, said.program,
                        std::chrono::system_clock::now()};
  if (logged_.insert(peer.text()).second) {
    log().error("{}: no messages are exchanged with it", peer.text());
  }
  incompatible_.insert_or_assign(peer_of(prefix), std::move(peer));
  any_incompatible_ = true;
}

std::vector<IncompatiblePeer> Peers::incompatible() const {
  std::vector<IncompatiblePeer> servers;
  if (!any_incompatible_) return servers;
  const Lock lock(mutex_);
  for (const auto& [id, peer] : incompatible_) {
    if (!peer.partition.empty()) servers.push_back(peer);
  }
  return servers;
}

bool Peers::is_incompatible(const ertps::GuidPrefix_t& prefix) const {
  if (!any_incompatible_) return false;
  const Lock lock(mutex_);
  return incompatible_.count(peer_of(prefix)) != 0;
}

void Peers::left(const ertps::GuidPrefix_t& prefix) {
  const Lock lock(mutex_);
  incompatible_.erase(peer_of(prefix));
  const auto known = servers_.find(peer_of(prefix));
  if (known == servers_.end()) return;
  const Server& server = known->second;
  if (server.said() != nullptr && !server.silent) gone_(*server.said());
  servers_.erase(known);
}

void Peers::sent_page(const ertps::GuidPrefix_t& prefix, const Page& page) {
  {
    const Lock lock(mutex_);
    const auto known = servers_.find(peer_of(prefix));
    if (known == servers_.end()) return;
    Server& server = known->second;
    if (!server.presence || server.presence->incarnation < page.incarnation) {
      server.by_page.emplace();
      server.by_page->partition = page.partition;
      server.by_page->incarnation = page.incarnation;
    }
  }
  heard(prefix);
}

void Peers::present(const ertps::GuidPrefix_t& prefix, const Presence& presence, std::size_t peers,
                    bool beat) {
  const Lock lock(mutex_);
  Server& server = servers_[peer_of(prefix)];
  server.peers = peers;
  server.beats = server.beats || beat;
  server.last_heard = Clock::now();
  if (!std::exchange(server.silent, false) && server.presence == presence) return;
  server.presence = presence;
  there_(presence);
}

void Peers::heard(const ertps::GuidPrefix_t& prefix) {
  const Lock lock(mutex_);
  const auto known = servers_.find(peer_of(prefix));
  if (known == servers_.end()) return;
  Server& server = known->second;
  server.last_heard = Clock::now();
  if (std::exchange(server.silent, false) && server.presence) there_(*server.presence);
}

void Peers::look_for_silent(Clock::time_point now) {
  const Lock lock(mutex_);
  const auto late = now - std::exchange(last_look_, now) - kSpeakEvery;
  for (auto& [id, server] : servers_) {
    if (late > Clock::duration::zero()) server.last_heard += late;
    const Presence* said = server.said();
    if (said == nullptr || server.silent || now - server.last_heard < patience(server)) continue;
    server.silent = true;
    gone_(*said);
  }
}

bool Peers::discovered() const {
  const Lock lock(mutex_);
  return !servers_.empty() && Clock::now() - last_met_ >= kQuiet && all_present() &&
         nobody_hears_more();
}

std::uint32_t Peers::heard_count() const {
  const Lock lock(mutex_);
  return static_cast<std::uint32_t>(std::count_if(
      servers_.begin(), servers_.end(),
      [](const auto& server) { return server.second.presence && !server.second.silent; }));
}

bool Peers::silent(const std::string& partition) const {
  const Lock lock(mutex_);
  bool silent = false;
  for (const auto& [id, server] : servers_) {
    if (!server.presence || server.presence->partition != partition) continue;
    if (!server.silent) return false;
    silent = true;
  }
  return silent;
}

bool Peers::awaits_presence() const {
  const Lock lock(mutex_);
  return !all_present();
}

// Only beats say how many others a server hears: the number in its presence may be outdated.
bool Peers::nobody_hears_more() const {
  const std::size_t others = servers_.size() - 1 + (is_server_ ? 1 : 0);
  return std::all_of(servers_.begin(), servers_.end(), [others](const auto& known) {
    const Server& server = known.second;
    return server.silent || (server.beats && server.peers <= others);
  });
}

bool Peers::all_present() const {
  return std::all_of(servers_.begin(), servers_.end(), [](const auto& known) {
    return known.second.presence || known.second.silent;
  });
}

}  // namespace tfdude::fastdds
