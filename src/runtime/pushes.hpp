#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <map>
#include <optional>
#include <vector>

#include "base/mutex.hpp"
#include "base/token_bucket.hpp"
#include "partition/messages.hpp"
#include "partition/watching.hpp"
#include "tree/forest.hpp"

namespace tfdude {

/// Pushes values written to an owner's edges to their watchers, in runs. While nobody watches, an
/// update costs one additional check of a pointer.
/// @par Thread safety  All functions are thread-safe; run() is for one thread.
class Pushes {
 public:
  using Clock = std::chrono::steady_clock;
  static constexpr Clock::time_point kNever = Clock::time_point::max();

  /// Where values go, and who runs it.
  class Sink {
   public:
    virtual ~Sink() = default;
    /// Called by run(), without a lock.
    /// @param values  or a piece of them
    virtual void push(const PushedValues& values) = 0;
    /// Frees the resources of pushing to a group. Called as push().
    virtual void end(std::uint64_t group) = 0;
    /// run() must follow soon. Called also with the lock of the forest.
    virtual void wake() = 0;
    [[nodiscard]] virtual Clock::time_point now() const { return Clock::now(); }
  };

  /// New groups that one watcher may begin at once, and in each second after that: an owner makes a
  /// DDS writer for each, which all participants discover. It may have half of all groups.
  static constexpr double kNewAtOnce = 128;
  static constexpr double kNewPerSecond = 20;
  /// Pushes that wait, as far as keep_pending() has made them.
  static constexpr std::size_t kMostPending = 1024;
  /// Edges of all groups together: each takes some 300 bytes.
  static constexpr std::size_t kMostEdges = 262'144;

  /// @param max_groups  watch() rejects further ones with kTooMuch
  Pushes(Forest& forest, std::size_t max_groups, Sink& sink)
      : forest_(forest), max_groups_(max_groups), sink_(sink) {}

  /// Values are no longer noticed. Later watch requests are still answered.
  void stop();

  /// Starts to push to a group, or renews its lease.
  /// @param watcher  who asks; none: this process, which has no limit of its own
  /// @return all current values; kNotOwner, kInvalidInput, kTooMuch.
  [[nodiscard]] Result<PushedValues> watch(std::uint64_t group, const WatchRequest& request,
                                           const std::optional<PeerId>& watcher = {});

  /// How many groups were rejected.
  [[nodiscard]] std::uint64_t refused() const { return refused_; }

  /// Pushes all values to a group: a watcher has only now been matched.
  void tell_all(std::uint64_t group);

  /// Histories are about to be cleared: the next run() first pushes what was written until now to
  /// those that want all samples.
  void keep_pending();

  /// Pushes what was written since the last run, and ends groups that are not renewed. @return when
  /// to run again, unless woken before
  [[nodiscard]] Clock::time_point run();

 private:
  struct Group {
    WatchedGroup watched;
    Clock::time_point lease;
    Clock::time_point due;
    bool all = false;  // must be sent completely once more
    std::optional<PeerId> begun_by{};
    std::optional<Clock::time_point> arrives{};  // a push that tells of a rewritten past
  };
  struct Watcher {
    TokenBucket begins{kNewPerSecond, kNewAtOnce};
    std::size_t groups = 0;  // that it has begun
    Clock::time_point last{};
  };

  [[nodiscard]] Result<void> check_room(const WatchRequest& request,
                                        const std::optional<PeerId>& watcher)
      TFDUDE_REQUIRES(mutex_);
  void forget_idle_watchers(Clock::time_point now) TFDUDE_REQUIRES(mutex_);

  void await_arrival(Group& group) TFDUDE_REQUIRES(mutex_);
  void end(std::map<std::uint64_t, Group>::iterator& group) TFDUDE_REQUIRES(mutex_);
  /// The values to send now.
  /// @param next  gets the time when there may be more without another commit
  [[nodiscard]] std::vector<PushedValues> take_due(Clock::time_point now,
                                                   std::vector<std::uint64_t>& ended,
                                                   Clock::time_point& next);

  Forest& forest_;
  const std::size_t max_groups_;
  Sink& sink_;
  std::atomic<std::uint64_t> refused_{0};
  Mutex mutex_{LockRank::kParts};
  std::map<std::uint64_t, Group> groups_ TFDUDE_GUARDED_BY(mutex_);
  std::map<PeerId, Watcher> watchers_ TFDUDE_GUARDED_BY(mutex_);
  std::size_t edges_ TFDUDE_GUARDED_BY(mutex_) = 0;             // of all groups
  std::vector<std::uint64_t> ended_ TFDUDE_GUARDED_BY(mutex_);  // whose end is not reported yet
  std::vector<PushedValues> pending_ TFDUDE_GUARDED_BY(mutex_);
  bool stopped_ TFDUDE_GUARDED_BY(mutex_) = false;
};

}  // namespace tfdude
