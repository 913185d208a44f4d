#include "transport/fastdds/peers.hpp"

#include <algorithm>
#include <iterator>

#include "base/log.hpp"
#include "base/mutex.hpp"

namespace tfdude::fastdds {
namespace {

// Of participants that speak another major version.
constexpr std::size_t kMostLogged = 256;
// Anybody can announce any number of partitions, and leave.
constexpr std::size_t kMostUntold = 256;

}  // namespace

PeerId peer_of(const ertps::GuidPrefix_t& prefix) {
  PeerId peer{};
  std::copy_n(prefix.value, peer.size(), peer.begin());
  return peer;
}

std::string reply_partition(const std::string& owner, const PeerId& peer) {
  constexpr const char* kDigits = "0123456789abcdef";
  std::string name = owner + "/";
  for (const std::uint8_t byte : peer) {
    name += kDigits[byte >> 4U];
    name += kDigits[byte & 15U];
  }
  return name;
}

std::string owner_of_replies(const std::string& partition) {
  const auto end = partition.rfind('/');
  return end != std::string::npos ? partition.substr(0, end) : std::string();
}

void Peers::met(const PeerId& peer, const Announcement& said) {
  const Lock lock(mutex_);
  last_met_ = Clock::now();
  if (said.compatible()) {
    incompatible_.erase(peer);
    if (!said.partition.empty()) follow(peer);
    return;
  }
  IncompatiblePeer stranger{said.partition, said.protocol, said.program,
                            std::chrono::system_clock::now()};
  // Anybody can announce any number of them.
  if (logged_.size() < kMostLogged && logged_.insert(stranger.text()).second) {
    log().error("{}: no messages are exchanged with it", stranger.text());
  }
  incompatible_.insert_or_assign(peer, std::move(stranger));
  any_incompatible_ = true;
}

Peers::Server& Peers::follow(const PeerId& peer) {
  life_signs_->follow(peer);
  return servers_[peer];
}

void Peers::hear(Server& server, Clock::time_point at) {
  server.heard.last = at;
  if (std::exchange(server.silent, false) && server.presence) tell(server);
}

bool Peers::is_rival(const Server& server) const {
  return !own_.empty() && server.presence && server.presence->partition == own_ &&
         server.presence->serving;
}

void Peers::tell(Server& server) {
  if (!is_rival(server) || server.proven) {
    server.doubted_since.reset();
    note_doubts();
    return there_(*server.presence);
  }
  if (!server.doubted_since) server.doubted_since = server.heard.last;
  note_doubts();
}

void Peers::note_doubts() {
  any_doubted_ = std::any_of(servers_.begin(), servers_.end(),
                             [](const auto& one) { return one.second.doubted_since.has_value(); });
}

bool Peers::ask_rival(Server& server, Clock::time_point now) {
  if (!server.doubted_since) return false;
  server.asked_for_proof = true;
  if (now - *server.doubted_since < kProofWithin) return true;
  server.doubted_since.reset();
  gone_(*server.presence, {});
  return false;
}

bool Peers::may_be_replaced() const {
  if (!any_doubted_) return false;
  const Lock lock(mutex_);
  const auto now = Clock::now();
  const bool is_held_up = now - last_look_ > patience_.look_every + kReplaceable;
  return is_held_up || (held_up_ && now - *held_up_ < 2 * kProofWithin);
}

bool Peers::was_held_up(Clock::time_point now) const {
  const Lock lock(mutex_);
  return now - last_look_ > patience_.look_every + kLate || (went_on_ && now - *went_on_ < kTaken);
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
  life_signs_->forget(known->first);
  Server& server = known->second;
  if (server.said() != nullptr && !std::exchange(server.silent, true)) lose(server, {});
  servers_.erase(known);
  note_doubts();
  any_silent_ = std::any_of(servers_.begin(), servers_.end(),
                            [](const auto& one) { return one.second.silent; });
}

void Peers::sent_page(const ertps::GuidPrefix_t& prefix, const Page& page) {
  const Lock lock(mutex_);
  const auto known = servers_.find(peer_of(prefix));
  if (known == servers_.end()) return;
  Server& server = known->second;
  if (!server.presence || server.presence->incarnation < page.incarnation) {
    server.by_page.emplace();
    server.by_page->partition = page.partition;
    server.by_page->incarnation = page.incarnation;
  }
  server.served = true;
  hear(server, Clock::now());
}

void Peers::present(const ertps::GuidPrefix_t& prefix, const Presence& presence,
                    std::size_t peers) {
  const Lock lock(mutex_);
  Server& server = follow(peer_of(prefix));
  server.peers = peers;
  server.heard.last = Clock::now();
  server.heard.present = true;
  server.served = server.served || presence.serving;
  if (!std::exchange(server.silent, false) && server.presence == presence) return;
  server.presence = presence;
  overtake(presence);
  tell(server);
}

void Peers::replied(const ertps::GuidPrefix_t& prefix) {
  const Lock lock(mutex_);
  const auto known = servers_.find(peer_of(prefix));
  if (known == servers_.end()) return;
  Server& server = known->second;
  server.heard.replied = true;
  hear(server, Clock::now());
  if (server.proven || !server.asked_for_proof || !is_rival(server)) return;
  server.proven = true;
  tell(server);
}

std::vector<std::string> Peers::look_for_silent(Clock::time_point now, Clock::duration planned,
                                                const std::set<std::string>& needed) {
  std::vector<std::string> unheard;
  const Lock lock(mutex_);
  const auto late =
      std::max(now - std::exchange(last_look_, now) - planned, Clock::duration::zero());
  if (late >= kReplaceable) held_up_ = now;
  if (late >= kLate) went_on_ = now;
  bool ask_rivals = false;
  for (auto& [id, server] : servers_) {
    server.heard.pass_over(late);
    ask_rivals = ask_rival(server, now) || ask_rivals;
    if (const auto sign = life_signs_->last(id); sign && *sign > server.heard.last) {
      hear(server, *sign);
    }
    const Presence* said = server.said();
    if (said == nullptr) continue;
    server.heard.need(needed.count(said->partition) != 0, now);
    if (server.silent) continue;
    const Silence silence = judge(server.heard, patience_, now);
    if (silence.kind == Silence::Kind::kAsk) {
      server.heard.asked = now;
      unheard.push_back(said->partition);
    }
    if (silence.kind != Silence::Kind::kLost) continue;
    server.silent = any_silent_ = true;
    server.doubted_since.reset();
    lose(server, silence.early);
  }
  note_doubts();
  if (ask_rivals) unheard.push_back(own_);
  return unheard;
}

bool Peers::discovered(std::size_t excluded) const {
  const Lock lock(mutex_);
  if (servers_.empty() || !all_present() || is_about_to_be_served()) return false;
  const auto [most, least] = unknown_here();
  // Others may have met those that are excluded here, before their keys expired.
  if (most > static_cast<long>(excluded)) return false;
  return Clock::now() - last_met_ >= (most == 0 && least == 0 ? kAgreedQuiet : kQuiet);
}

bool Peers::is_heard(const std::string& partition) const {
  return std::any_of(servers_.begin(), servers_.end(), [&](const auto& known) {
    const Server& server = known.second;
    return server.presence && !server.silent && server.presence->partition == partition;
  });
}

// Nobody misses who only claimed a name, or a rival here.
void Peers::lose(const Server& server, Clock::duration early) {
  const Presence& said = *server.said();
  const bool is_missed = server.served && said.partition != own_ && !is_heard(said.partition);
  if (is_missed && untold_.size() < kMostUntold) untold_[said.partition] = Clock::now();
  gone_(said, early);
}

std::uint32_t Peers::count(const std::set<std::string_view>& missed) {
  const Lock lock(mutex_);
  const auto now = Clock::now();
  for (auto one = untold_.begin(); one != untold_.end();) {
    const auto& [partition, since] = *one;
    const bool is_told =
        missed.count(partition) != 0 || is_heard(partition) || now - since > kToldWithin;
    one = is_told ? untold_.erase(one) : std::next(one);
  }
  const auto heard = std::count_if(servers_.begin(), servers_.end(), [](const auto& server) {
    return server.second.presence && !server.second.silent;
  });
  return static_cast<std::uint32_t>(heard) + static_cast<std::uint32_t>(untold_.size());
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

bool Peers::heard_lately(const std::string& partition) const {
  const Lock lock(mutex_);
  const auto earliest = Clock::now() - patience_.needed;
  for (const auto& [id, server] : servers_) {
    if (!server.presence || server.presence->partition != partition) continue;
    const auto sign = life_signs_->last(id).value_or(server.heard.last);
    if (std::max(sign, server.heard.last) > earliest) return true;
  }
  return false;
}

bool Peers::silent(const PeerId& peer) const {
  const Lock lock(mutex_);
  const auto known = servers_.find(peer);
  return known != servers_.end() && known->second.silent;
}

bool Peers::replaced(const PeerId& peer) const {
  const Lock lock(mutex_);
  const auto known = servers_.find(peer);
  return known != servers_.end() && known->second.silent && known->second.overtaken;
}

void Peers::overtake(const Presence& later) {
  if (!later.serving) return;
  for (auto& [id, server] : servers_) {
    const Presence* said = server.said();
    if (said == nullptr || said->partition != later.partition ||
        said->incarnation >= later.incarnation) {
      continue;
    }
    server.overtaken = true;
  }
}

bool Peers::awaits_presence() const {
  const Lock lock(mutex_);
  return !all_present();
}

std::pair<long, long> Peers::unknown_here() const {
  const auto others = static_cast<long>(servers_.size()) - 1 + (is_server_ ? 1 : 0);
  long most = 0;
  long least = 0;
  for (const auto& [id, server] : servers_) {
    if (server.silent) continue;
    // An owner announces its number as it begins to claim its partition, before it hears others.
    if (!server.presence->serving) least = -1;
    const long more = static_cast<long>(server.peers) - others;
    most = std::max(most, more);
    least = std::min(least, more);
  }
  return {most, least};
}

bool Peers::is_about_to_be_served() const {
  const auto any = [&](bool serving) {
    return std::any_of(servers_.begin(), servers_.end(), [&](const auto& known) {
      return !known.second.silent && known.second.presence->serving == serving;
    });
  };
  return !is_server_ && any(false) && !any(true);
}

bool Peers::all_present() const {
  return std::all_of(servers_.begin(), servers_.end(), [](const auto& known) {
    return known.second.presence || known.second.silent;
  });
}

}  // namespace tfdude::fastdds
