#pragma once

#include <array>
#include <atomic>
#include <chrono>
#include <cstddef>

#include "base/mutex.hpp"

namespace tfdude::fastdds {

/// The entry of a participant's datagrams. Fast DDS handles each on the thread that received it,
/// including our callbacks and the matching of endpoints. While it matches an endpoint, it reads
/// the endpoint's listener several times. It does so without the lock under which a deletion of the
/// endpoint removes the listener (2.9's EDP.cpp; its issue 3303), and then calls a null pointer. So
/// no datagram is handled while an endpoint is deleted, and none after the participant leaves.
///
/// @par Thread safety  All functions are thread-safe. Without a pause, a datagram costs two atomic
///   additions.
class Gate {
 public:
  using Clock = std::chrono::steady_clock;

  /// Held while a datagram is handled; its constructor waits while the gate is shut. If it converts
  /// to false, drop the datagram.
  class Pass {
   public:
    explicit Pass(Gate& gate, Clock::time_point now = Clock::now())
        : gate_(gate), place_(gate.begin(now)), entered_(gate.enter()) {}
    ~Pass() {
      if (entered_) gate_.leave();
      gate_.end(place_);
    }
    Pass(const Pass&) = delete;
    Pass& operator=(const Pass&) = delete;
    explicit operator bool() const { return entered_; }

   private:
    Gate& gate_;
    const std::size_t place_;
    const bool entered_;
  };

  /// While a Pause exists no datagram is handled, except the one that this thread is handling. Do
  /// not create one while holding a lock that a callback takes.
  class Pause {
   public:
    explicit Pause(Gate& gate) : gate_(gate) { gate_.shut(); }
    ~Pause() { gate_.open(); }
    Pause(const Pause&) = delete;
    Pause& operator=(const Pause&) = delete;

   private:
    Gate& gate_;
  };

  /// Drops all datagrams from now on; returns when none is being handled any more.
  void close();

  /// For how long the datagram that is being handled for longest has been so, or has waited for
  /// the end of a pause; zero: there is none.
  [[nodiscard]] Clock::duration busy_for(Clock::time_point now) const;

 private:
  // More threads than receive, those of Fast DDS have one socket each.
  static constexpr std::size_t kPlaces = 32;

  std::size_t begin(Clock::time_point now);
  void end(std::size_t place);
  bool enter();
  void leave();
  void shut();
  void open();
  void wait_until_empty(Lock& lock);

  // When each thread with a datagram began, in the clock's ticks; 0: none.
  std::array<std::atomic<Clock::rep>, kPlaces> began_{};
  std::atomic<int> inside_{0};
  std::atomic<bool> shut_{false};  // a Pause exists, or the gate is closed
  Mutex mutex_;                    // guards the rest
  Condition changed_;
  int pauses_ TFDUDE_GUARDED_BY(mutex_) = 0;
  bool closed_ TFDUDE_GUARDED_BY(mutex_) = false;
};

}  // namespace tfdude::fastdds
