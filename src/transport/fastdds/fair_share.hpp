#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <map>

#include "base/mutex.hpp"
#include "partition/messages.hpp"

namespace tfdude::fastdds {

/// Keeps one sender from delaying the messages of all others. Fast DDS handles what arrives at a
/// socket one after the other, on one thread, so a sender that floods it fills the socket's queue.
/// When that thread has not been idle for a while, messages of senders that took more than their
/// share of its time are dropped unread, which costs a fraction of answering them.
///
/// The time that a sender took is forgotten exponentially. Time comes from outside.
/// @par Thread safety  begin(), end() and admits() are for the thread that handles a datagram; all
///   other functions are thread-safe.
class FairShare {
 public:
  using Clock = std::chrono::steady_clock;

  /// A thread that continues within this time had messages waiting.
  static constexpr std::chrono::microseconds kGap{15};
  /// Overloaded is who has had messages waiting for this long.
  static constexpr std::chrono::microseconds kOverloadedAfter{500};
  /// Time constant of forgetting.
  static constexpr std::chrono::milliseconds kMemory{50};
  /// The share of all heavy senders together. The rest of the time is needed to drop messages.
  static constexpr double kShare = 0.5;
  /// A sender is active for this time after a message. A lone sender has no limit.
  static constexpr std::chrono::seconds kActive{2};

  /// The calling thread begins or has ended handling a datagram.
  static void begin(Clock::time_point now);
  static void end(Clock::time_point now);

  /// Whether to read a message of this sender; counts it otherwise.
  [[nodiscard]] bool admits(const PeerId& sender, Clock::time_point now);

  /// Reading and answering a message of this sender took so long.
  void spent(const PeerId& sender, Clock::duration time, Clock::time_point now);

  void left(const PeerId& sender);

  [[nodiscard]] std::uint64_t dropped() const { return dropped_.load(std::memory_order_relaxed); }

 private:
  struct Account {
    double seconds = 0;
    Clock::time_point at;

    [[nodiscard]] double now(Clock::time_point now) const;
  };

  Mutex mutex_;
  std::map<PeerId, Account> accounts_ TFDUDE_GUARDED_BY(mutex_);
  std::atomic<std::uint64_t> dropped_{0};
};

}  // namespace tfdude::fastdds
