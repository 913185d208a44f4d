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

/// Pushes what is written to an owner's edges to those who watch them, from a thread of its own, which sleeps while
/// nobody watches: then an update costs one look at a pointer more.
class Pusher {
 public:
  using Clock = std::chrono::steady_clock;
  using Push = std::function<void(const PushedValues&)>;
  using End = std::function<void(std::uint64_t group)>;

  /// @param push  is handed values, or a piece of them
  /// @param end   gives back what pushing to a group has taken. Both are called from the thread, without a lock.
  Pusher(Forest& forest, Push push, End end);
  ~Pusher() { stop(); }
  Pusher(const Pusher&) = delete;
  Pusher& operator=(const Pusher&) = delete;

  /// Nothing is pushed any more. Who asks to watch then is answered still.
  void stop();

  /// Begins to push to a group, or goes on for another lease. @return all values now; kNotOwner, kInvalidInput.
  [[nodiscard]] Result<PushedValues> watch(std::uint64_t group, const WatchRequest& request);

  /// Pushes all values to a group: somebody has only now begun to listen.
  void tell_all(std::uint64_t group);

 private:
  struct Group {
    WatchedGroup watched;
    Clock::time_point lease;
    Clock::time_point due;
    bool all = false;  // is to be told once more
  };

  void run();
  void ask();
  void end(std::map<std::uint64_t, Group>::iterator& group) TFDUDE_REQUIRES(groups_mutex_);
  /// What is to be sent now, and when there may be more without another commit.
  [[nodiscard]] std::vector<PushedValues> take_due(Clock::time_point now,
                                                   std::vector<std::uint64_t>& ended,
                                                   std::optional<Clock::time_point>& next);

  Forest& forest_;
  const Push push_;
  const End end_;
  Mutex groups_mutex_;
  std::map<std::uint64_t, Group> groups_ TFDUDE_GUARDED_BY(groups_mutex_);
  std::vector<std::uint64_t> ended_
      TFDUDE_GUARDED_BY(groups_mutex_);  // whose end is still to be told
  std::atomic<bool> asked_{false};
  Mutex mutex_;  // of the wait; taken with the forest's lock held
  Condition changed_;
  bool stopping_ TFDUDE_GUARDED_BY(mutex_) = false;
  std::thread thread_;  // last: it uses the rest
};

}  // namespace tfdude
