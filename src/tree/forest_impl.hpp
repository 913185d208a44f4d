#pragma once

#include <mutex>

#include "tree/epoch.hpp"
#include "tree/forest.hpp"
#include "tree/frames.hpp"
#include "tree/graph.hpp"
#include "tree/path_lookup.hpp"
#include "tree/reclaimer.hpp"
#include "tree/sample_rules.hpp"
#include "tree/stamp_clock.hpp"
#include "tree/write_lock.hpp"

namespace tfdude {

/// The writer's side of Forest. It works under mutex_: it pushes versions on slots, and then
/// commits them. It is one class, since one commit may concern structure, samples and correlations
/// at once, and all three are pushed as one version of an edge. Separate parts are: what readers
/// see (Frames), how they walk it (PathLookup), what is reused or deleted after them (Reclaimer),
/// the hierarchy (Graph), the samples of an edge (SampleHistory), which of them it accepts
/// (check_sample()), and the clock (StampClock).
class Forest::Impl {
 public:
  explicit Impl(Clock clock) : clock_(std::move(clock)) {}
  ~Impl();

  [[nodiscard]] PathLookup paths() const { return PathLookup(frames_); }

  // Structure and values (forest_write.cpp).

  /// The newest versions of an id and of its intended parent; null if not interned.
  struct Pair {
    std::string_view id;
    std::string_view parent;
    const Version* frame;
    const Version* above;
  };
  [[nodiscard]] Pair newest_pair(std::string_view id, std::string_view parent) const;

  /// Checks that the parent (empty: none) is allowed for the frame. @return kCycle.
  [[nodiscard]] Result<void> check_no_cycle(const Pair& pair) const;

  /// The parent's slot; a new absent one if the id is not interned; kNoSlot for an empty id.
  std::uint32_t parent_slot(const Pair& pair);

  /// Creates a name for an id that is not interned, on a slot whose next version is to get it.
  const Name* intern(std::string_view id);

  /// Pushes a copy of the newest version, to be changed before commit().
  HeldVersion& push_held(std::uint32_t slot, const Transform& X_PC);
  Version& push_remote(std::uint32_t slot);

  /// Moves the slot with this fresh version to another parent (kNoSlot: none).
  void relink(Version& fresh, std::uint32_t parent);

  /// Makes the frame in the slot absent; frames below it become roots.
  void make_absent(std::uint32_t slot);

  /// Makes everything pushed visible at once.
  void commit();
  void commit_structure();

  /// Updates one edge, given by its newest version.
  [[nodiscard]] Result<void> update_one(const HeldVersion& edge, const Transform& X_PC,
                                        std::optional<Time> stamp);
  [[nodiscard]] bool may_be_moving(const HeldVersion& edge) const {
    return edge.samples != nullptr || default_timing_.moving;
  }

  /// Updates all as one commit, or none; `frame` gives the id or the handle of an update.
  template <class Update, class Frame>
  [[nodiscard]] Result<void> update_all(const std::vector<Update>& edges, Frame frame,
                                        std::optional<Time> stamp);
  /// The edges' values, with the given parts replaced.
  [[nodiscard]] Result<std::vector<EdgeUpdate>> completed(
      const std::vector<PartialUpdate>& edges) const;

  // History (forest_history.cpp).

  /// The stamp for an update of all these edges: the given one, or, if one is needed, the clock's,
  /// later than all their samples.
  [[nodiscard]] Result<std::int64_t> stamp_for(const std::uint32_t* slots, std::size_t count,
                                               std::optional<Time> given);
  [[nodiscard]] const EdgeTiming& timing_of(const HeldVersion& edge) const {
    return edge.samples != nullptr ? edge.samples->timing() : default_timing_;
  }
  /// @return kInvalidInput (naming both times) if the stamp is too far ahead of the clock; counts
  ///   it
  [[nodiscard]] Result<void> check_ahead(const HeldVersion& edge, std::int64_t stamp);
  /// Pushes a checked update: a sample if the edge is dynamic or becomes so, otherwise the value
  /// for all times.
  void push_value(std::uint32_t slot, const Transform& X_PC, std::int64_t stamp);
  /// Makes the fresh version static and clears its history, but keeps its timing.
  void forget_history(HeldVersion& fresh);
  /// Retires a history with all its samples. If the newest sample is also the newest version, that
  /// one is superseded next.
  void give_back(SampleHistory* samples, std::uint32_t slot);

  // Values from another forest (forest_mirror.cpp).

  /// Pushes a value of one edge. @return whether it is new here
  bool push_told(const HeldVersion& edge, const PushedValue& value, bool replace);
  bool push_told_sample(const HeldVersion& edge, const Transform& X_PC, std::int64_t stamp,
                        bool replace);
  void begin_told_history(std::uint32_t slot, const PushedValue& value);

  // Correlations (forest_correlation.cpp).

  /// Sets the correlation of the fresh version; null for none.
  void set_correlation(HeldVersion& fresh, std::unique_ptr<EdgeCorrelation> correlation);
  /// Drops what an observation has set for the edge, with its value.
  void end_revision(HeldVersion& fresh) {
    if (fresh.correlation != nullptr && fresh.correlation->revised) correlate_as_said(fresh);
  }
  void correlate_as_said(HeldVersion& fresh);
  /// Pushes the newest value again, with another correlation.
  void say_correlation(std::uint32_t slot, const Correlation& said);
  [[nodiscard]] Result<void> check_revision(const HeldVersion& edge, const Revision& revision,
                                            std::optional<Time> stamp, std::uint64_t seen);
  /// The value with the whole covariance of an edge, except for common errors of declared sources.
  /// It is stored for an observed edge if the common errors of observations are not.
  [[nodiscard]] static Transform whole(const Transform& X_PC, const Correlation& correlation);
  [[nodiscard]] static Transform whole(const HeldVersion& edge) {
    const bool observed = edge.correlation != nullptr && edge.correlation->revised;
    return observed ? whole(edge.X_PC, edge.correlation->now) : edge.X_PC;
  }
  [[nodiscard]] static ChangedEdge kept(const HeldVersion& edge);
  /// Replaces the dynamic edge's sample with that stamp, if there is one.
  void replace_sample(const HeldVersion& newest, const Transform& X_PC, std::int64_t stamp);

  Frames frames_;
  EdgeTiming default_timing_;
  /// With the owner of each.
  std::vector<std::pair<const void*, std::function<void()>>> commit_listeners_;
  std::function<void(const HistoryRestart&)> restart_listener_;
  std::atomic<std::uint64_t> structure_version_{0};
  mutable WriteLock mutex_;
  Graph graph_;

 private:
  template <class T>
  T& push(std::uint32_t slot);
  void append_sample(const HeldVersion& newest, const Transform& X_PC, std::int64_t stamp);
  void restart_history(const HeldVersion& newest, const Transform& X_PC, std::int64_t stamp);
  void insert_sample(const HeldVersion& newest, const Transform& X_PC, std::int64_t stamp);
  void show_commit();
  void tell_commit() const {
    for (const auto& [whose, listener] : commit_listeners_) listener();
  }
  void drop_oldest(SampleHistory& samples);
  void drop_samples(SampleHistory& samples);
  void hang(Version& fresh, std::uint32_t parent) const;
  void renew_depths(std::uint32_t top);
  void release(Version& fresh);
  void release_if_unused(std::uint32_t slot);

  StampClock clock_;
  Reclaimer reclaimer_;
  std::vector<const Name*> released_names_;  // by the current commit
  std::vector<std::uint32_t> free_slots_;
  std::vector<std::uint32_t> to_update_;  // edges of the current update; kept to reuse its memory
};

}  // namespace tfdude
