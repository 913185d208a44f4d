#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "base/mutex.hpp"
#include "partition/ready.hpp"
#include "partition/state_store.hpp"

namespace tfdude {

/// Values of edges and joints that nobody waits for.
struct ChangedValues {
  std::vector<ChangedEdge> edges{};
  std::vector<StoredJoint> joints{};
  std::uint64_t since = 0;  ///< the commit up to which the values before were taken
};

/// Performs what a member has Ready, in its order: stores it, publishes it, replies. All of it on one thread, the only one
/// that waits for the disk; what has come together meanwhile is stored as one.
///
/// Where something could not be stored, nothing of it is published, and whoever asked for it gets kState. It is tried
/// again until it succeeds; meanwhile failure() says why further changes should be refused.
///
/// @par Thread safety  All functions, but start(), which comes before stop().
class CommitLoop {
 public:
  using Clock = std::chrono::steady_clock;
  using Milliseconds = std::chrono::milliseconds;

  /// Whose changes they are. Called on the loop's thread, which holds no lock; by start() on its caller's.
  class Effects {
   public:
    virtual ~Effects() = default;
    /// All that is to be stored or told since the last call. What follows it is publish() or take_back().
    [[nodiscard]] virtual Ready take() = 0;
    /// Its pages and its presence.
    virtual void publish(const Ready& ready) = 0;
    /// It could not be stored: the next take() gives it again, but for the replies.
    virtual void take_back(const Ready& ready) = 0;
    [[nodiscard]] virtual ChangedValues take_values() = 0;
    virtual void take_back(const ChangedValues& values) = 0;
    virtual void reply(const PendingReply& reply) = 0;
  };

  struct Periods {
    Milliseconds publish{1};    ///< how often at most own changes are told
    Milliseconds values{1000};  ///< how often values that nobody waits for are stored
    Milliseconds retry{200};    ///< how often what could not be stored is tried again by itself
  };

  /// @param store  null: nothing is kept
  CommitLoop(std::unique_ptr<StateStore> store, Effects& effects, Periods periods);
  ~CommitLoop() { stop(); }
  CommitLoop(const CommitLoop&) = delete;
  CommitLoop& operator=(const CommitLoop&) = delete;

  /// Stores and tells what there is, with the configuration that it came from, on the caller's thread; then begins.
  /// @return kState; then it has not begun.
  [[nodiscard]] Result<void> start(const std::vector<FrameSpec>& configured);

  /// Stores and tells what there is, and ends. What comes later is not done.
  void stop();

  /// Has what was changed stored and told soon. Whoever asks a million times a second pays nanoseconds.
  void ask();
  /// Whether what was asked for has not begun yet.
  [[nodiscard]] bool pending() const { return asked_.load(); }

  /// The same at once, as somebody waits for a reply.
  void hurry();

  /// Waits until all that was changed before this call is stored and told. @return kState, kTimeout.
  [[nodiscard]] Result<void> flush(Clock::time_point deadline);

  [[nodiscard]] bool stores() const { return store_ != nullptr; }
  /// Why nothing should be changed now; nothing where all is well.
  [[nodiscard]] std::optional<Error> failure() const;

 private:
  void run();
  [[nodiscard]] std::optional<Clock::time_point> next_round() const TFDUDE_REQUIRES(mutex_);
  void round() TFDUDE_REQUIRES(mutex_);
  [[nodiscard]] Result<void> store(const Ready& ready);
  void tell(const Ready& ready, const Result<void>& stored);
  [[nodiscard]] Result<void> save_values();
  void note(const Result<void>& stored);

  const std::unique_ptr<StateStore> store_;
  Effects& effects_;
  const Periods periods_;
  Clock::time_point next_commit_{};  // of own changes
  Clock::time_point next_values_{};
  std::atomic<bool> asked_{false};
  std::atomic<bool> failing_{false};  // whether there is a failure_

  mutable Mutex mutex_;
  Condition changed_;
  Condition done_;
  bool hurried_ TFDUDE_GUARDED_BY(mutex_) = false;
  std::uint64_t wanted_ TFDUDE_GUARDED_BY(mutex_) = 0;  // calls of flush(),
  std::uint64_t done_up_to_ TFDUDE_GUARDED_BY(mutex_) = 0;
  std::uint64_t stored_up_to_ TFDUDE_GUARDED_BY(mutex_) = 0;
  std::optional<Error> failure_ TFDUDE_GUARDED_BY(mutex_);
  bool stopping_ TFDUDE_GUARDED_BY(mutex_) = false;
  bool ended_ TFDUDE_GUARDED_BY(mutex_) = false;
  std::thread thread_;  // last: it uses the rest
};

}  // namespace tfdude
