#pragma once

#include <atomic>
#include <chrono>
#include <cstddef>
#include <vector>

#include "base/mutex.hpp"
#include "partition/messages.hpp"

namespace tfdude::fastdds {

/// Participants of which a datagram said that they leave, without a proof: with keys, too, anybody
/// may say so (DDS Security 1.1, 8.4.2.4). It is believed of those that are then silent for
/// kSilence; each participant announces itself every 300 ms.
/// @par Thread safety  All functions are thread-safe.
class Departures {
 public:
  using Clock = std::chrono::steady_clock;

  static constexpr std::chrono::milliseconds kSilence{1000};
  /// What was sent before may come later.
  static constexpr std::chrono::milliseconds kOvertaken{50};
  /// The first ones count; the others are noticed when their lease ends.
  static constexpr std::size_t kMost = 256;

  void said(const PeerId& peer, Clock::time_point now);

  /// A datagram of a participant. An atomic load if none is said to leave.
  void heard(const PeerId& peer, Clock::time_point now) {
    if (any_.load(std::memory_order_relaxed)) stays(peer, now);
  }

  /// Calls leave(peer) for each that has left. An atomic load if none is said to leave.
  template <class Leave>
  void take(Clock::time_point now, const Leave& leave) {
    if (!any_.load(std::memory_order_relaxed)) return;
    for (const PeerId& peer : take_silent(now)) leave(peer);
  }

 private:
  struct Leaving {
    PeerId peer;
    Clock::time_point said;
  };

  void stays(const PeerId& peer, Clock::time_point now);
  [[nodiscard]] std::vector<PeerId> take_silent(Clock::time_point now);

  std::atomic<bool> any_{false};
  Mutex mutex_;
  std::vector<Leaving> leaving_ TFDUDE_GUARDED_BY(mutex_);
};

}  // namespace tfdude::fastdds
