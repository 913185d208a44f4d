#pragma once

#include <atomic>
#include <memory>
#include <string>
#include <vector>

#include "base/loop.hpp"
#include "runtime/context.hpp"
#include "runtime/watch_rounds.hpp"
#include "runtime/watched_partition.hpp"
#include "runtime/watched_path.hpp"

namespace tfdude {

/// The watcher's side of pushed values: begins watches, passes values to them, and runs their
/// rounds as a job that waits for the replies.
/// @par Thread safety  All functions are thread-safe, for callers that hold no lock.
class WatchClient final : private WatchLink {
 public:
  /// @param memory  of others, for paths of owners on this computer; null: all push
  explicit WatchClient(const Context& context, MemoryReads* memory = nullptr);
  ~WatchClient() override { stop(); }
  WatchClient(const WatchClient&) = delete;
  WatchClient& operator=(const WatchClient&) = delete;

  /// Before stop(): calls that wait for what is watched return now, and those that follow at once.
  void end_waits() { rounds_.end_waits(); }

  /// After it has returned nothing new comes. Call from one thread; nothing may be watched
  /// afterwards.
  void stop();

  /// Looks at the memory that paths are read from: something may have been committed there.
  Watched::Looked look() const { return rounds_.look(Loop::Clock::now()); }

  /// @return as Client::watch()
  [[nodiscard]] Result<std::shared_ptr<WatchedPath>> watch(const std::string& a,
                                                           const std::string& b,
                                                           const WatchOptions& options);

  /// @return as Client::watch_edges()
  [[nodiscard]] Result<std::shared_ptr<WatchedPath>> watch_edges(
      const std::vector<std::string>& frames, const WatchOptions& options);

  /// @return as Client::watch_partition()
  [[nodiscard]] Result<std::shared_ptr<WatchedPartition>> watch_partition(
      const std::string& partition, double rate, WatchedPartition::Listener listener);

  /// Applies pushed values. @return whether a path here may need them
  bool on_pushed(const PushedValues& pushed);

  /// Whether pushed values of a watched path suffice for this lookup.
  [[nodiscard]] bool can_answer(const std::string& a, const std::string& b,
                                const Query& query) const {
    return rounds_.can_answer(a, b, query);
  }

  /// What a plan would find has changed.
  void look_again() {
    if (rounds_.look_again()) job_.ask();
  }

 private:
  // WatchLink
  [[nodiscard]] Result<void> plan(Watched& watched) override;
  [[nodiscard]] Result<void> open(const std::string& partition, std::uint64_t group) override {
    return context_.transport.watch(partition, group);
  }
  void close(std::uint64_t group) override { context_.transport.unwatch(group); }

  void add(std::shared_ptr<Watched> watched);
  [[nodiscard]] Loop::Clock::time_point round();
  /// Lets the owners, and this process, wake the paths that are read from their memory.
  void wait_for_commits();
  [[nodiscard]] Result<std::shared_ptr<WatchedPath>> follow(std::shared_ptr<WatchedPath> path,
                                                            const Deadline& deadline);
  [[nodiscard]] Result<WatchRoute> route_of(const WatchedPath& path);
  /// kTimeout, naming the owners.
  [[nodiscard]] tl::unexpected<Error> unanswered(const WatchedPath& path, const Deadline& deadline);

  const Context context_;
  const std::shared_ptr<Callbacks::Line> routes_;
  MemoryReads* const memory_;
  std::atomic<bool> watches_paths_{false};  // or has watched one before
  WatchRounds rounds_;
  bool hears_own_ = false;  // of own commits; belongs to the rounds
  // Last: they use the other members.
  Loop::Job look_job_;  // after own commits
  Loop::Job job_;
};

}  // namespace tfdude
