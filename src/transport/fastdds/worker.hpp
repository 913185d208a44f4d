#pragma once

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

  /// Runs a job once per period from now on, between other jobs. There can be only one such job.
  void repeat(std::chrono::milliseconds period, std::function<void()> job) {
    post([this, period, job = std::move(job)]() mutable {
      period_ = period;
      repeated_ = std::move(job);
      due_ = Clock::now() + period_;
    });
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
      // By a copy, which the jobs may not change while it is waited for.
      const Clock::time_point due = due_;
      changed_.wait_until(lock, due,
                          [this]() TFDUDE_REQUIRES(mutex_) { return stopping_ || !jobs_.empty(); });
      if (stopping_) return;
      std::function<void()> job;
      if (!jobs_.empty()) {
        job = std::move(jobs_.front());
        jobs_.pop_front();
      }
      lock.unlock();
      if (job) job();
      if (repeated_ && Clock::now() >= due_) {
        due_ = Clock::now() + period_;
        repeated_();
      }
      lock.lock();
    }
  }

  Mutex mutex_;
  Condition changed_;
  std::deque<std::function<void()>> jobs_ TFDUDE_GUARDED_BY(mutex_);
  bool stopping_ TFDUDE_GUARDED_BY(mutex_) = false;
  // Of the thread alone.
  std::chrono::milliseconds period_{};
  std::function<void()> repeated_;
  Clock::time_point due_ = Clock::now() + std::chrono::hours(1);
  std::thread thread_;
};

}  // namespace tfdude::fastdds
