#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <optional>

#include "base/mutex.hpp"
#include "partition/ready.hpp"

namespace tfdude {

/// When a member's Ready is performed, and in which order: stored, published, replied. Changes that
/// have come meanwhile are stored together. Time comes from outside, and storing is left to whoever
/// runs the rounds.
///
/// If something could not be stored, nothing of it is published, and its requesters get kState.
/// Storing is retried until it succeeds, and there is room for more; meanwhile failure() says why
/// further changes should be rejected.
///
/// @par Thread safety  All functions are thread-safe; those of rounds are for one thread.
class Commits {
 public:
  using Clock = std::chrono::steady_clock;
  using Milliseconds = std::chrono::milliseconds;
  static constexpr Clock::time_point kNever = Clock::time_point::max();

  /// The source of the changes. Called by rounds, without a lock.
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

  /// @param stores  false: nothing is stored
  Commits(Effects& effects, Periods periods, bool stores)
      : effects_(effects), periods_(periods), stores_(stores) {}

  [[nodiscard]] bool stores() const { return stores_; }

  /// Requests a commit soon. @return whether next() may have changed
  [[nodiscard]] bool ask() { return !asked_.exchange(true); }
  /// Whether a requested commit has not started yet.
  [[nodiscard]] bool pending() const { return asked_.load(); }
  /// As ask(), but at once, since a reply is due.
  void hurry();
  /// As ask(), but at once. @return a number for outcome() and wait()
  [[nodiscard]] std::uint64_t want();
  /// What has become of all changes before want(): kState; empty: nothing yet.
  [[nodiscard]] std::optional<Result<void>> outcome(std::uint64_t number) const;
  /// Waits for outcome(). @return also kTimeout
  [[nodiscard]] Result<void> wait(std::uint64_t number, Clock::time_point deadline);

  /// Why no change should be made now; empty if all is well.
  [[nodiscard]] std::optional<Error> failure() const;

  // --- rounds. The first one says whether there are more: it must succeed.

  [[nodiscard]] bool started() const;
  /// When the next round is due.
  [[nodiscard]] Clock::time_point next() const;
  /// What must be stored now; finish() follows.
  /// @param values  also those that are not due yet
  [[nodiscard]] Ready begin(Clock::time_point now, bool values = false);
  /// @param room  whether the next change can be stored
  void finish(const Ready& ready, const Result<void>& stored, const Result<void>& room,
              Clock::time_point now);
  /// There are no more.
  void end();

 private:
  [[nodiscard]] std::optional<Result<void>> known(std::uint64_t number) const
      TFDUDE_REQUIRES(mutex_);
  void tell(const Ready& ready, const Result<void>& stored);
  void note(const Result<void>& stored);

  Effects& effects_;
  const Periods periods_;
  const bool stores_;
  std::atomic<bool> asked_{false};
  std::atomic<bool> failing_{false};  // whether failure_ is set
  mutable Mutex mutex_;
  Condition done_;
  Clock::time_point next_commit_ TFDUDE_GUARDED_BY(mutex_){};  // of own changes
  Clock::time_point next_values_ TFDUDE_GUARDED_BY(mutex_){};
  bool hurried_ TFDUDE_GUARDED_BY(mutex_) = false;
  std::uint64_t wanted_ TFDUDE_GUARDED_BY(mutex_) = 0;  // number of want() calls
  std::uint64_t begun_ TFDUDE_GUARDED_BY(mutex_) = 0;   // of these, those before the round
  std::uint64_t done_up_to_ TFDUDE_GUARDED_BY(mutex_) = 0;
  std::uint64_t stored_up_to_ TFDUDE_GUARDED_BY(mutex_) = 0;
  std::optional<Error> failure_ TFDUDE_GUARDED_BY(mutex_);
  bool values_due_ TFDUDE_GUARDED_BY(mutex_) = false;  // in the round
  bool started_ TFDUDE_GUARDED_BY(mutex_) = false;
  bool ended_ TFDUDE_GUARDED_BY(mutex_) = false;
};

}  // namespace tfdude
