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
#include <utility>
#include <vector>

#include "tfdude/types/partition_news.hpp"

#include "base/mutex.hpp"
#include "partition/watching.hpp"
#include "runtime/callbacks.hpp"
#include "runtime/missing_samples.hpp"
#include "runtime/told_samples.hpp"
#include "runtime/watched.hpp"

namespace tfdude {

/// One watched partition: turns what its owner pushes into news. If the frames change, the groups
/// of the plan before stay until those of the new one have answered, so that nothing is left out.
/// @par Thread safety  All functions are thread-safe.
class WatchedPartition final : public Watched {
 public:
  using Listener = std::function<void(const PartitionNews&)>;

  /// How many values and frames may wait for the listener.
  static constexpr std::size_t kMostWaiting = 100'000;
  /// How long the groups of the plan before stay once the new ones have answered: DDS may match
  /// their readers later.
  static constexpr Milliseconds kKeepBefore{1000};
  /// How long after their answer all samples are requested repeatedly, if all are wanted.
  static constexpr Milliseconds kSettle{400};

  /// How long news may wait for others if all samples are wanted: to wake the listener less often.
  static constexpr Milliseconds kGather{5};

  /// @param rate  [Hz]; 0: every sample
  /// @param line  calls the listener; of this partition only, with kGather if the rate is 0
  WatchedPartition(std::string name, double rate, Listener listener,
                   std::shared_ptr<Callbacks::Line> line);

  bool take(const PushedValues& pushed, Clock::time_point now) override;
  /// The listener is not running and will not run, unless it calls this itself.
  [[nodiscard]] std::shared_ptr<Callbacks::Line> calls_on() const override {
    return *listener_ ? line_->another() : nullptr;
  }
  void end() override { line_->close(); }

  // --- for the rounds, from one thread ---

  [[nodiscard]] Result<void> plan(const KnownStructure& known) override;
  [[nodiscard]] Plan adopt(Clock::time_point now) override;
  bool on_no_plan(Error why, Clock::time_point now) override;
  bool on_deaf(Error why) override;
  bool on_denied(const Part& part, const Error* why) override;
  void on_complete() override;
  /// Also because DDS may not have matched the readers yet.
  [[nodiscard]] bool lacks(Clock::time_point now) const override;
  [[nodiscard]] std::optional<Time> lacks_from() override;
  void on_told_from(Time from, Clock::time_point now) override;
  /// The groups of the plan before end here.
  [[nodiscard]] std::set<std::uint64_t> groups(Clock::time_point now) override;
  /// A reply has all values of the partition.
  [[nodiscard]] unsigned periods() const override { return 2; }

 private:
  struct Known {
    std::uint64_t history = 0;  // 0: nothing
    std::uint64_t commit = 0;   // as of which its value is known
    std::optional<Time> newest;
    Transform X;
    Correlation said;
    Correlation correlation;  // of its value: of the newest sample alone, or as said
    bool cleared = false;
    bool unsampled = false;
    ToldSamples told;
  };
  struct PlannedGroup {
    std::uint64_t id = 0;
    std::vector<std::uint32_t> frames;  // by the entries' indices
  };
  struct Group : PlannedGroup {
    ReceivedGroup received;
    bool outdated = false;
  };
  struct Planned {
    Owner owner = kHeldHere;
    std::vector<WatchedFrame> frames;
    std::vector<PlannedGroup> groups;
    std::uint64_t incarnation = 0;
  };
  // How a message continues what is known.
  struct Message {
    bool reply = false;       // all values, with the newest samples only
    bool follows_on = false;  // nothing is missing before it
    std::uint64_t commit = 0;
  };

  /// Groups the edges of the planned frames.
  [[nodiscard]] std::vector<Watched::Group> group();
  /// The owner is reachable and has the planned frames. @return whether they or the groups are new
  [[nodiscard]] bool take_over();
  /// Whether groups of the plan before are still pushed, too: each message of them may have several
  /// samples that were told.
  [[nodiscard]] bool is_pushed_twice() const TFDUDE_REQUIRES(mutex_);
  /// Samples from this instant on may come again, or for the first time.
  void misses(Time from) TFDUDE_REQUIRES(mutex_);
  void misses_recent() TFDUDE_REQUIRES(mutex_);
  /// An answer tells only the newest samples, unless it is asked for more. If pushes were lost
  /// before it, those between are missing.
  void note_skipped(const Group& group, const PushedValues& answer) TFDUDE_REQUIRES(mutex_);
  /// Drops from what was told what does not come again.
  void forget_told() TFDUDE_REQUIRES(mutex_);
  /// Whether a value of the known history is news. What an earlier commit had at a stamp that was
  /// told since is none.
  [[nodiscard]] bool is_news(const PushedValue& entry, Known& known, const Message& message,
                             bool is_late) const TFDUDE_REQUIRES(mutex_);
  // Appends the value if it is news.
  void admit(const Group& group, PushedValue& entry, const Message& message,
             std::vector<WatchedValue>& values) TFDUDE_REQUIRES(mutex_);
  [[nodiscard]] bool lacks_any() const TFDUDE_REQUIRES(mutex_);
  [[nodiscard]] bool settles(Clock::time_point now) const TFDUDE_REQUIRES(mutex_);
  [[nodiscard]] std::optional<Time> recent() const TFDUDE_REQUIRES(mutex_);
  /// Keeps what is known of edges that stay in the plan, and the groups of before.
  void carry_over() TFDUDE_REQUIRES(mutex_);
  void became_unreachable(std::string why);
  void forget_all() TFDUDE_REQUIRES(mutex_);
  /// The watch is denied, or cannot be heard: until an answer comes it does not count as reachable.
  void deny(std::string why);
  void became_reachable() TFDUDE_REQUIRES(mutex_);
  /// Whether so many values or frames more are too many for the listener.
  [[nodiscard]] bool is_too_much(std::size_t more) const {
    return *waiting_ > 0 && *waiting_ + more > kMostWaiting;
  }
  /// Posts the newest list of frames, or leaves it due if that is too much.
  void post_frames() TFDUDE_REQUIRES(mutex_);
  /// @param count  of values or frames
  void post(PartitionNews news, std::size_t count = 0);

  const std::string name_;
  const std::chrono::nanoseconds period_;
  const std::shared_ptr<const Listener> listener_;
  const std::shared_ptr<std::atomic<std::size_t>> waiting_ =
      std::make_shared<std::atomic<std::size_t>>(0);
  const std::shared_ptr<Callbacks::Line> line_;
  // The following belong to the rounds.
  std::size_t most_ = kMaxItems;  // edges in a group
  Planned planned_;               // until it is adopted
  mutable Mutex mutex_{LockRank::kWatchedPath};
  bool reachable_ TFDUDE_GUARDED_BY(mutex_) = false;
  bool denied_ TFDUDE_GUARDED_BY(mutex_) = false;      // until all groups are answered
  bool frames_due_ TFDUDE_GUARDED_BY(mutex_) = false;  // not yet posted; no values are until then
  std::uint64_t incarnation_ TFDUDE_GUARDED_BY(mutex_) = 0;
  std::vector<WatchedFrame> frames_ TFDUDE_GUARDED_BY(mutex_);
  std::vector<Known> known_ TFDUDE_GUARDED_BY(mutex_);  // by frame
  std::vector<Group> groups_ TFDUDE_GUARDED_BY(mutex_);
  MissingSamples missing_ TFDUDE_GUARDED_BY(mutex_);
  std::optional<Time> asked_from_ TFDUDE_GUARDED_BY(mutex_);  // an answer tells what was since
  std::optional<Clock::time_point> answered_ TFDUDE_GUARDED_BY(mutex_);
};

}  // namespace tfdude
