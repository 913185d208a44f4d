#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>

#include "base/loop.hpp"
#include "base/mutex.hpp"
#include "partition/ready.hpp"
#include "partition/state_store.hpp"

namespace tfdude {

/// Performs a member's Ready, in order: stores, publishes, replies. All on one thread, the only one
/// that waits for the disk until stop(). Changes that have come meanwhile are stored together.
///
/// If something could not be stored, nothing of it is published, and its requesters get kState.
/// Storing is retried until it succeeds; meanwhile failure() says why further changes should be
/// rejected.
///
/// @par Thread safety  All functions are thread-safe, except start(), which must precede stop().
class CommitLoop {
 public:
  using Clock = Loop::Clock;
  using Milliseconds = std::chrono::milliseconds;

  /// The source of the changes. Called on the loop's thread, which holds no lock; by start() on the
  /// caller's.
  class Effects {
   public:
    virtual ~Effects() = default;
    /// Everything to store or announce since the last call. publish() or take_back() follows.
    /// @param values_due  as of Partition::take_unsaved()
    [[nodiscard]] virtual Ready take(bool values_due) = 0;
    /// Publishes its pages and its presence.
    virtual void publish(const Ready& ready) = 0;
    /// What was taken could not be stored: the next take() returns it again, without the replies.
    virtual void take_back(const Ready& ready) = 0;
    virtual void reply(const PendingReply& reply) = 0;
  };

  struct Periods {
    Milliseconds publish{1};    ///< minimum interval between announcements of own changes
    Milliseconds values{1000};  ///< interval at which values that no request waits for are stored
    Milliseconds retry{200};    ///< interval of retries after a failure to store
  };

  /// @param store  null: nothing is stored
  CommitLoop(std::unique_ptr<StateStore> store, Effects& effects, Periods periods);
  ~CommitLoop() { stop(); }
  CommitLoop(const CommitLoop&) = delete;
  CommitLoop& operator=(const CommitLoop&) = delete;

  /// Stores and announces the current state on the caller's thread; then starts the loop.
  /// @return kState; the loop has then not started.
  [[nodiscard]] Result<void> start();

  /// Ends the loop; then stores and announces pending changes, on the caller's thread. Later ones
  /// are not processed.
  void stop();

  /// Requests a commit soon. A call costs nanoseconds, so a million calls a second are fine.
  void ask() {
    if (!asked_.exchange(true)) rounds_.ask();
  }
  /// Whether a requested commit has not started yet.
  [[nodiscard]] bool pending() const { return asked_.load(); }

  /// As ask(), but at once, since a reply is due.
  void hurry();

  /// Waits until all earlier changes are stored and announced. @return kState, kTimeout.
  [[nodiscard]] Result<void> flush(Clock::time_point deadline);

  [[nodiscard]] bool stores() const { return store_ != nullptr; }
  /// Why no change should be made now; empty if all is well.
  [[nodiscard]] std::optional<Error> failure() const;

 private:
  [[nodiscard]] Clock::time_point run();
  [[nodiscard]] Clock::time_point next_round() const TFDUDE_REQUIRES(mutex_);
  void round() TFDUDE_REQUIRES(mutex_);
  [[nodiscard]] Result<void> store(const Ready& ready);
  void tell(const Ready& ready, const Result<void>& stored);
  void note(const Result<void>& stored);

  const std::unique_ptr<StateStore> store_;
  Effects& effects_;
  const Periods periods_;
  Clock::time_point next_commit_{};  // of own changes
  Clock::time_point next_values_{};
  std::atomic<bool> asked_{false};
  std::atomic<bool> failing_{false};  // whether failure_ is set

  mutable Mutex mutex_;
  Condition done_;
  bool hurried_ TFDUDE_GUARDED_BY(mutex_) = false;
  std::uint64_t wanted_ TFDUDE_GUARDED_BY(mutex_) = 0;  // number of flush() calls
  std::uint64_t done_up_to_ TFDUDE_GUARDED_BY(mutex_) = 0;
  std::uint64_t stored_up_to_ TFDUDE_GUARDED_BY(mutex_) = 0;
  std::optional<Error> failure_ TFDUDE_GUARDED_BY(mutex_);
  bool started_ TFDUDE_GUARDED_BY(mutex_) = false;
  bool ended_ TFDUDE_GUARDED_BY(mutex_) = false;
  Loop loop_{"tfdude-commit"};
  Loop::Job rounds_;  // last: it uses the other members
};

}  // namespace tfdude
