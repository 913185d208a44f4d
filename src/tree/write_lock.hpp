#pragma once

#include <atomic>
#include <ctime>
#include <sched.h>

namespace tfdude {

/// Keeps writers of a forest apart. They hold it for about ten nanoseconds, and usually there is
/// one writer only. A std::mutex, which also needs a locked instruction to unlock, took more than
/// half of the time of an update (9 of 16 ns). A writer that finds the lock taken yields, and later
/// sleeps, so that it waits for a writer of any priority.
class WriteLock {
 public:
  void lock() {
    for (int tries = 0; taken_.exchange(true, std::memory_order_acquire); ++tries) {
      if (tries < kYields) {
        (void)sched_yield();
      } else {
        const std::timespec pause{0, 50'000};
        (void)nanosleep(&pause, nullptr);
      }
    }
  }
  void unlock() { taken_.store(false, std::memory_order_release); }

 private:
  static constexpr int kYields = 100;
  std::atomic<bool> taken_{false};
};

}  // namespace tfdude
