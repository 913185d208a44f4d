#pragma once

#include <atomic>
#include <chrono>

#include "transport/fastdds/entities.hpp"
#include "transport/fastdds/worker.hpp"

namespace tfdude::fastdds {

/// Whether a participant depends on others. Then its worker looks often whether they live, and
/// otherwise rarely, so that an idle process hardly wakes.
/// @par Thread safety  All functions are thread-safe. raise() and pay() do not allocate, and take a
///   lock only where they begin to raise the attention.
class Attention {
 public:
  using Milliseconds = std::chrono::milliseconds;

  /// How often the worker looks.
  static constexpr Milliseconds kOften{30};
  static constexpr Milliseconds kRarely{200};

  /// To whom something was sent is depended on for this long.
  static constexpr std::chrono::seconds kDependsFor{2};

  /// @param worker  outlives the use of this
  void start(Worker& worker) { worker_ = &worker; }

  /// Something is sent through this writer.
  void pay(Writer& writer) {
    writer.use(std::chrono::steady_clock::now());
    raise();
  }

  /// The worker must look soon.
  void raise() {
    if (raised_.load(std::memory_order_relaxed) || raised_.exchange(true)) return;
    worker_->hurry(kOften);
  }

  /// The worker begins to look: what is raised from now on makes it look again.
  void lower() { raised_.store(false); }

 private:
  Worker* worker_ = nullptr;
  std::atomic<bool> raised_{false};
};

}  // namespace tfdude::fastdds
