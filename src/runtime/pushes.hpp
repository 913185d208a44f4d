#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <map>
#include <vector>

#include "base/mutex.hpp"
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

  /// @param max_groups  watch() rejects further ones with kTooMuch
  Pushes(Forest& forest, std::size_t max_groups, Sink& sink)
      : forest_(forest), max_groups_(max_groups), sink_(sink) {}

  /// Values are no longer noticed. Later watch requests are still answered.
  void stop();

  /// Starts to push to a group, or renews its lease. @return all current values; kNotOwner,
  /// kInvalidInput, kTooMuch.
  [[nodiscard]] Result<PushedValues> watch(std::uint64_t group, const WatchRequest& request);

  /// How many groups were rejected.
  [[nodiscard]] std::uint64_t refused() const { return refused_; }

  /// Pushes all values to a group: a watcher has only now been matched.
  void tell_all(std::uint64_t group);

  /// Pushes what was written since the last run, and ends groups that are not renewed. @return when
  /// to run again, unless woken before
  [[nodiscard]] Clock::time_point run();

 private:
  struct Group {
    WatchedGroup watched;
    Clock::time_point lease;
    Clock::time_point due;
    bool all = false;  // must be sent completely once more
  };

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
  std::vector<std::uint64_t> ended_ TFDUDE_GUARDED_BY(mutex_);  // whose end is not reported yet
  bool stopped_ TFDUDE_GUARDED_BY(mutex_) = false;
};

}  // namespace tfdude
