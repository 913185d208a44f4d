#pragma once

#include <atomic>
#include <memory>
#include <string>
#include <vector>

#include "runtime/context.hpp"
#include "runtime/watch_loop.hpp"
#include "runtime/watched_partition.hpp"
#include "runtime/watched_path.hpp"

namespace tfdude {

/// The watcher's side of pushed values: begins watches, and passes values to them.
/// @par Thread safety  All functions are thread-safe.
class WatchClient {
 public:
  explicit WatchClient(const Context& context)
      : context_(context), routes_(context.threads.callbacks.line()), loop_(context) {}

  /// After it has returned nothing new comes. Call from one thread; nothing may be watched
  /// afterwards.
  void stop() { loop_.stop(); }

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
    return loop_.can_answer(a, b, query);
  }

  /// What a plan would find has changed.
  void look_again() { loop_.look_again(); }

 private:
  [[nodiscard]] Result<std::shared_ptr<WatchedPath>> follow(std::shared_ptr<WatchedPath> path,
                                                            const Deadline& deadline);
  /// kTimeout, naming the owners.
  [[nodiscard]] tl::unexpected<Error> unanswered(const WatchedPath& path, const Deadline& deadline);

  const Context context_;
  const std::shared_ptr<Callbacks::Line> routes_;
  std::atomic<bool> watches_paths_{false};  // or has watched one before
  WatchLoop loop_;
};

}  // namespace tfdude
