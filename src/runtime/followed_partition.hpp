#pragma once

#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "tfdude/types/partition_news.hpp"

#include "base/mutex.hpp"
#include "partition/routing.hpp"
#include "partition/watching.hpp"
#include "runtime/notices.hpp"

namespace tfdude {

/// The frames of a partition, and the requests that watch its edges.
struct PartitionPlan {
  /// Edges that the owner pushes together.
  struct Group {
    std::uint64_t id = 0;
    std::vector<std::uint32_t> frames;  ///< by the entries' indices
    Part part;
  };
  std::uint64_t incarnation = 0;
  std::vector<WatchedFrame> frames;
  std::vector<Group> groups;
};

/// The plan for a partition as it is now.
/// @param most  edges in a group
/// @return kUnknownPartition, kUnreachable
[[nodiscard]] Result<PartitionPlan> plan_partition(const Forest& forest, const Directory& directory,
                                                   const std::string& partition,
                                                   std::chrono::nanoseconds period,
                                                   std::uint64_t own_incarnation, std::size_t most);

/// One watched partition: turns what its owner pushes into news. If the frames change, the groups
/// of the plan before stay until those of the new one have answered, so that nothing is left out.
/// @par Thread safety  All functions are thread-safe.
class FollowedPartition {
 public:
  using Clock = std::chrono::steady_clock;
  using Listener = std::function<void(const PartitionNews&)>;

  /// How many values may wait for the listener.
  static constexpr std::size_t kMostWaiting = 100'000;
  /// How long the groups of the plan before stay once the new ones have answered: DDS may match
  /// their readers later.
  static constexpr Milliseconds kKeepBefore{1000};
  /// How long after their answer all samples are requested repeatedly, if all are wanted.
  static constexpr Milliseconds kSettle{400};

  FollowedPartition(std::string name, std::chrono::nanoseconds period, Listener listener);

  [[nodiscard]] const std::string& name() const { return name_; }
  [[nodiscard]] std::chrono::nanoseconds period() const { return period_; }

  /// Ends it: the listener is not running and will not run, unless it calls this itself.
  void stop();
  [[nodiscard]] bool stopped() const { return stopped_; }

  /// Maximum number of edges in a group: fewer if the owner cannot answer for more at once.
  [[nodiscard]] std::size_t most() const { return most_; }
  void ask_for_less() { most_ = kMaxCorrelated; }

  /// The owner is reachable and has these frames. @return whether they or the groups are new
  bool follow(const PartitionPlan& plan);
  /// The owner does not answer.
  void interrupt(const std::string& why);

  /// Applies pushed values, or the reply to a request. @return whether values are missing
  bool take(const PushedValues& pushed);

  /// Whether values of the plan are missing, or may be because DDS has not matched the readers yet.
  [[nodiscard]] bool lacks(Clock::time_point now) const;
  /// The instant from which samples must be requested if some are missing.
  [[nodiscard]] std::optional<Time> lacks_from() const;
  /// The groups whose values are needed. Those of the plan before end here.
  [[nodiscard]] std::set<std::uint64_t> groups(Clock::time_point now);

 private:
  struct Known {
    std::uint64_t history = 0;  // 0: nothing
    std::uint64_t commit = 0;   // as of which its value is known
    std::optional<Time> newest;
    Transform X;
    Correlation correlation;
    bool cleared = false;
    bool unsampled = false;
  };
  struct Group {
    std::uint64_t id = 0;
    std::vector<std::uint32_t> frames;  // by the entries' indices
    PushedPieces pieces;
    KnownCovariances covariances;
    std::uint64_t complete = 0;  // the owner's commit up to which everything has come
    std::uint64_t replied = 0;   // of the last reply; it has no samples but the newest
    std::uint64_t heard = 0;
    bool outdated = false;
  };
  // How a message continues what is known.
  struct Message {
    bool reply = false;       // all values, with the newest samples only
    bool follows_on = false;  // nothing is missing before it
    std::uint64_t commit = 0;
  };

  [[nodiscard]] Message place(Group& group, const PushedValues& whole, bool knows_all);
  // Appends the value if it is news.
  void admit(const Group& group, PushedValue& entry, const Message& message,
             std::vector<WatchedValue>& values) TFDUDE_REQUIRES(mutex_);
  [[nodiscard]] bool lacks_any() const TFDUDE_REQUIRES(mutex_);
  [[nodiscard]] bool settles(Clock::time_point now) const TFDUDE_REQUIRES(mutex_);
  [[nodiscard]] std::optional<Time> recent() const TFDUDE_REQUIRES(mutex_);
  void carry_over(const PartitionPlan& plan) TFDUDE_REQUIRES(mutex_);
  void post(PartitionNews news, std::size_t values = 0);

  const std::string name_;
  const std::chrono::nanoseconds period_;
  const std::shared_ptr<const Listener> listener_;
  const std::shared_ptr<std::atomic<std::size_t>> waiting_ =
      std::make_shared<std::atomic<std::size_t>>(0);
  std::atomic<bool> stopped_{false};
  std::atomic<std::size_t> most_{kMaxItems};
  mutable Mutex mutex_{LockRank::kWatchedPath};
  bool reachable_ TFDUDE_GUARDED_BY(mutex_) = false;
  std::uint64_t incarnation_ TFDUDE_GUARDED_BY(mutex_) = 0;
  std::vector<WatchedFrame> frames_ TFDUDE_GUARDED_BY(mutex_);
  std::vector<Known> known_ TFDUDE_GUARDED_BY(mutex_);  // by frame
  std::vector<Group> groups_ TFDUDE_GUARDED_BY(mutex_);
  // Samples were missing from this instant on.
  std::optional<Time> missing_from_ TFDUDE_GUARDED_BY(mutex_);
  std::optional<Clock::time_point> answered_ TFDUDE_GUARDED_BY(mutex_);
  Notices notices_;
};

}  // namespace tfdude
