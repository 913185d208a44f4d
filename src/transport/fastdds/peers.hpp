#pragma once

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "base/mutex.hpp"
#include "partition/messages.hpp"
#include "transport/fastdds/announcement.hpp"
#include "transport/fastdds/compat.hpp"
#include "transport/port.hpp"

namespace tfdude::fastdds {

/// The participant's part of a DDS identity: unique in the domain, new at every start.
[[nodiscard]] PeerId peer_of(const ertps::GuidPrefix_t& prefix);

/// The DDS partition in which a peer reads its replies.
[[nodiscard]] std::string reply_partition(const PeerId& peer);

/// The participants that were discovered, what each announced that it serves, and which are silent.
/// Thread-safe. The callbacks run under a lock, so that those about one peer come in order. So no
/// function here may be called with a lock that the callbacks take (LockRank::kReporting).
///
/// Each server announces reliably what it serves when that changes. It also repeats this
/// periodically as a beat, which may be lost. Readers of beats have their own sockets, which no
/// other traffic fills. Beats are not reliable because in a reliable stream a lost DDS sample also
/// delays those after it. Leases of Fast DDS 2.9 are not used for this: a short lease of a
/// participant ends the match only on the side that was starved, and the outdated acknowledgement
/// count of the other side prevents its renewal; and liveliness of a topic is renewed by any
/// participant (issue 4373 of Fast DDS).
class Peers {
 public:
  using Clock = std::chrono::steady_clock;
  using Tell = std::function<void(const Presence&)>;

  /// If nobody new was discovered for this long, usually all have answered a new participant.
  static constexpr std::chrono::milliseconds kQuiet{200};

  /// The period of a server's beats. Seven must be lost before it counts as lost after the usual
  /// 450 ms.
  static constexpr std::chrono::milliseconds kSpeakEvery{60};

  /// @param there  a peer announced what it serves, or is heard again
  /// @param gone   a peer that had announced this, or sent a page, has left or is silent; if it
  ///               sent only pages, the presence contains what these say of it
  Peers(Tell there, Tell gone) : there_(std::move(there)), gone_(std::move(gone)) {}

  /// Call before anybody is discovered.
  /// @param silence     a peer that was not heard for this long counts as lost
  /// @param first_beat  how long a peer's first beat may take: DDS may still be matching its
  ///                    endpoints when the presence has already arrived
  /// @param is_server   the others count this participant, too
  void configure(std::chrono::nanoseconds silence, std::chrono::nanoseconds first_beat,
                 bool is_server) {
    silence_ = silence;
    first_beat_ = std::max(silence, first_beat);
    is_server_ = is_server;
  }

  /// A participant that speaks another major version is logged once and otherwise ignored.
  void met(const ertps::GuidPrefix_t& prefix, const Announcement& said);
  void left(const ertps::GuidPrefix_t& prefix);
  /// @param peers  number of other servers that the sender hears
  /// @param beat   whether this is repeated periodically
  void present(const ertps::GuidPrefix_t& prefix, const Presence& presence, std::size_t peers,
               bool beat);
  /// A server sent a page, which may arrive before its presence.
  void sent_page(const ertps::GuidPrefix_t& prefix, const Page& page);
  /// A server sent another message: it is alive, even if its presence is late.
  void heard(const ertps::GuidPrefix_t& prefix);

  /// Reports the peers that became silent since the last call. A late call means that this process
  /// was prevented from receiving, too, so that delay is not counted as silence of the others.
  void look_for_silent(Clock::time_point now);

  /// The servers that were discovered and speak another major version.
  [[nodiscard]] std::vector<IncompatiblePeer> incompatible() const;

  /// Whether messages of this participant cannot be understood. O(1) while there is none such.
  [[nodiscard]] bool is_incompatible(const ertps::GuidPrefix_t& prefix) const;

  /// How many servers are heard.
  [[nodiscard]] std::uint32_t heard_count() const;

  /// Whether the server of this partition is silent.
  [[nodiscard]] bool silent(const std::string& partition) const;

  /// Whether some server was discovered, nobody new for kQuiet, all servers have announced what
  /// they serve, and none hears more others than this participant knows.
  [[nodiscard]] bool discovered() const;

  /// Whether some server was discovered that has not announced yet what it serves. A server that
  /// has sent a page, and then nothing for as long as a first beat may take, is not waited for.
  [[nodiscard]] bool awaits_presence() const;

 private:
  [[nodiscard]] bool all_present() const TFDUDE_REQUIRES(mutex_);
  [[nodiscard]] bool nobody_hears_more() const TFDUDE_REQUIRES(mutex_);

  struct Server {
    std::optional<Presence> presence;
    std::optional<Presence> by_page;  // from its pages, until a presence as new arrives
    std::size_t peers = 0;
    Clock::time_point last_heard;
    bool beats = false;
    bool silent = false;

    [[nodiscard]] const Presence* said() const {
      const bool later = by_page && presence && by_page->incarnation > presence->incarnation;
      if (presence && !later) return &*presence;
      return by_page ? &*by_page : nullptr;
    }
  };

  /// How long this one may be silent.
  [[nodiscard]] std::chrono::nanoseconds patience(const Server& server) const {
    return server.beats ? silence_ : first_beat_;
  }

  const Tell there_;
  const Tell gone_;
  mutable Mutex mutex_{LockRank::kReporting};  // also while reporting, to keep the order
  std::map<PeerId, Server> servers_ TFDUDE_GUARDED_BY(mutex_);
  std::map<PeerId, IncompatiblePeer> incompatible_ TFDUDE_GUARDED_BY(mutex_);
  std::set<std::string> logged_ TFDUDE_GUARDED_BY(mutex_);  // of these
  std::atomic<bool> any_incompatible_{false};
  Clock::time_point last_met_ TFDUDE_GUARDED_BY(mutex_){};
  Clock::time_point last_look_ TFDUDE_GUARDED_BY(mutex_) = Clock::now();
  // Set once, before anybody is discovered.
  std::chrono::nanoseconds silence_{};
  std::chrono::nanoseconds first_beat_{};
  bool is_server_ = false;
};

}  // namespace tfdude::fastdds
