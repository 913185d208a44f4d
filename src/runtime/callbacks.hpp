#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <optional>

#include "tfdude/base/time.hpp"

namespace tfdude {

/// Runs functions of the user's that may take any time: one thread runs them one after the other, and another one helps only
/// where they take long, so that none waits for another by more than kPatience for each that runs. Threads that are not
/// needed any more end.
/// @par Thread safety  All functions.
class Callbacks {
 public:
  using Clock = std::chrono::steady_clock;
  using Job = std::function<void()>;

  static constexpr Milliseconds kPatience{5};

  Callbacks();
  ~Callbacks() { stop(); }
  Callbacks(const Callbacks&) = delete;
  Callbacks& operator=(const Callbacks&) = delete;

  /// Has the job run soon. Whoever posts calls look_after() from then on, as it says.
  void post(Job job);

  /// Adds a thread where a job has waited too long. @return when to look again; nothing where none waits
  [[nodiscard]] std::optional<Clock::time_point> look_after(Clock::time_point now);

  /// Drops what has not begun. Once this returns no job runs, but for the one that calls this.
  void stop();

 private:
  struct State;
  static void run(const std::shared_ptr<State>& state);
  static void add_thread(const std::shared_ptr<State>& state);

  const std::shared_ptr<State> state_;  // threads may outlive this where a job of theirs ends it
};

}  // namespace tfdude
