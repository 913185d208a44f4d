#pragma once

#include <chrono>
#include <condition_variable>
#include <functional>
#include <mutex>
#include <thread>
#include <utility>

namespace tfdude {

/// Does one job again and again, a period after it has done it, on a thread of its own.
class Periodic {
 public:
  Periodic(std::chrono::milliseconds period, std::function<void()> job)
      : period_(period), job_(std::move(job)), thread_([this] { run(); }) {}
  ~Periodic() {
    {
      const std::lock_guard lock(mutex_);
      stopping_ = true;
    }
    changed_.notify_one();
    thread_.join();
  }
  Periodic(const Periodic&) = delete;
  Periodic& operator=(const Periodic&) = delete;

 private:
  void run() {
    std::unique_lock lock(mutex_);
    while (!changed_.wait_for(lock, period_, [this] { return stopping_; })) {
      lock.unlock();
      job_();
      lock.lock();
    }
  }

  const std::chrono::milliseconds period_;
  const std::function<void()> job_;
  std::mutex mutex_;
  std::condition_variable changed_;
  bool stopping_ = false;
  std::thread thread_;  // last: it uses the rest
};

}  // namespace tfdude
