#pragma once

#include <memory>

#include "base/loop.hpp"
#include "partition/state_store.hpp"
#include "runtime/commits.hpp"

namespace tfdude {

/// Runs the rounds of Commits, and stores. All on one thread, the only one that waits for the disk
/// until stop().
/// @par Thread safety  All functions are thread-safe, except start(), which must precede stop().
class CommitLoop {
 public:
  using Clock = Loop::Clock;
  using Effects = Commits::Effects;
  using Periods = Commits::Periods;

  /// @param store  null: nothing is stored
  CommitLoop(std::unique_ptr<StateStore> store, Effects& effects, Periods periods);
  ~CommitLoop() { stop(); }
  CommitLoop(const CommitLoop&) = delete;
  CommitLoop& operator=(const CommitLoop&) = delete;

  /// Stores and announces the current state on the caller's thread; then starts the loop.
  /// @return kState; kTransport: no thread. The loop has then not started.
  [[nodiscard]] Result<void> start();

  /// Ends the loop; then stores and announces pending changes, on the caller's thread. Later ones
  /// are not processed.
  void stop();

  /// Requests a commit soon. A call costs nanoseconds, so a million calls a second are fine.
  void ask() {
    if (commits_.ask()) rounds_.ask();
  }
  /// As Commits::pending().
  [[nodiscard]] bool pending() const { return commits_.pending(); }
  /// As ask(), but at once, since a reply is due.
  void hurry() {
    commits_.hurry();
    rounds_.ask();
  }

  /// Waits until all earlier changes are stored and announced. @return kState, kTimeout.
  [[nodiscard]] Result<void> flush(Clock::time_point deadline);

  [[nodiscard]] bool stores() const { return commits_.stores(); }
  /// As Commits::failure().
  [[nodiscard]] std::optional<Error> failure() const { return commits_.failure(); }

 private:
  [[nodiscard]] Clock::time_point run();
  Result<void> round(bool values = false);

  const std::unique_ptr<StateStore> store_;
  Commits commits_;
  bool ended_ = false;  // belongs to stop()
  Loop loop_{"tfdude-commit"};
  Loop::Job rounds_;  // last: it uses the other members
};

}  // namespace tfdude
