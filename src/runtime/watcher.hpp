#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "base/mutex.hpp"
#include "runtime/discovery.hpp"
#include "runtime/group_readers.hpp"
#include "runtime/partition_watches.hpp"
#include "runtime/requests.hpp"
#include "runtime/structure.hpp"
#include "runtime/watches.hpp"
#include "transport/port.hpp"

namespace tfdude {

/// The watcher's side of pushed values: plans watched paths according to the structure, and passes
/// values to them.
/// @par Thread safety  All functions are thread-safe.
class Watcher {
 public:
  /// @param incarnation  of the own partition
  /// @param timeout  for the answers of all owners of a path
  Watcher(Structure& structure, Discovery& discovery, Requests& requests, Transport& transport,
          std::function<std::uint64_t()> incarnation, Milliseconds timeout)
      : structure_(structure),
        discovery_(discovery),
        requests_(requests),
        readers_(transport),
        incarnation_(std::move(incarnation)),
        timeout_(timeout) {}

  /// After it has returned the paths get nothing new. Call from one thread; watch() must not be
  /// called afterwards.
  void stop();

  /// @return as Client::watch()
  [[nodiscard]] Result<std::shared_ptr<WatchedPath>> watch(const std::string& a,
                                                           const std::string& b,
                                                           const WatchOptions& options);

  /// @return as Client::watch_edges()
  [[nodiscard]] Result<std::shared_ptr<WatchedPath>> watch_edges(
      const std::vector<std::string>& frames, const WatchOptions& options);

  /// @return as Client::watch_partition()
  [[nodiscard]] Result<std::shared_ptr<FollowedPartition>> watch_partition(
      const std::string& partition, double rate, FollowedPartition::Listener listener);

  /// Applies pushed values. @return whether a path here needs them
  bool on_pushed(const PushedValues& pushed);

  /// Whether pushed values of a watched path suffice for this lookup.
  [[nodiscard]] bool can_answer(const std::string& a, const std::string& b,
                                const Query& query) const;

  /// What a plan would find has changed.
  void look_again();

 private:
  [[nodiscard]] Watches& watches();
  [[nodiscard]] Result<std::shared_ptr<WatchedPath>> follow(std::shared_ptr<WatchedPath> path,
                                                            const Deadline& deadline);

  [[nodiscard]] PartitionWatches& partition_watches();
  [[nodiscard]] Result<WatchRoute> plan(const WatchedPath& path);
  [[nodiscard]] Result<PartitionPlan> plan(const FollowedPartition& partition);
  /// kTimeout, naming the owners.
  [[nodiscard]] tl::unexpected<Error> unanswered(const WatchedPath& path, const Deadline& deadline);

  Structure& structure_;
  Discovery& discovery_;
  Requests& requests_;
  GroupReaders readers_;
  const std::function<std::uint64_t()> incarnation_;
  const Milliseconds timeout_;
  Mutex mutex_;                                                 // guards the creation of these
  std::unique_ptr<Watches> watches_ TFDUDE_GUARDED_BY(mutex_);  // once this process watches a path
  std::atomic<Watches*> watching_{nullptr};
  std::unique_ptr<PartitionWatches> partition_watches_
      TFDUDE_GUARDED_BY(mutex_);  // once it watches a partition
  std::atomic<PartitionWatches*> watching_partitions_{nullptr};
};

}  // namespace tfdude
