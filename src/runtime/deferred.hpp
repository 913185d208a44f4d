#pragma once

#include <atomic>
#include <chrono>
#include <functional>
#include <thread>
#include <utility>

#include "base/mutex.hpp"

namespace tfdude {

/// Runs one job on its own thread soon after a request, once for all requests meanwhile, and at
/// most once per period. A million requests a second cost nanoseconds each, and run the job a
/// thousand times.
class Deferred {
 public:
  using Milliseconds = std::chrono::milliseconds;

  Deferred(Milliseconds period, std::function<void()> job)
      : period_(period), job_(std::move(job)), thread_([this] { run(); }) {}
  ~Deferred() { stop(); }
  Deferred(const Deferred&) = delete;
  Deferred& operator=(const Deferred&) = delete;

  /// Finishes the running job; later requests are ignored.
  void stop() {
    {
      const Lock lock(mutex_);
      stopping_ = true;
    }
    changed_.notify_one();
    if (thread_.joinable()) thread_.join();
  }

  /// Whether a requested run has not started yet.
  [[nodiscard]] bool pending() const { return asked_.load(); }

  void ask() {
    if (asked_.exchange(true)) return;
    // The lock prevents a notification between the thread's check and its sleep.
    { const Lock lock(mutex_); }
    changed_.notify_one();
  }

 private:
  void run() {
    Lock lock(mutex_);
    while (true) {
      changed_.wait(lock, [this]() TFDUDE_REQUIRES(mutex_) { return stopping_ || asked_.load(); });
      if (stopping_) return;
      lock.unlock();
      // Before the job, so that changes while it runs are not missed.
      asked_.store(false);
      job_();
      lock.lock();
      changed_.wait_for(lock, period_, [this]() TFDUDE_REQUIRES(mutex_) { return stopping_; });
    }
  }

  const Milliseconds period_;
  const std::function<void()> job_;
  std::atomic<bool> asked_{false};
  Mutex mutex_;
  Condition changed_;
  bool stopping_ TFDUDE_GUARDED_BY(mutex_) = false;
  std::thread thread_;  // last: it uses the other members
};

}  // namespace tfdude
