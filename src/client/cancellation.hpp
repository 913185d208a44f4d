#pragma once

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <vector>

namespace tfdude {

/// Ends the wait of another thread.
class Cancellation {
 public:
  void cancel() {
    {
      const std::lock_guard lock(mutex_);
      cancelled_ = true;
    }
    changed_.notify_all();
  }

  /// @return whether it was cancelled before the deadline
  [[nodiscard]] bool wait_until(std::chrono::steady_clock::time_point deadline) {
    std::unique_lock lock(mutex_);
    return changed_.wait_until(lock, deadline, [this] { return cancelled_; });
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  bool cancelled_ = false;
};

/// All that may have to be cancelled, each as long as somebody else has it.
class Cancellations {
 public:
  /// Something to be stopped, and waited for.
  class Task {
   public:
    virtual ~Task() = default;
    virtual void stop() = 0;
    [[nodiscard]] virtual bool done() const = 0;
  };

  void add(const std::shared_ptr<Task>& task) {
    const std::lock_guard lock(mutex_);
    tasks_.erase(
        std::remove_if(tasks_.begin(), tasks_.end(), [](const auto& one) { return one.expired(); }),
        tasks_.end());
    tasks_.push_back(task);
  }

  /// The same for one that nobody else has.
  void keep(std::shared_ptr<Task> task) {
    add(task);
    const std::lock_guard lock(mutex_);
    kept_.erase(
        std::remove_if(kept_.begin(), kept_.end(), [](const auto& one) { return one->done(); }),
        kept_.end());
    kept_.push_back(std::move(task));
  }

  void cancel_all() {
    std::vector<std::weak_ptr<Task>> tasks;
    std::vector<std::shared_ptr<Task>> kept;  // outlive the loop
    {
      const std::lock_guard lock(mutex_);
      tasks.swap(tasks_);
      kept.swap(kept_);
    }
    for (const auto& task : tasks) {
      if (const auto alive = task.lock()) alive->stop();
    }
  }

 private:
  std::mutex mutex_;
  std::vector<std::weak_ptr<Task>> tasks_;
  std::vector<std::shared_ptr<Task>> kept_;
};

}  // namespace tfdude
