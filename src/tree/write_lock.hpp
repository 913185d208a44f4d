#pragma once

#include <atomic>
#include <ctime>
#include <sched.h>

#include "base/mutex.hpp"

namespace tfdude {

/// Keeps writers of a forest apart. They hold it for about ten nanoseconds, and usually there is
/// one writer only. A std::mutex, which also needs a locked instruction to unlock, took more than
/// half of the time of an update (9 of 16 ns). A writer that finds the lock taken yields, and later
/// sleeps, so that it waits for a writer of any priority.
class TFDUDE_LOCKS(capability("mutex")) WriteLock {
 public:
  void lock() TFDUDE_LOCKS(acquire_capability()) {
    if constexpr (kCheckLockOrder) HeldLocks::wait_for(LockRank::kForest);
    for (int tries = 0; taken_.exchange(true, std::memory_order_acquire); ++tries) {
      if (tries < kYields) {
        (void)sched_yield();
      } else {
        const std::timespec pause{0, 50'000};
        (void)nanosleep(&pause, nullptr);
      }
    }
    if constexpr (kCheckLockOrder) HeldLocks::add(LockRank::kForest);
  }
  void unlock() TFDUDE_LOCKS(release_capability()) {
    if constexpr (kCheckLockOrder) HeldLocks::remove(LockRank::kForest);
    taken_.store(false, std::memory_order_release);
  }

 private:
  static constexpr int kYields = 100;
  std::atomic<bool> taken_{false};
};

/// Holds a WriteLock.
class TFDUDE_LOCKS(scoped_lockable) Writing {
 public:
  explicit Writing(WriteLock& lock) TFDUDE_LOCKS(acquire_capability(lock)) : lock_(lock) {
    lock_.lock();
  }
  ~Writing() TFDUDE_LOCKS(release_capability()) { lock_.unlock(); }
  Writing(const Writing&) = delete;
  Writing& operator=(const Writing&) = delete;

 private:
  WriteLock& lock_;
};

}  // namespace tfdude
