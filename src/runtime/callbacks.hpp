#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <optional>

#include "tfdude/base/time.hpp"

namespace tfdude {

/// Runs user functions, which may take any time. One thread runs them one after the other; others
/// help only if they take long, so that no function waits for a running one longer than kPatience.
/// Unneeded threads end.
/// @par Thread safety  All functions are thread-safe.
class Callbacks {
 public:
  using Clock = std::chrono::steady_clock;
  using Job = std::function<void()>;

  static constexpr Milliseconds kPatience{5};

  Callbacks();
  ~Callbacks() { stop(); }
  Callbacks(const Callbacks&) = delete;
  Callbacks& operator=(const Callbacks&) = delete;

  /// Queues the job. After a post the caller calls look_after(), whenever that says so.
  void post(Job job);

  /// Adds a thread if a job has waited too long. @return when to call again; empty if no job waits
  [[nodiscard]] std::optional<Clock::time_point> look_after(Clock::time_point now);

  /// Drops jobs that have not started. After it has returned no job runs, except one that calls
  /// this.
  void stop();

 private:
  struct State;
  static void run(const std::shared_ptr<State>& state);
  static void add_thread(const std::shared_ptr<State>& state);

  // Threads may outlive this object if one of their jobs destroys it.
  const std::shared_ptr<State> state_;
};

}  // namespace tfdude
