#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "base/mutex.hpp"
#include "runtime/notices.hpp"
#include "runtime/open_groups.hpp"
#include "runtime/renewal_loop.hpp"
#include "runtime/watched_path.hpp"

namespace tfdude {

/// The paths that a participant watches, and the thread that renews them at their owners
/// periodically. So an owner that has restarted learns of them, and lost values are sent again.
class Watches {
 public:
  /// What it needs of the participant.
  struct Links {
    /// The current route of the path. @return as Client::lookup()
    std::function<Result<WatchRoute>(const WatchedPath&)> plan;
    std::function<std::vector<Reply>(std::vector<Part>&)> ask;
    std::function<Result<void>(const std::string& owner, std::uint64_t group)> open;
    std::function<void(std::uint64_t group)> close;
  };

  explicit Watches(Links links);
  ~Watches() { stop(); }
  Watches(const Watches&) = delete;
  Watches& operator=(const Watches&) = delete;

  /// After it has returned the paths get nothing new, and report so; no callback runs.
  void stop();

  /// The path is watched while it has another holder.
  void watch(std::shared_ptr<WatchedPath> path);

  /// Applies pushed values.
  void on_pushed(const PushedValues& pushed);

  /// Whether pushed values of a watched path suffice for this lookup.
  [[nodiscard]] bool can_answer(const std::string& a, const std::string& b,
                                const Query& query) const;

  /// What a plan would find has changed.
  void look_again() { rounds_.ask(); }

 private:
  using Clock = std::chrono::steady_clock;
  using Path = std::shared_ptr<WatchedPath>;

  /// @return whether all are up to date
  bool attend_all(bool renew);
  /// @return whether it is up to date; otherwise it must be retried soon
  bool attend(const Path& path, bool renew);
  bool follow(const Path& path, WatchRoute& route, bool renew);
  bool cannot_be_planned(const Path& path, Error why);
  /// Requests all values from the owners, or samples from an instant on. @return whether all have
  /// answered
  bool ask(const Path& path, WatchRoute& route, std::optional<Time> from);
  void tell(const Path& path, std::string what);
  void tell_rerouted(const Path& path);
  void close_unused(const std::vector<Path>& paths);

  const Links links_;
  Notices notices_;
  OpenGroups open_;  // used by the thread only
  mutable Mutex mutex_{LockRank::kParts};
  std::vector<Path> paths_ TFDUDE_GUARDED_BY(mutex_);
  RenewalLoop rounds_;  // last: its thread uses the other members
};

}  // namespace tfdude
