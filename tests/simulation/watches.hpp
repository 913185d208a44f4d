#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "runtime/watch_rounds.hpp"
#include "runtime/watched_path.hpp"

namespace tfdude::simulation {

class Process;

/// What a process watches: runs the library's WatchRounds, as WatchClient does it on a thread, but
/// with events instead of waits.
class Watches : private WatchLink {
 public:
  explicit Watches(Process& process);

  /// Watched while it has another holder.
  /// @param shown  called when its value may have changed
  void add(const std::shared_ptr<WatchedPath>& path, std::function<void()> shown);

  // ---- input from the process
  /// What a plan would find has changed.
  void look_again();
  /// Replies may have come.
  void go_on();
  /// @param from  the process that has pushed it; @param number  it counts what it pushes
  void on_pushed(std::uint64_t from, std::uint64_t number, const PushedValues& pushed);

  /// The groups that it listens to, also those of a path that an owner denies for now.
  [[nodiscard]] const std::set<std::uint64_t>& opened() const { return opened_; }

 private:
  using Clock = WatchRounds::Clock;

  // WatchLink
  [[nodiscard]] Result<void> plan(Watched& watched) override;
  [[nodiscard]] Result<void> open(const std::string& partition, std::uint64_t group) override;
  void close(std::uint64_t group) override;

  void ask_by(Clock::time_point time);
  void wake();
  void step();
  void show();
  void send();
  [[nodiscard]] Clock::time_point now() const;

  Process& process_;
  WatchRounds rounds_;
  std::vector<std::pair<std::weak_ptr<WatchedPath>, std::function<void()>>> shown_;
  std::set<std::uint64_t> opened_;                 // groups; some listen only a moment later
  std::set<std::uint64_t> heard_;                  // that listen
  std::map<std::uint64_t, std::uint64_t> newest_;  // numbers of what was pushed, by process
  PendingRequests* asked_ = nullptr;               // by the round in progress
  std::uint64_t asks_ = 0;
  bool in_round_ = false;
  Clock::time_point due_ = WatchRounds::kNever;  // the next round
};

}  // namespace tfdude::simulation
