#include "tfdude/partition/reply_cache.hpp"

namespace tfdude {

ReplyCache::Peer& ReplyCache::touch(const PeerId& peer) {
  if (const auto known = index_.find(peer); known != index_.end()) {
    peers_.splice(peers_.begin(), peers_, known->second);
    return peers_.front();
  }
  if (peers_.size() >= kPeers) {
    index_.erase(peers_.back().id);
    peers_.pop_back();
  }
  peers_.emplace_front();
  peers_.front().id = peer;
  index_.emplace(peer, peers_.begin());
  return peers_.front();
}

std::optional<Reply> ReplyCache::find(const PeerId& peer, std::uint32_t sequence) {
  const auto& entry = touch(peer).replies[sequence % kPerPeer];
  if (!entry) return std::nullopt;
  if (entry->sequence == sequence) return entry;
  // The difference as signed number, so that the counter may wrap round.
  if (static_cast<std::int32_t>(sequence - entry->sequence) > 0) return std::nullopt;
  Reply too_old;
  too_old.sequence = sequence;
  too_old.body = Error{Errc::kInvalidInput, "request " + std::to_string(sequence) +
                                                " is too old: the same peer has sent " +
                                                std::to_string(entry->sequence) + " since"};
  return too_old;
}

void ReplyCache::put(const PeerId& peer, const Reply& reply) {
  touch(peer).replies[reply.sequence % kPerPeer] = reply;
}

}  // namespace tfdude
