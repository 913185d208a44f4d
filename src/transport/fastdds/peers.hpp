#pragma once

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "base/mutex.hpp"
#include "partition/messages.hpp"
#include "transport/fastdds/announcement.hpp"
#include "transport/fastdds/compat.hpp"
#include "transport/fastdds/life_signs.hpp"
#include "transport/port.hpp"
#include "transport/silence.hpp"

namespace tfdude::fastdds {

/// The participant's part of a DDS identity: unique in the domain, new at every start.
[[nodiscard]] PeerId peer_of(const ertps::GuidPrefix_t& prefix);

/// The DDS partition of the replies of an owner to a peer. The peer reads those of all: owner "*".
[[nodiscard]] std::string reply_partition(const std::string& owner, const PeerId& peer);

/// The owner of such a partition; empty if it is none.
[[nodiscard]] std::string owner_of_replies(const std::string& partition);

/// The participants that were discovered, what each announced that it serves, and which are silent.
/// Thread-safe. The callbacks run under a lock, so that those about one peer come in order. So no
/// function here may be called with a lock that the callbacks take (LockRank::kReporting).
///
/// Any message shows that its sender lives (LifeSigns). DDS announces each participant
/// periodically, so nothing else is sent while nobody depends on a server. Who depends on one is
/// patient for a shorter time, and asks for a sign of life well before that time is over.
///
/// Another server of this participant's own partition is reported once it has answered a request:
/// what a single message says must not end an owner. One that does not answer in time is reported
/// as gone, so that this participant goes on with a higher number than it.
///
/// Leases of Fast DDS 2.9 are not used for this: a short lease of a participant ends the match only
/// on the side that was starved, and the outdated acknowledgement count of the other side prevents
/// its renewal; and liveliness of a topic is renewed by any participant (issue 4373 of Fast DDS).
class Peers {
 public:
  using Clock = LifeSigns::Clock;
  using Tell = std::function<void(const Presence&)>;
  using TellGone = std::function<void(const Presence&, std::chrono::nanoseconds early)>;

  /// If nobody new was discovered for this long, usually all have answered a new participant.
  static constexpr std::chrono::milliseconds kQuiet{200};
  /// The same if all servers hear exactly those that were discovered here.
  static constexpr std::chrono::milliseconds kAgreedQuiet{40};

  /// A loss is announced within this time, or will not be.
  static constexpr std::chrono::seconds kToldWithin{1};
  /// A rival answers within this time, or is not believed.
  static constexpr std::chrono::seconds kProofWithin{1};
  /// For another process to take the partition, this one must have been silent for longer
  /// (Claiming).
  static constexpr std::chrono::milliseconds kReplaceable{300};
  /// If this participant looks so late, others may count it as lost.
  static constexpr std::chrono::milliseconds kLate{200};
  /// After that, what has come meanwhile has been taken within this time.
  static constexpr std::chrono::milliseconds kTaken{100};

  /// @param there  a peer announced what it serves, or is heard again
  /// @param gone   a peer that had announced this, or sent a page, has left or is silent; if it
  ///               sent only pages, the presence contains what these say of it. `early`: by how
  ///               much later those may notice it that do not need it
  Peers(std::shared_ptr<LifeSigns> life_signs, Tell there, TellGone gone)
      : life_signs_(std::move(life_signs)), there_(std::move(there)), gone_(std::move(gone)) {}

  /// Call before anybody is discovered.
  /// @param is_server  the others count this participant, too
  void configure(const Patience& patience, bool is_server) {
    patience_ = patience;
    patience_.others = std::max(patience.others, patience.needed);
    patience_.first = std::max(patience.first, patience_.others);
    is_server_ = is_server;
  }

  /// From now on this participant serves a partition.
  void serve(const std::string& partition) {
    const Lock lock(mutex_);
    own_ = partition;
  }

  /// A participant that speaks another major version is logged once and otherwise ignored.
  void met(const PeerId& peer, const Announcement& said);
  void left(const ertps::GuidPrefix_t& prefix);
  /// @param peers  number of other servers that the sender hears
  void present(const ertps::GuidPrefix_t& prefix, const Presence& presence, std::size_t peers);
  /// A server sent a page, which may arrive before its presence.
  void sent_page(const ertps::GuidPrefix_t& prefix, const Page& page);
  /// A server has replied: from now on replies reach this participant. A rival that was asked is
  /// believed.
  void replied(const ertps::GuidPrefix_t& prefix);

  /// Reports the peers that became silent since the last call, and those that are heard again.
  /// @param planned  when this call should have come, after the last one. If it comes later, this
  ///   process was prevented from receiving, too, so the delay is not counted as silence
  /// @param needed  partitions whose owners this participant depends on, and can ask
  /// @return those of them that must be asked for a sign of life now
  [[nodiscard]] std::vector<std::string> look_for_silent(Clock::time_point now,
                                                         Clock::duration planned,
                                                         const std::set<std::string>& needed);

  /// The servers that were discovered and speak another major version.
  [[nodiscard]] std::vector<IncompatiblePeer> incompatible() const;

  /// Whether messages of this participant cannot be understood. O(1) while there is none such.
  [[nodiscard]] bool is_incompatible(const ertps::GuidPrefix_t& prefix) const;

  /// How many servers are heard, or are gone without being announced as missed yet: whoever starts
  /// now would otherwise take what the others have for all there is.
  /// @param missed  the partitions that this participant announces as missed
  [[nodiscard]] std::uint32_t count(const std::set<std::string_view>& missed);

  /// Whether the server of this partition is silent.
  [[nodiscard]] bool silent(const std::string& partition) const;

  /// As Transport::heard_lately().
  [[nodiscard]] bool heard_lately(const std::string& partition) const;

  /// Whether a server is silent.
  [[nodiscard]] bool silent(const PeerId& peer) const;
  /// False while no server is silent. O(1).
  [[nodiscard]] bool any_silent() const { return any_silent_.load(std::memory_order_relaxed); }

  /// Whether a server is silent, and a later process serves its partition, or has.
  [[nodiscard]] bool replaced(const PeerId& peer) const;

  /// Whether another process may serve this participant's partition since this one could not run:
  /// then no change may be accepted until that is decided. O(1) while nobody says so.
  [[nodiscard]] bool may_be_replaced() const;

  /// Whether this process could not run for so long that those who have asked it meanwhile may have
  /// given up. Whoever has not asks again.
  [[nodiscard]] bool was_held_up(Clock::time_point now) const;

  /// Whether some server was discovered, nobody new for kQuiet or kAgreedQuiet, all servers have
  /// announced what they serve, and none hears more others than this participant knows. For one
  /// that serves nothing, some server must do more than claim a partition.
  /// @param excluded  how many servers keys exclude here, though others may hear them
  [[nodiscard]] bool discovered(std::size_t excluded = 0) const;

  /// Whether some server was discovered that has not announced yet what it serves. A server that
  /// has sent a page and then become silent is not waited for.
  [[nodiscard]] bool awaits_presence() const;

 private:
  struct Server {
    std::optional<Presence> presence;
    std::optional<Presence> by_page;  // from its pages, until a presence as new arrives
    std::size_t peers = 0;
    Hearing heard{Clock::now()};
    bool silent = false;
    bool served = false;     // it did more than claim its name
    bool overtaken = false;  // a later process has served its partition
    // It says that it serves the own partition, and has not shown it.
    std::optional<Clock::time_point> doubted_since;
    bool asked_for_proof = false;
    bool proven = false;

    [[nodiscard]] const Presence* said() const {
      const bool later = by_page && presence && by_page->incarnation > presence->incarnation;
      if (presence && !later) return &*presence;
      return by_page ? &*by_page : nullptr;
    }
  };

  Server& follow(const PeerId& peer) TFDUDE_REQUIRES(mutex_);
  /// Notes which earlier processes of its partition a server takes the place of.
  void overtake(const Presence& later) TFDUDE_REQUIRES(mutex_);
  void hear(Server& server, Clock::time_point at) TFDUDE_REQUIRES(mutex_);
  /// Reports its presence, unless that has to be shown.
  void tell(Server& server) TFDUDE_REQUIRES(mutex_);
  [[nodiscard]] bool is_rival(const Server& server) const TFDUDE_REQUIRES(mutex_);
  /// Reports a rival that did not answer in time as gone. @return whether one must be asked
  bool ask_rival(Server& server, Clock::time_point now) TFDUDE_REQUIRES(mutex_);
  void note_doubts() TFDUDE_REQUIRES(mutex_);
  /// Reports that a server has left or is silent. Call when it is no longer heard.
  void lose(const Server& server, Clock::duration early) TFDUDE_REQUIRES(mutex_);
  [[nodiscard]] bool is_heard(const std::string& partition) const TFDUDE_REQUIRES(mutex_);
  [[nodiscard]] bool all_present() const TFDUDE_REQUIRES(mutex_);
  /// Whether all that this client hears is who only claims a partition yet.
  [[nodiscard]] bool is_about_to_be_served() const TFDUDE_REQUIRES(mutex_);
  /// The largest number of servers that one of them hears beyond those known here, and the
  /// smallest: negative if it hears fewer.
  [[nodiscard]] std::pair<long, long> unknown_here() const TFDUDE_REQUIRES(mutex_);

  const std::shared_ptr<LifeSigns> life_signs_;
  const Tell there_;
  const TellGone gone_;
  mutable Mutex mutex_{LockRank::kReporting};  // also while reporting, to keep the order
  std::map<PeerId, Server> servers_ TFDUDE_GUARDED_BY(mutex_);
  std::map<PeerId, IncompatiblePeer> incompatible_ TFDUDE_GUARDED_BY(mutex_);
  std::set<std::string> logged_ TFDUDE_GUARDED_BY(mutex_);  // of these
  // Partitions whose loss was reported, and when: they count until they are announced as missed.
  std::map<std::string, Clock::time_point, std::less<>> untold_ TFDUDE_GUARDED_BY(mutex_);
  std::atomic<bool> any_incompatible_{false};
  std::atomic<bool> any_silent_{false};  // or was, and is heard again
  Clock::time_point last_met_ TFDUDE_GUARDED_BY(mutex_){};
  Clock::time_point last_look_ TFDUDE_GUARDED_BY(mutex_) = Clock::now();
  std::string own_ TFDUDE_GUARDED_BY(mutex_);  // the partition served here; empty: none yet
  std::atomic<bool> any_doubted_{false};
  std::optional<Clock::time_point> held_up_ TFDUDE_GUARDED_BY(mutex_);  // for kReplaceable
  std::optional<Clock::time_point> went_on_ TFDUDE_GUARDED_BY(mutex_);  // after kLate
  // Set once, before anybody is discovered.
  Patience patience_{};
  bool is_server_ = false;
};

}  // namespace tfdude::fastdds
