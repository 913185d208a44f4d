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
/// @par Thread safety  All functions are thread-safe.
class Crowd {
 public:
  using Clock = std::chrono::steady_clock;

  static constexpr std::size_t kMost = 512;
  static constexpr std::chrono::seconds kPatience{10};

  /// @return whether Fast DDS may have the announcement
  /// @par Complexity  O(1); O(kMost) if there are so many
  [[nodiscard]] bool admit(const PeerId& peer, Clock::time_point now);

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

  [[nodiscard]] std::vector<PeerId> take_all();

  std::atomic<bool> any_{false};
  Mutex mutex_;
  std::unordered_map<PeerId, Clock::time_point, Hash> announced_ TFDUDE_GUARDED_BY(mutex_);
  Clock::time_point looked_ TFDUDE_GUARDED_BY(mutex_){};
  std::vector<PeerId> leave_ TFDUDE_GUARDED_BY(mutex_);
};

}  // namespace tfdude::fastdds
