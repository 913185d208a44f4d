#pragma once

#include <condition_variable>
#include <deque>
#include <functional>
#include <mutex>
#include <thread>
#include <utility>

namespace tfdude::web {

/// A thread for calls that wait for owners, so that the server's thread never does.
class Worker {
 public:
  Worker() : thread_([this] { run(); }) {}
  ~Worker() { stop(); }
  Worker(const Worker&) = delete;
  Worker& operator=(const Worker&) = delete;

  /// Runs a function after those before it. Thread-safe.
  /// @return false: too many wait, and it will not run
  bool post(std::function<void()> function) {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (queue_.size() >= kMostWaiting) return false;
    queue_.push_back(std::move(function));
    work_.notify_one();
    return true;
  }

  /// Waits for the function that runs; the others will not run.
  void stop() {
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      stops_ = true;
      work_.notify_one();
    }
    if (thread_.joinable()) thread_.join();
  }

 private:
  static constexpr std::size_t kMostWaiting = 256;

  void run() {
    std::unique_lock<std::mutex> lock(mutex_);
    while (true) {
      work_.wait(lock, [this] { return stops_ || !queue_.empty(); });
      if (stops_) return;
      const std::function<void()> function = std::move(queue_.front());
      queue_.pop_front();
      lock.unlock();
      function();
      lock.lock();
    }
  }

  std::mutex mutex_;
  std::condition_variable work_;
  std::deque<std::function<void()>> queue_;
  bool stops_ = false;
  std::thread thread_;
};

}  // namespace tfdude::web
