#pragma once

#include <algorithm>
#include <chrono>
#include <deque>
#include <functional>
#include <thread>

#include "base/mutex.hpp"

namespace tfdude::fastdds {

/// A thread for work that is not allowed in a DDS callback, such as creating and deleting entities,
/// and for periodic work.
class Worker {
 public:
  Worker() : thread_([this] { run(); }) {}
  ~Worker() { stop(); }
  Worker(const Worker&) = delete;
  Worker& operator=(const Worker&) = delete;

  void post(std::function<void()> job) {
    {
      const Lock lock(mutex_);
      jobs_.push_back(std::move(job));
    }
    changed_.notify_one();
  }

  /// Runs a job periodically from now on, between other jobs. It returns the time until it is due
  /// again. There can be only one such job.
  void repeat(std::function<std::chrono::milliseconds()> job) {
    const Lock lock(mutex_);
    repeated_ = std::move(job);
    due_ = Clock::now();
    changed_.notify_one();
  }

  /// The repeated job is due again in this time at the latest. Does not allocate.
  void hurry(std::chrono::milliseconds time) {
    const Lock lock(mutex_);
    const auto due = Clock::now() + time;
    if (due >= due_) return;
    due_ = due;
    changed_.notify_one();
  }

  /// Finishes the current job and drops the others.
  void stop() {
    {
      const Lock lock(mutex_);
      stopping_ = true;
    }
    changed_.notify_one();
    if (thread_.joinable()) thread_.join();
  }

 private:
  using Clock = std::chrono::steady_clock;

  void run() {
    Lock lock(mutex_);
    while (true) {
      // By a copy, which others may not change while it is waited for. Who changes it notifies.
      const Clock::time_point due = due_;
      changed_.wait_until(lock, due, [this, due]() TFDUDE_REQUIRES(mutex_) {
        return stopping_ || !jobs_.empty() || due_ != due;
      });
      if (stopping_) return;
      if (!jobs_.empty()) {
        const std::function<void()> job = std::move(jobs_.front());
        jobs_.pop_front();
        lock.unlock();
        job();
        lock.lock();
      }
      if (!repeated_ || Clock::now() < due_) continue;
      due_ = Clock::time_point::max();  // what hurries meanwhile is kept
      lock.unlock();
      const auto next = Clock::now() + repeated_();
      lock.lock();
      due_ = std::min(due_, next);
    }
  }

  Mutex mutex_;
  Condition changed_;
  std::deque<std::function<void()>> jobs_ TFDUDE_GUARDED_BY(mutex_);
  bool stopping_ TFDUDE_GUARDED_BY(mutex_) = false;
  std::function<std::chrono::milliseconds()> repeated_;  // set once, before it is due
  Clock::time_point due_ TFDUDE_GUARDED_BY(mutex_) = Clock::now() + std::chrono::hours(1);
  std::thread thread_;
};

}  // namespace tfdude::fastdds
