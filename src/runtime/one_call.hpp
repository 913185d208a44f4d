#pragma once

#include <functional>
#include <thread>
#include <utility>

#include "base/mutex.hpp"

namespace tfdude {

/// A function that is called at most once, and may be cancelled from any thread.
template <class Argument>
class OneCall {
 public:
  using Function = std::function<void(Argument)>;

  explicit OneCall(Function function) : function_(std::move(function)) {}

  /// Calls it, unless it was called or cancelled before.
  void run(Argument argument) {
    Function function;
    {
      const Lock lock(mutex_);
      if (state_ != State::kWaits) return;
      state_ = State::kRuns;
      runner_ = std::this_thread::get_id();
      function = std::move(function_);
    }
    function(std::move(argument));
    function = nullptr;  // objects it holds are destroyed before the end of the call is reported
    {
      const Lock lock(mutex_);
      state_ = State::kOver;
    }
    over_.notify_all();
  }

  /// After it has returned the function is not running and will not run, unless the function itself
  /// calls this.
  void cancel() {
    Function dropped;  // destroyed without the lock
    Lock lock(mutex_);
    if (state_ == State::kWaits) {
      state_ = State::kOver;
      dropped = std::move(function_);
    } else if (state_ == State::kRuns && runner_ != std::this_thread::get_id()) {
      over_.wait(lock, [this]() TFDUDE_REQUIRES(mutex_) { return state_ == State::kOver; });
    }
    lock.unlock();
  }

  [[nodiscard]] bool waits() const {
    const Lock lock(mutex_);
    return state_ == State::kWaits;
  }

 private:
  enum class State { kWaits, kRuns, kOver };

  mutable Mutex mutex_;
  Condition over_;
  State state_ TFDUDE_GUARDED_BY(mutex_) = State::kWaits;
  std::thread::id runner_ TFDUDE_GUARDED_BY(mutex_);
  Function function_ TFDUDE_GUARDED_BY(mutex_);
};

}  // namespace tfdude
