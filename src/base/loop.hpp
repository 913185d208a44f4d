#pragma once

#include <atomic>
#include <chrono>
#include <functional>
#include <thread>
#include <vector>

#include "tfdude/base/result.hpp"

#include "base/mutex.hpp"

namespace tfdude {

/// A named thread that runs jobs, one at a time and in turn: soon after they were asked for, and at
/// the times that they name. The thread begins with the first request. While the system has no
/// thread to give, requests wait, and each later one tries to begin it again.
/// @par Thread safety  All functions are thread-safe.
class Loop {
 public:
  using Clock = std::chrono::steady_clock;
  static constexpr Clock::time_point kNever = Clock::time_point::max();

  class Job;

  /// @param name  of the thread, at most 15 characters
  explicit Loop(const char* name) : name_(name) {}
  ~Loop() { stop(); }
  Loop(const Loop&) = delete;
  Loop& operator=(const Loop&) = delete;

  /// Begins the thread now, unless it was begun or stopped. @return kTransport: there is none
  [[nodiscard]] Result<void> begin();

  /// After it has returned no job runs. Not for its own jobs.
  void stop();

 private:
  void wake();
  Result<void> begin_thread() TFDUDE_REQUIRES(mutex_);
  void keep_asked() TFDUDE_REQUIRES(mutex_);
  void run();
  [[nodiscard]] Job* next_due(Clock::time_point now, Clock::time_point& wake_at)
      TFDUDE_REQUIRES(mutex_);
  void run(Job& job) TFDUDE_REQUIRES(mutex_);

  const char* const name_;
  Mutex mutex_;
  Condition changed_;
  Condition ended_;                                   // a run
  std::vector<Job*> jobs_ TFDUDE_GUARDED_BY(mutex_);  // the one that ran last is at the end
  Job* running_ TFDUDE_GUARDED_BY(mutex_) = nullptr;
  bool stopping_ TFDUDE_GUARDED_BY(mutex_) = false;
  std::thread thread_ TFDUDE_GUARDED_BY(mutex_);
};

/// One job of a loop, which outlives it. It runs once for all requests since its last run began.
/// @par Thread safety  All functions are thread-safe.
class Loop::Job {
 public:
  /// @return when to run again, unless asked for before; kNever
  using Run = std::function<Clock::time_point()>;

  /// @param rest  minimum time between two runs, except those of which the job named the time
  Job(Loop& loop, Run run, std::chrono::nanoseconds rest = {});
  ~Job() { stop(); }
  Job(const Job&) = delete;
  Job& operator=(const Job&) = delete;

  /// Another run, soon. A million requests a second cost nanoseconds each.
  void ask() {
    if (!asked_.exchange(true)) loop_.wake();
  }
  /// Another run, at this time at the latest.
  void ask_by(Clock::time_point time);
  /// Whether a run that was asked for has not begun yet.
  [[nodiscard]] bool pending() const { return asked_.load(); }

  /// After it has returned the job is not running and will not run. Not for the loop's own jobs.
  void stop();

 private:
  friend class Loop;

  Loop& loop_;
  const Run run_;
  const std::chrono::nanoseconds rest_;
  std::atomic<bool> asked_{false};
  // Under the loop's lock.
  Clock::time_point due_ = kNever;
  Clock::time_point rests_until_ = Clock::time_point::min();
};

}  // namespace tfdude
