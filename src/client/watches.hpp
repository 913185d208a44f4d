#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <set>
#include <string>
#include <thread>
#include <unordered_map>
#include <vector>

#include "tfdude/client/client.hpp"
#include "tfdude/partition/routing.hpp"

namespace tfdude {

/// One watched path: a forest of its own with the path's edges, written as their owners push them and read without a
/// lock.
class WatchedPath {
 public:
  WatchedPath(std::string a, std::string b, WatchOptions options);

  [[nodiscard]] Result<StampedTransform> lookup(const Query& query) const;

  [[nodiscard]] Result<void> health() const;
  [[nodiscard]] std::uint64_t messages() const { return messages_.load(std::memory_order_relaxed); }
  [[nodiscard]] bool wait_for_more(std::uint64_t messages,
                                   std::chrono::steady_clock::time_point deadline) const;
  /// Waits until the path is followed; else says why not, at the deadline.
  [[nodiscard]] Result<void> wait_until_live(std::chrono::steady_clock::time_point deadline) const;

  [[nodiscard]] const std::string& a() const { return a_; }
  [[nodiscard]] const std::string& b() const { return b_; }
  [[nodiscard]] const WatchOptions& options() const { return options_; }

  // --- for Watches, from one thread ---

  /// A part of the path that one owner pushes.
  struct Source {
    std::string partition;
    std::uint64_t incarnation = 0;
    std::uint64_t group = 0;
    std::vector<std::string> frames;  ///< of the mirror, by the entries' indices
  };
  /// How the path lies: what the mirror is to hold, and who sends it.
  struct Route {
    std::vector<FrameInfo> edges;  ///< of the mirror
    std::vector<Source> sources;
    std::vector<Part> parts;  ///< a WatchRequest for each source
  };
  [[nodiscard]] bool live() const { return live_.load(std::memory_order_acquire); }
  [[nodiscard]] bool follows(const Route& route) const;
  /// From now on along this route, with these values to begin with.
  void follow(const Route& route, const std::vector<State>& values);
  /// Why there is no answer for now.
  void interrupt(Error why);
  /// Whether all owners are there.
  void set_health(Result<void> health);
  [[nodiscard]] const std::vector<Source>& sources() const { return route_.sources; }

  // --- from any thread ---

  void apply(const State& state);

 private:
  void write(const Source& source, const State& state);
  void write(const std::string& frame, const News& entry);
  void tie(const std::string& frame, const Correlation& correlation);
  void rebuild(const Route& route);

  const std::string a_;
  const std::string b_;
  const WatchOptions options_;
  Forest mirror_;
  std::unordered_map<std::string, Correlation> ties_;  // of the mirror's edges
  std::atomic<bool> live_{false};
  std::atomic<std::uint64_t> messages_{0};
  mutable std::condition_variable changed_;  // messages_, live_
  mutable std::mutex mutex_;                 // of the rest; route_ is changed by one thread only
  Route route_;
  Error why_not_;
  Result<void> health_;
};

/// The paths that a participant watches, and the thread that tells their owners so, again and again: that is how an
/// owner that has restarted knows of them, and what was lost is made good.
class Watches {
 public:
  /// What it needs of the participant.
  struct Links {
    /// How the path lies now. @return as Client::lookup
    std::function<Result<WatchedPath::Route>(const WatchedPath&)> plan;
    std::function<std::vector<Reply>(std::vector<Part>&)> ask;
    std::function<Result<void>(std::uint64_t group)> open;
    std::function<void(std::uint64_t group)> close;
  };

  explicit Watches(Links links);
  ~Watches() { stop(); }
  Watches(const Watches&) = delete;
  Watches& operator=(const Watches&) = delete;

  /// The paths get nothing new from now on, and say so.
  void stop();

  /// @return the path; watched as long as somebody else has it
  [[nodiscard]] std::shared_ptr<WatchedPath> watch(const std::string& a, const std::string& b,
                                                   const WatchOptions& options);

  /// What was pushed.
  void on_state(const State& state);

  /// The structure has changed, or who is there.
  void look_again();

 private:
  using Clock = std::chrono::steady_clock;

  void run();
  /// @return whether it is as it should be; else it is to be tried again soon
  bool attend(WatchedPath& path, bool renew);
  void close_unused(const std::vector<std::shared_ptr<WatchedPath>>& paths);

  const Links links_;
  std::set<std::uint64_t> open_;  // groups; only the thread's
  std::mutex mutex_;              // of the rest
  std::condition_variable changed_;
  std::vector<std::shared_ptr<WatchedPath>> paths_;
  bool asked_ = false;
  bool stopping_ = false;
  std::thread thread_;  // last: it uses the rest
};

}  // namespace tfdude
