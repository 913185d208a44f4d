#pragma once

#include <atomic>
#include <chrono>
#include <functional>
#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "base/mutex.hpp"
#include "partition/messages.hpp"
#include "transport/fastdds/announcement.hpp"

namespace tfdude::fastdds {

/// Which of the discovered participants count as met: without keys all that have none, with keys
/// those whose identity Fast DDS has verified. The others can exchange nothing with this one, and
/// are kept for error messages.
/// @par Thread safety  All functions are thread-safe.
class Admission {
 public:
  /// @param met  called for each participant that is met, with a lock held
  explicit Admission(std::function<void(const PeerId&, const Announcement&)> met)
      : met_(std::move(met)) {}

  /// Call before anybody is discovered. @param authority  of the own keys; empty: no keys
  void configure(std::string authority) { authority_ = std::move(authority); }

  void discovered(const PeerId& peer, const Announcement& said);
  /// Fast DDS has verified its identity, or could not.
  void authenticated(const PeerId& peer, bool verified);
  void left(const PeerId& peer);

  using Clock = std::chrono::steady_clock;

  /// A handshake takes a twentieth of this, and each of its messages may be lost.
  static constexpr std::chrono::milliseconds kAwaitedFor{2100};

  /// Whether an owner was discovered that has yet to be authenticated, and not longer ago than
  /// kAwaitedFor: anybody can announce one. Takes no lock: it is asked while a message is received,
  /// too.
  [[nodiscard]] bool awaits_authentication(Clock::time_point now = Clock::now()) const {
    return now.time_since_epoch().count() < awaited_until_.load(std::memory_order_relaxed);
  }

  /// The owners that are excluded: a sentence each.
  [[nodiscard]] std::vector<std::string> excluded() const;

 private:
  struct Candidate {
    Announcement said;
    std::string excluded_because;  // empty: it may still be met
    Clock::time_point since = Clock::now();
  };
  [[nodiscard]] std::string reason_against(const Announcement& said) const;
  void note_awaited() TFDUDE_REQUIRES(mutex_);

  const std::function<void(const PeerId&, const Announcement&)> met_;
  std::string authority_;  // set once, before anybody is discovered
  mutable Mutex mutex_{LockRank::kAnnouncing};
  std::map<PeerId, Candidate> candidates_ TFDUDE_GUARDED_BY(mutex_);
  std::set<PeerId> verified_ TFDUDE_GUARDED_BY(mutex_);
  std::atomic<Clock::rep> awaited_until_{0};
};

}  // namespace tfdude::fastdds
