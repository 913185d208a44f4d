#pragma once

#include <atomic>
#include <chrono>
#include <cstddef>
#include <unordered_map>
#include <vector>

#include "base/mutex.hpp"
#include "partition/messages.hpp"

namespace tfdude::fastdds {

/// Bounds how many participants Fast DDS has to look after: to each of them it announces itself and
/// its endpoints, for as long as the lease that the other one has chosen. If there are kMost, one
/// that has not announced itself for kPatience makes room for a new one; if there is none, the new
/// one has to wait. Announcements are periodic, and those that are made up are mostly not.
///
/// With keys, Fast DDS sends handshakes to each of them, again and again, and whoever is real is
/// verified soon. So only kMostUnverified are not verified at a time, and one that was not within
/// kVerifiedWithin makes room, even if it goes on announcing itself. And one that is silent for
/// kSilence leaves, whether there is room or not, before its lease ends: Fast DDS 2.9 stands still
/// for good if its thread for timers removes one just when another thread does so, as each waits
/// for the other (SecurityManager::remove_participant).
/// @par Thread safety  All functions are thread-safe.
class Crowd {
 public:
  using Clock = std::chrono::steady_clock;

  static constexpr std::size_t kMost = 512;
  static constexpr std::chrono::seconds kPatience{10};
  static constexpr std::size_t kMostUnverified = 48;
  static constexpr std::chrono::seconds kVerifiedWithin{3};
  /// DDS keeps a silent participant for 30 s.
  static constexpr std::chrono::seconds kSilence{20};

  /// @param verifies  the participant has keys
  explicit Crowd(bool verifies = false) : verifies_(verifies) {}

  /// @return whether Fast DDS may have the announcement
  /// @par Complexity  O(1); O(kMost) if there are so many
  [[nodiscard]] bool admit(const PeerId& peer, Clock::time_point now);

  /// Its identity was verified.
  void verified(const PeerId& peer);

  /// Fast DDS has removed it.
  void left(const PeerId& peer);

  /// Calls leave(peer) for each one that has made room.
  template <class Leave>
  void take(const Leave& leave) {
    if (!any_.load(std::memory_order_relaxed)) return;
    for (const PeerId& peer : take_all()) leave(peer);
  }

 private:
  struct Hash {
    std::size_t operator()(const PeerId& peer) const;
  };

  struct Present {
    Clock::time_point since;
    Clock::time_point heard;
    bool verified = false;
  };

  [[nodiscard]] std::vector<PeerId> take_all();
  [[nodiscard]] bool has_room() const TFDUDE_REQUIRES(mutex_) {
    return announced_.size() < kMost && (!verifies_ || unverified_ < kMostUnverified);
  }
  void make_room(Clock::time_point now) TFDUDE_REQUIRES(mutex_);
  void drop_silent(Clock::time_point now) TFDUDE_REQUIRES(mutex_);
  template <class Leaves>
  void drop(const Leaves& leaves) TFDUDE_REQUIRES(mutex_);
  using All = std::unordered_map<PeerId, Present, Hash>;
  All::iterator erase(All::iterator one) TFDUDE_REQUIRES(mutex_);

  const bool verifies_;
  std::atomic<bool> any_{false};
  Mutex mutex_;
  All announced_ TFDUDE_GUARDED_BY(mutex_);
  std::size_t unverified_ TFDUDE_GUARDED_BY(mutex_) = 0;
  Clock::time_point looked_ TFDUDE_GUARDED_BY(mutex_){};    // for room
  Clock::time_point listened_ TFDUDE_GUARDED_BY(mutex_){};  // for those that are silent
  std::vector<PeerId> leave_ TFDUDE_GUARDED_BY(mutex_);
};

}  // namespace tfdude::fastdds
