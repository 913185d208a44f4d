#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <mutex>
#include <thread>
#include <utility>

namespace tfdude::cli {

/// A thread that runs what it is given, in order, so that those who give it do not wait for
/// requests. Its inbox is bounded: what does not fit is dropped and counted, as a DDS reader of a
/// bounded depth does.
class Worker {
 public:
  using Clock = std::chrono::steady_clock;
  using Task = std::function<void()>;

  explicit Worker(std::size_t capacity = 1000) : capacity_(capacity), thread_([this] { run(); }) {}
  ~Worker() { stop(); }
  Worker(const Worker&) = delete;
  Worker& operator=(const Worker&) = delete;

  /// Thread-safe; does not wait. @return false: it is dropped
  bool post(Task task) {
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      if (tasks_.size() >= capacity_) {
        dropped_.fetch_add(1, std::memory_order_relaxed);
        return false;
      }
      tasks_.push_back(std::move(task));
    }
    changed_.notify_one();
    return true;
  }

  /// Runs a task periodically. Call once.
  void repeat(std::chrono::nanoseconds period, Task task) {
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      period_ = period;
      repeated_ = std::move(task);
      due_ = Clock::now() + period;
    }
    changed_.notify_one();
  }

  /// After it has returned, nothing runs. Not from a task.
  void stop() {
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      stopping_ = true;
    }
    changed_.notify_one();
    if (thread_.joinable()) thread_.join();
  }

  [[nodiscard]] std::uint64_t dropped() const { return dropped_.load(std::memory_order_relaxed); }

 private:
  void run() {
    std::unique_lock<std::mutex> lock(mutex_);
    while (!stopping_) {
      const bool is_due = repeated_ && Clock::now() >= due_;
      if (!is_due && tasks_.empty()) {
        if (repeated_) {
          changed_.wait_until(lock, due_);
        } else {
          changed_.wait(lock);
        }
        continue;
      }
      Task task;
      if (is_due) {
        // Turns that were missed are left out.
        due_ = std::max(due_ + period_, Clock::now());
        task = repeated_;
      } else {
        task = std::move(tasks_.front());
        tasks_.pop_front();
      }
      lock.unlock();
      task();
      task = nullptr;
      lock.lock();
    }
  }

  const std::size_t capacity_;
  std::atomic<std::uint64_t> dropped_{0};
  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<Task> tasks_;
  Task repeated_;
  std::chrono::nanoseconds period_{0};
  Clock::time_point due_{};
  bool stopping_ = false;
  std::thread thread_;  // last: it uses the other members
};

}  // namespace tfdude::cli
