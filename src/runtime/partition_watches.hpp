#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/mutex.hpp"
#include "runtime/followed_partition.hpp"
#include "runtime/open_groups.hpp"
#include "runtime/renewal_loop.hpp"

namespace tfdude {

/// The partitions that a participant watches, and the thread that renews the watches at their
/// owners, as Watches does for paths.
class PartitionWatches {
 public:
  /// What it needs of the participant.
  struct Links {
    std::function<Result<PartitionPlan>(const FollowedPartition&)> plan;
    std::function<std::vector<Reply>(std::vector<Part>&)> ask;
    std::function<Result<void>(const std::string& owner, std::uint64_t group)> open;
    std::function<void(std::uint64_t group)> close;
  };

  explicit PartitionWatches(Links links);
  ~PartitionWatches() { stop(); }
  PartitionWatches(const PartitionWatches&) = delete;
  PartitionWatches& operator=(const PartitionWatches&) = delete;

  /// After it has returned there is no more news.
  void stop();

  /// The partition is watched until FollowedPartition::stop().
  void add(std::shared_ptr<FollowedPartition> partition);
  void on_pushed(const PushedValues& pushed);
  /// What a plan would find has changed.
  void look_again() { rounds_.ask(); }

 private:
  using Clock = std::chrono::steady_clock;
  using Followed = std::shared_ptr<FollowedPartition>;

  /// @return whether nothing is missing
  bool attend_all(bool renew);
  /// @return whether nothing is missing
  bool attend(const Followed& partition, bool renew);
  bool ask(const Followed& partition, std::vector<Part> parts, std::optional<Time> from);
  void close_unused(const std::vector<Followed>& partitions);

  const Links links_;
  OpenGroups open_;  // used by the thread only
  Mutex mutex_{LockRank::kParts};
  std::vector<Followed> partitions_ TFDUDE_GUARDED_BY(mutex_);
  RenewalLoop rounds_;  // last: its thread uses the other members
};

}  // namespace tfdude
