#pragma once

#include <atomic>
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

  /// Whether an owner was discovered that has yet to be authenticated. Takes no lock: it is asked
  /// while a message is received, too.
  [[nodiscard]] bool awaits_authentication() const { return awaited_; }

  /// The owners that are excluded: a sentence each.
  [[nodiscard]] std::vector<std::string> excluded() const;

 private:
  struct Candidate {
    Announcement said;
    std::string excluded_because;  // empty: it may still be met
  };
  [[nodiscard]] std::string reason_against(const Announcement& said) const;
  void note_awaited() TFDUDE_REQUIRES(mutex_);

  const std::function<void(const PeerId&, const Announcement&)> met_;
  std::string authority_;  // set once, before anybody is discovered
  mutable Mutex mutex_{LockRank::kAnnouncing};
  std::map<PeerId, Candidate> candidates_ TFDUDE_GUARDED_BY(mutex_);
  std::set<PeerId> verified_ TFDUDE_GUARDED_BY(mutex_);
  std::atomic<bool> awaited_{false};
};

}  // namespace tfdude::fastdds
