#pragma once

#include <chrono>
#include <deque>
#include <functional>
#include <memory>
#include <thread>
#include <utility>

#include "base/mutex.hpp"

namespace tfdude {

/// Calls user functions, one after the other, from its own thread, which holds no lock: so they may
/// call any function. Thread-safe.
class Notices {
 public:
  /// @param gather  how long a call may wait for others, so that many of them wake the thread once
  explicit Notices(std::chrono::milliseconds gather = {}) : gather_(gather) {}
  ~Notices() { stop(); }
  Notices(const Notices&) = delete;
  Notices& operator=(const Notices&) = delete;

  void post(std::function<void()> call) {
    const Lock lock(shared_->mutex);
    if (shared_->stopping) return;
    shared_->waiting.push_back(std::move(call));
    if (!thread_.joinable()) {
      thread_ = std::thread([shared = shared_, gather = gather_] { run(*shared, gather); });
    }
    if (shared_->waiting.size() == 1) shared_->changed.notify_one();
  }

  /// Waits for a running call, unless that call itself calls this; queued calls are dropped.
  void stop() {
    std::thread ending;
    {
      const Lock lock(shared_->mutex);
      shared_->stopping = true;
      ending = std::move(thread_);
    }
    shared_->changed.notify_one();
    if (!ending.joinable()) return;
    if (ending.get_id() == std::this_thread::get_id()) {
      ending.detach();  // it ends with that call
    } else {
      ending.join();
    }
  }

 private:
  // Kept by the thread if its own call has ended this object.
  struct Shared {
    Mutex mutex;
    Condition changed;
    std::deque<std::function<void()>> waiting TFDUDE_GUARDED_BY(mutex);
    bool stopping TFDUDE_GUARDED_BY(mutex) = false;
  };

  static void run(Shared& shared, std::chrono::milliseconds gather) {
    Lock lock(shared.mutex);
    while (true) {
      if (shared.waiting.empty()) {
        shared.changed.wait(lock, [&]() TFDUDE_REQUIRES(shared.mutex) {
          return shared.stopping || !shared.waiting.empty();
        });
        if (gather.count() > 0) {
          shared.changed.wait_for(lock, gather,
                                  [&]() TFDUDE_REQUIRES(shared.mutex) { return shared.stopping; });
        }
      }
      if (shared.stopping) return;
      auto call = std::move(shared.waiting.front());
      shared.waiting.pop_front();
      lock.unlock();
      call();
      call = nullptr;  // objects it holds may call this class when they are destroyed
      lock.lock();
    }
  }

  const std::chrono::milliseconds gather_;
  const std::shared_ptr<Shared> shared_ = std::make_shared<Shared>();
  std::thread thread_;  // from the first call on
};

}  // namespace tfdude
