#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <list>
#include <map>
#include <optional>
#include <utility>

#include "tfdude/base/time.hpp"

#include "partition/messages.hpp"

namespace tfdude {

/// The replies to requests that change something, so that a repeated request gets its reply again
/// but is never applied again.
///
/// With each request a peer gives the number from which on it awaits replies
/// (Request::awaits_from). So replies are kept as long as their request may be repeated, however
/// many others of the same peer were answered meanwhile. For each peer a mark is kept: the number
/// below which its requests are over. Bounded: if more than kReplies are awaited, or more than
/// kPeers have sent requests, requests that might have been applied before are rejected. Not
/// thread-safe.
class ReplyCache {
 public:
  /// Maximum number of stored replies, of all peers; the newest are kept.
  static constexpr std::size_t kReplies = 65536;
  /// Maximum number of peers with a mark.
  static constexpr std::size_t kPeers = 65536;
  /// A peer's mark is replaced only after this silence, which is longer than any call lasts.
  static constexpr std::chrono::minutes kSilence{10};

  /// The reply given before; kTimeout if it is not known (any more) whether the request was
  /// applied; empty if the request is new and must be applied: then put() its reply.
  [[nodiscard]] std::optional<Reply> find(const PeerId& from, const Request& request, Time now);
  void put(const PeerId& from, const Request& request, const Reply& reply);
  /// The number of stored replies. O(peers).
  [[nodiscard]] std::size_t size() const;

 private:
  // Request::sequence, extended beyond its overflow.
  using Number = std::uint64_t;
  struct Peer {
    PeerId id{};
    Number over_below = 0;
    Time heard{};
    std::map<Number, Reply> replies;
  };
  using Peers = std::list<Peer>;  // most recent requester first

  static Number number_of(const Request& request) {
    return request.awaits_from +
           (request.sequence - static_cast<std::uint32_t>(request.awaits_from));
  }
  static void end_below(Peer& peer, Number number);
  [[nodiscard]] Peer* touch(const PeerId& peer, Time now);

  Peers peers_;
  std::map<PeerId, Peers::iterator> index_;
  std::deque<std::pair<PeerId, Number>> order_;  // of the last kReplies replies
};

}  // namespace tfdude
