#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <thread>
#include <vector>

#include "base/mutex.hpp"
#include "partition/watching.hpp"
#include "tree/forest.hpp"

namespace tfdude {

/// Pushes values written to an owner's edges to their watchers, from its own thread. The thread
/// sleeps while nobody watches: an update then costs one additional check of a pointer.
class Pusher {
 public:
  using Clock = std::chrono::steady_clock;
  using Push = std::function<void(const PushedValues&)>;
  using End = std::function<void(std::uint64_t group)>;

  /// @param push  gets values, or a piece of them
  /// @param end   frees the resources of pushing to a group. Both are called from the thread,
  ///   without a lock.
  /// @param max_groups  watch() rejects further ones with kTooMuch
  Pusher(Forest& forest, std::size_t max_groups, Push push, End end);
  ~Pusher() { stop(); }
  Pusher(const Pusher&) = delete;
  Pusher& operator=(const Pusher&) = delete;

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

  void run();
  void ask();
  void end(std::map<std::uint64_t, Group>::iterator& group) TFDUDE_REQUIRES(groups_mutex_);
  /// The values to send now, and when there may be more without another commit.
  [[nodiscard]] std::vector<PushedValues> take_due(Clock::time_point now,
                                                   std::vector<std::uint64_t>& ended,
                                                   std::optional<Clock::time_point>& next);

  Forest& forest_;
  const std::size_t max_groups_;
  std::atomic<std::uint64_t> refused_{0};
  const Push push_;
  const End end_;
  Mutex groups_mutex_{LockRank::kParts};
  std::map<std::uint64_t, Group> groups_ TFDUDE_GUARDED_BY(groups_mutex_);
  std::vector<std::uint64_t> ended_
      TFDUDE_GUARDED_BY(groups_mutex_);  // whose end is not reported yet
  std::atomic<bool> asked_{false};
  Mutex mutex_;  // for the wait; taken with the forest's lock held
  Condition changed_;
  bool stopping_ TFDUDE_GUARDED_BY(mutex_) = false;
  std::thread thread_;  // last: it uses the other members
};

}  // namespace tfdude
