#pragma once

#include <atomic>

#include "base/mutex.hpp"

namespace tfdude::fastdds {

/// Where a participant's datagrams come in. Fast DDS handles each on the thread that received it, up to our callbacks and to
/// the matching of what the others have. It reads the listener of an endpoint several times while it matches that, without
/// the lock under which the listener is taken away as the endpoint is deleted (2.9's EDP.cpp; its issue 3303): a null
/// pointer is then called. So nothing is handled while an endpoint is deleted, and nothing any more once the participant
/// leaves.
///
/// @par Thread safety  All functions; a datagram that nothing holds up pays for two atomic additions.
class Gate {
 public:
  /// Held while a datagram is handled; waits where the gate is shut. False inside: drop it.
  class Pass {
   public:
    explicit Pass(Gate& gate) : gate_(gate), entered_(gate.enter()) {}
    ~Pass() {
      if (entered_) gate_.leave();
    }
    Pass(const Pass&) = delete;
    Pass& operator=(const Pass&) = delete;
    explicit operator bool() const { return entered_; }

   private:
    Gate& gate_;
    const bool entered_;
  };

  /// While one exists no datagram is handled, but one on whose behalf this thread runs. Whoever holds a lock that a callback
  /// takes must not make one.
  class Pause {
   public:
    explicit Pause(Gate& gate) : gate_(gate) { gate_.shut(); }
    ~Pause() { gate_.open(); }
    Pause(const Pause&) = delete;
    Pause& operator=(const Pause&) = delete;

   private:
    Gate& gate_;
  };

  /// Drops all that comes from now on; returns when nothing is handled any more.
  void close();

 private:
  bool enter();
  void leave();
  void shut();
  void open();
  void wait_until_empty(Lock& lock);

  std::atomic<int> inside_{0};
  std::atomic<bool> shut_{false};  // somebody pauses, or it is closed
  Mutex mutex_;                    // of the rest
  Condition changed_;
  int pauses_ TFDUDE_GUARDED_BY(mutex_) = 0;
  bool closed_ TFDUDE_GUARDED_BY(mutex_) = false;
};

}  // namespace tfdude::fastdds
