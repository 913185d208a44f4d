#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "tfdude/types/options.hpp"

#include "base/mutex.hpp"
#include "runtime/watch_mirror.hpp"

namespace tfdude {

/// One watched path. It shows the mirror of one route, which readers find by one load. Where the path takes another
/// route, that has a mirror of its own, which is shown instead once it has all values; readers of the one before have it
/// until they are done (epoch.hpp).
class WatchedPath {
 public:
  using Clock = std::chrono::steady_clock;

  WatchedPath(std::string a, std::string b, WatchOptions options);
  ~WatchedPath();
  WatchedPath(const WatchedPath&) = delete;
  WatchedPath& operator=(const WatchedPath&) = delete;

  // --- from any thread ---

  /// No lock or allocation, but where the path is not followed.
  [[nodiscard]] Result<StampedTransform> lookup(const Query& query) const;

  [[nodiscard]] Result<void> health() const;
  [[nodiscard]] std::uint64_t messages() const { return messages_.load(std::memory_order_relaxed); }
  [[nodiscard]] bool wait_for_more(std::uint64_t messages, Clock::time_point deadline) const;
  /// Waits until the path is followed, and its moving edges have an instant in common; in vain for the latter is no error.
  /// @return why it is not followed, at the deadline
  [[nodiscard]] Result<void> wait_until_live(Clock::time_point deadline) const;

  [[nodiscard]] const std::string& a() const { return a_; }
  [[nodiscard]] const std::string& b() const { return b_; }
  [[nodiscard]] const WatchOptions& options() const { return options_; }

  /// What has come of pushed values.
  struct Taken {
    bool rerouted = false;  ///< another route is shown from now on
    bool lacks = false;     ///< something is to be asked for
  };
  Taken take(const PushedValues& pushed);

  // --- for Watches, from one thread ---

  [[nodiscard]] bool live() const { return shown_.load(std::memory_order_acquire) != nullptr; }
  /// Whether that is the way it takes, or is about to.
  [[nodiscard]] bool follows(const WatchRoute& route) const;
  /// Prepares another route. @return whether it is shown already, as it needs no values
  bool prepare(WatchRoute route);
  /// Whether the route is shown with all that its owners have told, as far as that can be had.
  [[nodiscard]] bool up_to_date() const;
  /// See WatchMirror::lacks_history(); asked for a few times only, as nobody may know.
  [[nodiscard]] std::optional<Time> lacks_history();
  /// Why there is no answer for now.
  void interrupt(Error why);
  /// Whether this says that the path does not exist any more. News of a move may come before those of where to.
  [[nodiscard]] bool is_gone(const Error& error, Clock::time_point now);
  /// Whether all owners are there.
  void set_health(Result<void> health);
  [[nodiscard]] std::size_t edge_count() const;
  /// The groups of which it needs values.
  [[nodiscard]] std::set<std::uint64_t> groups() const;
  /// Gives back mirrors that nobody reads any more.
  void collect();

 private:
  struct Retired {
    std::uint64_t tag;
    std::unique_ptr<const WatchMirror> mirror;
  };

  [[nodiscard]] bool swap_if_ready() TFDUDE_REQUIRES(mutex_);
  void show(std::unique_ptr<WatchMirror> mirror) TFDUDE_REQUIRES(mutex_);
  [[nodiscard]] bool has_common_instant() const TFDUDE_REQUIRES(mutex_);

  const std::string a_;
  const std::string b_;
  const WatchOptions options_;
  std::atomic<const WatchMirror*> shown_{nullptr};  // followed_, as readers see it
  std::atomic<std::uint64_t> messages_{0};
  mutable Condition changed_;  // messages_, shown_
  mutable Mutex mutex_;        // of the rest
  std::unique_ptr<WatchMirror> followed_ TFDUDE_GUARDED_BY(mutex_);
  std::unique_ptr<WatchMirror> next_
      TFDUDE_GUARDED_BY(mutex_);  // to be shown once it has all values
  Clock::time_point next_since_ TFDUDE_GUARDED_BY(mutex_);
  int asked_for_history_ TFDUDE_GUARDED_BY(mutex_) = 0;
  bool was_shown_ TFDUDE_GUARDED_BY(mutex_) = false;
  std::vector<Retired> retired_ TFDUDE_GUARDED_BY(mutex_);
  std::optional<Clock::time_point> not_connected_since_ TFDUDE_GUARDED_BY(mutex_);
  Error why_not_ TFDUDE_GUARDED_BY(mutex_);
  Result<void> health_ TFDUDE_GUARDED_BY(mutex_);
};

}  // namespace tfdude
