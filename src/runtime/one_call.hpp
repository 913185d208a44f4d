#pragma once

#include <condition_variable>
#include <functional>
#include <mutex>
#include <thread>
#include <utility>

namespace tfdude {

/// A function that is called once at most, and may be called off from any thread.
template <class Argument>
class OneCall {
 public:
  using Function = std::function<void(Argument)>;

  explicit OneCall(Function function) : function_(std::move(function)) {}

  /// Calls it, unless it was called or called off before.
  void run(Argument argument) {
    Function function;
    {
      const std::lock_guard lock(mutex_);
      if (state_ != State::kWaits) return;
      state_ = State::kRuns;
      runner_ = std::this_thread::get_id();
      function = std::move(function_);
    }
    function(std::move(argument));
    function = nullptr;  // what it holds goes before anybody hears that it is over
    {
      const std::lock_guard lock(mutex_);
      state_ = State::kOver;
    }
    over_.notify_all();
  }

  /// Once this returns the function does not run and will not, unless it is the function that calls this.
  void cancel() {
    Function dropped;  // goes without the lock
    std::unique_lock lock(mutex_);
    if (state_ == State::kWaits) {
      state_ = State::kOver;
      dropped = std::move(function_);
    } else if (state_ == State::kRuns && runner_ != std::this_thread::get_id()) {
      over_.wait(lock, [this] { return state_ == State::kOver; });
    }
    lock.unlock();
  }

  [[nodiscard]] bool waits() const {
    const std::lock_guard lock(mutex_);
    return state_ == State::kWaits;
  }

 private:
  enum class State { kWaits, kRuns, kOver };

  mutable std::mutex mutex_;
  std::condition_variable over_;
  State state_ = State::kWaits;
  std::thread::id runner_;
  Function function_;
};

}  // namespace tfdude
