#include "partition/reply_cache.hpp"

namespace tfdude {
namespace {

Reply refused(std::uint32_t sequence, const std::string& why) {
  return {sequence, 0,
          Error{Errc::kTimeout, "request " + std::to_string(sequence) + " was rejected: " + why}};
}

}  // namespace

void ReplyCache::end_below(Peer& peer, Number number) {
  if (number <= peer.over_below) return;
  peer.over_below = number;
  peer.replies.erase(peer.replies.begin(), peer.replies.lower_bound(number));
}

// Null if there is no room for another peer.
ReplyCache::Peer* ReplyCache::touch(const PeerId& peer, Time now) {
  if (const auto known = index_.find(peer); known != index_.end()) {
    peers_.splice(peers_.begin(), peers_, known->second);
  } else {
    if (peers_.size() >= kPeers) {
      const Peer& last = peers_.back();
      // If the clock was set back, the time is unknown.
      if (last.heard <= now && now - last.heard < kSilence) return nullptr;
      index_.erase(last.id);
      peers_.pop_back();
    }
    peers_.emplace_front();
    peers_.front().id = peer;
    index_.emplace(peer, peers_.begin());
  }
  peers_.front().heard = now;
  return &peers_.front();
}

std::optional<Reply> ReplyCache::find(const PeerId& from, const Request& request, Time now) {
  Peer* peer = touch(from, now);
  if (peer == nullptr) {
    return refused(request.sequence,
                   "more than " + std::to_string(kPeers) + " clients have sent changes recently");
  }
  end_below(*peer, request.awaits_from);
  const Number number = number_of(request);
  if (number < peer->over_below) {
    return refused(request.sequence,
                   "it may have been applied already; requests of this client below " +
                       std::to_string(peer->over_below) + " are closed");
  }
  const auto before = peer->replies.find(number);
  if (before == peer->replies.end()) return std::nullopt;
  return before->second;
}

std::size_t ReplyCache::size() const {
  std::size_t all = 0;
  for (const Peer& peer : peers_) all += peer.replies.size();
  return all;
}

void ReplyCache::put(const PeerId& from, const Request& request, const Reply& reply) {
  const Number number = number_of(request);
  const auto known = index_.find(from);
  if (known == index_.end()) return;
  known->second->replies.insert_or_assign(number, reply);
  order_.emplace_back(from, number);
  if (order_.size() <= kReplies) return;
  const auto& [peer, oldest] = order_.front();
  if (const auto its = index_.find(peer); its != index_.end()) end_below(*its->second, oldest + 1);
  order_.pop_front();
}

}  // namespace tfdude
