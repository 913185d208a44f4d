#pragma once

#include <array>
#include <list>
#include <map>
#include <optional>

#include "tfdude/partition/messages.hpp"

namespace tfdude {

/// The replies to requests that change something, so that a repeated request is answered again but not
/// applied again. Bounded: the last kPerPeer of each of the last kPeers that asked. Not thread-safe.
class ReplyCache {
 public:
  static constexpr std::size_t kPerPeer = 256;
  static constexpr std::size_t kPeers = 256;

  /// The reply given before; an error where it is too old to be known; nothing where the request is new.
  [[nodiscard]] std::optional<Reply> find(const PeerId& peer, std::uint32_t sequence);

  void put(const PeerId& peer, const Reply& reply);

 private:
  struct Peer {
    PeerId id{};
    std::array<std::optional<Reply>, kPerPeer> replies;  // by sequence modulo kPerPeer
  };
  using Peers = std::list<Peer>;  // the last to ask first

  Peer& touch(const PeerId& peer);

  Peers peers_;
  std::map<PeerId, Peers::iterator> index_;
};

}  // namespace tfdude
