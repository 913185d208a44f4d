#pragma once

#include <cstdint>
#include <deque>
#include <list>
#include <map>
#include <optional>
#include <utility>

#include "tfdude/base/time.hpp"

#include "partition/messages.hpp"

namespace tfdude {

/// The replies to requests that change something, so that a repeated request is answered again but never applied again.
///
/// A peer says with each request from which number on it awaits replies (Request::awaits_from): so replies are kept for as
/// long as their request may be repeated, however many others of the same peer were answered meanwhile. Of each peer a mark
/// remains, the number below which its requests are over. Bounded: where more than kReplies are awaited, or more than kPeers
/// have asked, requests are refused that might have been applied before. Not thread-safe.
class ReplyCache {
 public:
  /// The last replies that are kept, of all peers.
  static constexpr std::size_t kReplies = 65536;
  /// The most peers of which a mark is kept;
  static constexpr std::size_t kPeers = 65536;
  /// of them one makes room for another only when it has been silent for so long: longer than any call lasts.
  static constexpr std::chrono::minutes kSilence{10};

  /// The reply given before; kTimeout where it is not known (any more) whether the request was applied; nothing where the
  /// request is new, and to be applied: then its reply is to be put().
  [[nodiscard]] std::optional<Reply> find(const PeerId& peer, const Request& request, Time now);
  void put(const PeerId& peer, const Request& request, const Reply& reply);

 private:
  // Request::sequence, counted on where that begins anew.
  using Number = std::uint64_t;
  struct Peer {
    PeerId id{};
    Number over_below = 0;
    Time heard{};
    std::map<Number, Reply> replies;
  };
  using Peers = std::list<Peer>;  // the last to ask first

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
