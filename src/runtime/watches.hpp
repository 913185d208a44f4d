#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "base/mutex.hpp"
#include "runtime/notices.hpp"
#include "runtime/open_groups.hpp"
#include "runtime/watched_path.hpp"

namespace tfdude {

/// The paths that a participant watches, and the thread that tells their owners so, again and again: that is how an
/// owner that has restarted knows of them, and what was lost is made good.
class Watches {
 public:
  /// What it needs of the participant.
  struct Links {
    /// How the path lies now. @return as Client::lookup
    std::function<Result<WatchRoute>(const WatchedPath&)> plan;
    std::function<std::vector<Reply>(std::vector<Part>&)> ask;
    std::function<Result<void>(std::uint64_t group)> open;
    std::function<void(std::uint64_t group)> close;
  };

  explicit Watches(Links links);
  ~Watches() { stop(); }
  Watches(const Watches&) = delete;
  Watches& operator=(const Watches&) = delete;

  /// The paths get nothing new from now on, and say so; nobody is called any more.
  void stop();

  /// @return the path; watched as long as somebody else has it
  [[nodiscard]] std::shared_ptr<WatchedPath> watch(const std::string& a, const std::string& b,
                                                   const WatchOptions& options);

  /// What was pushed.
  void on_pushed(const PushedValues& pushed);

  /// Whether a path that is watched could be looked up so from what has been pushed.
  [[nodiscard]] bool can_answer(const std::string& a, const std::string& b,
                                const Query& query) const;

  /// The structure has changed, or who is there.
  void look_again();

 private:
  using Clock = std::chrono::steady_clock;
  using Path = std::shared_ptr<WatchedPath>;

  void run();
  void wait(Lock& lock, Clock::time_point renew_at) TFDUDE_REQUIRES(mutex_);
  /// @return whether it is as it should be; else it is to be tried again soon
  bool attend(const Path& path, bool renew);
  bool cannot_be_planned(const Path& path, Error why);
  /// Asks the owners for all values, or samples from an instant on. @return whether all have answered
  bool ask(const Path& path, WatchRoute& route, std::optional<Time> from);
  void tell(const Path& path, std::string what);
  void tell_rerouted(const Path& path);
  void close_unused(const std::vector<Path>& paths);

  const Links links_;
  Notices notices_;
  OpenGroups open_;  // only the thread's
  mutable Mutex mutex_;
  Condition changed_;
  std::vector<Path> paths_ TFDUDE_GUARDED_BY(mutex_);
  bool asked_ TFDUDE_GUARDED_BY(mutex_) = false;
  bool lacking_ TFDUDE_GUARDED_BY(mutex_) = false;            // a path is not as it should be
  Clock::time_point last_round_ TFDUDE_GUARDED_BY(mutex_){};  // when paths were looked at
  bool stopping_ TFDUDE_GUARDED_BY(mutex_) = false;
  std::thread thread_;  // last: it uses the rest
};

}  // namespace tfdude
