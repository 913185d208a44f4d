#pragma once

#include <chrono>
#include <deque>
#include <functional>
#include <utility>

#include "base/loop.hpp"
#include "base/mutex.hpp"

namespace tfdude::fastdds {

/// A thread for work that is not allowed in a DDS callback, such as creating and deleting entities,
/// and for periodic work.
class Worker {
 public:
  Worker()
      : next_(loop_, [this] { return run_next(); }),
        again_(loop_, [this] { return run_again(); }) {}
  Worker(const Worker&) = delete;
  Worker& operator=(const Worker&) = delete;

  /// Before all else. @return kTransport: the system has no thread to give
  [[nodiscard]] Result<void> begin() { return loop_.begin(); }

  void post(std::function<void()> job) {
    {
      const Lock lock(mutex_);
      jobs_.push_back(std::move(job));
    }
    next_.ask();
  }

  /// Runs a job periodically from now on, between other jobs. It returns the time until it is due
  /// again. There can be only one such job.
  void repeat(std::function<std::chrono::milliseconds()> job) {
    {
      const Lock lock(mutex_);
      repeated_ = std::move(job);
    }
    again_.ask();
  }

  /// The repeated job is due again in this time at the latest. Does not allocate.
  void hurry(std::chrono::milliseconds time) { again_.ask_by(Loop::Clock::now() + time); }

  /// Finishes the current job and drops the others.
  void stop() { loop_.stop(); }

 private:
  Loop::Clock::time_point run_next() {
    std::function<void()> job;
    {
      const Lock lock(mutex_);
      if (jobs_.empty()) return Loop::kNever;
      job = std::move(jobs_.front());
      jobs_.pop_front();
    }
    job();
    return Loop::Clock::time_point::min();
  }

  Loop::Clock::time_point run_again() {
    {
      const Lock lock(mutex_);
      if (!repeated_) return Loop::kNever;
    }
    return Loop::Clock::now() + repeated_();
  }

  Mutex mutex_;
  std::deque<std::function<void()>> jobs_ TFDUDE_GUARDED_BY(mutex_);
  std::function<std::chrono::milliseconds()> repeated_;  // set once, under the mutex
  Loop loop_{"tfdude-dds"};
  Loop::Job next_;
  Loop::Job again_;
};

}  // namespace tfdude::fastdds
