#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <vector>

#include "tfdude/math/transform.hpp"
#include "tfdude/types/correlation.hpp"

#include "tree/frames.hpp"
#include "tree/sample_store.hpp"

namespace tfdude {

/// A sample that a commit has dropped, replaced or cleared.
struct FormerSample {
  Sample sample;
  std::uint64_t until = 0;  ///< that commit
};

/// What an edge was besides its samples, until a commit has changed that.
struct FormerState {
  std::uint64_t until = 0;
  std::int64_t stamp = kAlways;  ///< as HeldVersion::stamp; with samples, any of these
  Transform X_PC;                ///< without samples
  Correlation said{};
  std::optional<Correlation> now{};  ///< if observations had changed it

  [[nodiscard]] bool sampled() const { return stamp > kNoSample; }
};

/// Since a commit, the stamp of an edge's newest sample whose stamp the owner has made up; kAlways:
/// it has none.
struct FormerMadeUp {
  std::uint64_t since = 0;
  std::int64_t stamp = kAlways;
};

/// What one edge was before later commits, all in the order of these. Each sample that is left
/// knows the commit that added it, so nothing is kept of those that come.
struct EdgePast {
  std::uint64_t since = 0;  ///< the commit from which on this is complete
  std::deque<FormerSample> samples{};
  std::deque<FormerState> states{};
  std::deque<FormerMadeUp> made_up{};  // at least one
};

/// What held edges were before later commits changed them, and when commits were made, for as long
/// as EdgeTiming::believed says: the longest of all edges. For the forest's writer, with its lock.
class Past {
 public:
  /// Their time that commits are made at: of the clock, never decreasing.
  struct Moment {
    std::int64_t time = 0;
    std::uint64_t commit = 0;  ///< the last one of this time
  };

  Past(const Frames& frames, SampleStore& store, const Forest::Clock& clock)
      : frames_(frames), store_(store), clock_(clock) {}

  /// From now on, at least for so long.
  void keep_for(std::chrono::nanoseconds believed);
  /// Whether edges without a timing of their own are kept.
  void keep_others(bool kept) { keeps_others_ = kept; }

  // --- before a commit is shown

  /// The commit drops these samples of the slot's edge.
  void bury(std::uint32_t slot, const SampleHistory& samples, const SampleHistory::Range& dropped);
  /// Call before anything changes that the edge's version of before shares with the next one.
  void prepare(std::uint32_t slot) { (void)of(slot); }
  /// What the slot's edge was before this commit is not kept.
  void forget_before(std::uint32_t slot);
  /// @param superseded  of held edges, those of this commit last
  void commit(const std::vector<HeldVersion*>& superseded);

  /// Drops some of what is oldest, to free memory. @return false: nothing is left
  bool drop_some();

  // --- what is known

  /// Absent: it is the time of no commit yet, or of one that is not kept any more.
  [[nodiscard]] std::optional<std::uint64_t> commit_at(std::int64_t time) const;
  /// From when on all is known since a commit. Absent: nothing.
  [[nodiscard]] std::optional<std::int64_t> known_since(std::uint64_t commit) const;
  /// Null: nothing of it has changed while it was kept, or it is not kept.
  [[nodiscard]] const EdgePast* find(std::uint32_t slot) const {
    return slot < edges_.size() ? edges_[slot].get() : nullptr;
  }
  [[nodiscard]] bool keeps(const HeldVersion& edge) const {
    return edge.samples != nullptr ? edge.samples->timing().believed.count() > 0 : keeps_others_;
  }

 private:
  [[nodiscard]] EdgePast* of(std::uint32_t slot);
  [[nodiscard]] const Version* before(std::uint32_t slot) const;
  void note(std::uint32_t slot);
  void note_time(std::uint64_t commit);
  void forget(std::uint32_t slot);
  void prune(EdgePast& edge);
  void release(const FormerSample& one);

  const Frames& frames_;
  SampleStore& store_;
  const Forest::Clock& clock_;
  std::chrono::nanoseconds longest_{0};
  bool keeps_others_ = false;
  std::deque<Moment> times_;
  std::vector<std::unique_ptr<EdgePast>> edges_;  // by slot
  std::size_t next_pruned_ = 0;
};

}  // namespace tfdude
