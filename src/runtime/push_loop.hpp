#pragma once

#include <atomic>
#include <cstdint>
#include <map>
#include <vector>

#include "base/loop.hpp"
#include "base/mutex.hpp"
#include "partition/watching.hpp"
#include "tree/forest.hpp"

namespace tfdude {

/// Pushes values written to an owner's edges to their watchers, as a job of a loop. The job sleeps
/// while nobody watches: an update then costs one additional check of a pointer.
class PushLoop {
 public:
  using Clock = Loop::Clock;

  /// Where values go. Called by the loop, without a lock.
  class Sink {
   public:
    virtual ~Sink() = default;
    /// @param values  or a piece of them
    virtual void push(const PushedValues& values) = 0;
    /// Frees the resources of pushing to a group.
    virtual void end(std::uint64_t group) = 0;
  };

  /// @param max_groups  watch() rejects further ones with kTooMuch
  PushLoop(Loop& loop, Forest& forest, std::size_t max_groups, Sink& sink);
  ~PushLoop() { stop(); }
  PushLoop(const PushLoop&) = delete;
  PushLoop& operator=(const PushLoop&) = delete;

  /// Ends pushing. Later watch requests are still answered.
  void stop();

  /// Starts to push to a group, or renews its lease. @return all current values; kNotOwner,
  /// kInvalidInput, kTooMuch.
  [[nodiscard]] Result<PushedValues> watch(std::uint64_t group, const WatchRequest& request);

  /// How many groups were rejected.
  [[nodiscard]] std::uint64_t refused() const { return refused_; }

  /// Pushes all values to a group: a watcher has only now been matched.
  void tell_all(std::uint64_t group);

 private:
  struct Group {
    WatchedGroup watched;
    Clock::time_point lease;
    Clock::time_point due;
    bool all = false;  // must be sent completely once more
  };

  [[nodiscard]] Clock::time_point run();
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
  Loop::Job pushes_;  // last: it uses the other members
};

}  // namespace tfdude
