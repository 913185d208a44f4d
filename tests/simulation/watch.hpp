#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>

#include "calls/pending_requests.hpp"
#include "runtime/watched_path.hpp"
#include "simulation/timeline.hpp"

namespace tfdude::simulation {

class Process;

/// A watched path of a client, maintained in steps as WatchLoop does it.
class Watch : public std::enable_shared_from_this<Watch> {
 public:
  /// @param shown  called when its value may have changed
  Watch(Process& process, const std::string& a, const std::string& b, std::function<void()> shown)
      : process_(process), path_(a, b, {}), shown_(std::move(shown)) {}

  /// Continues as long as it has a holder.
  void start() { attend(); }

  /// Answers from pushed values; no answer if the path was never live.
  [[nodiscard]] Result<StampedTransform> read() const { return path_.lookup({}); }

  /// The groups whose values it needs.
  [[nodiscard]] std::set<std::uint64_t> groups() { return path_.groups({}); }

  // ---- input from the process
  /// Replies may have come.
  void go_on();
  /// @param from  the process that has pushed it; @param number  it counts what it pushes
  void on_pushed(std::uint64_t from, std::uint64_t number, const PushedValues& pushed);

 private:
  void attend();
  void look();
  void ask(WatchRoute route);
  void step();
  void answered(const Reply& reply, const WatchRoute::Source& source);
  void open(const WatchRoute::Source& source);
  void take(const PushedValues& pushed);
  [[nodiscard]] TimeLimit::Clock::time_point now() const;

  Process& process_;
  WatchedPath path_;
  const std::function<void()> shown_;
  std::set<std::uint64_t> opened_;        // groups; some listen only a moment later
  std::set<std::uint64_t> heard_;         // that listen
  std::optional<WatchRoute> route_;       // whose owners are asked
  std::optional<PendingRequests> asked_;  // until all have answered
  std::uint64_t asks_ = 0;
  std::map<std::uint64_t, std::uint64_t> newest_;  // numbers of what was pushed, by process
  TimeLimit::Clock::time_point renew_at_{};
  std::optional<std::uint64_t> routed_by_;  // the inputs of the process by which its route is known
};

}  // namespace tfdude::simulation
