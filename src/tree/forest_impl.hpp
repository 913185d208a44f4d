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

/// The writer's side of Forest: all of it works under mutex_, by pushing versions on slots and then committing these. One
/// class, since one commit may concern structure, samples and correlations at once, and all three are pushed as one version
/// of an edge. What can be told apart stands beside it: what readers see (Frames), how they walk it (PathLookup), what is
/// reused or deleted once they have gone (Reclaimer), who hangs below whom (Graph), the samples of an edge (Ring), which of
/// them it takes (check_sample()), and by which clock (StampClock).
class Forest::Impl {
 public:
  explicit Impl(Clock clock) : clock_(std::move(clock)) {}
  ~Impl();

  [[nodiscard]] PathLookup paths() const { return PathLookup(frames_); }

  // Structure and values (forest_write.cpp).

  /// The newest versions of an id and of the parent that it is to have; null where not interned.
  struct Pair {
    std::string_view id;
    std::string_view parent;
    const Version* frame;
    const Version* above;
  };
  [[nodiscard]] Pair newest_pair(std::string_view id, std::string_view parent) const;

  /// Checks that the frame may hang under the parent (empty: under nothing). @return kCycle.
  [[nodiscard]] Result<void> check_no_cycle(const Pair& pair) const;

  /// The parent's slot, a new absent one if the id is not interned; kNoSlot for an empty id.
  std::uint32_t parent_slot(const Pair& pair);

  /// A name for an id that is not interned, on a slot whose next version is to have it.
  const Name* intern(std::string_view id);

  /// Pushes copies of the newest version, to be changed before commit().
  HeldVersion& push_held(std::uint32_t slot, const Transform& X_PC);
  Version& push_remote(std::uint32_t slot);

  /// Hangs the slot, whose fresh version this is, under another parent (kNoSlot: none).
  void relink(Version& fresh, std::uint32_t parent);

  /// Makes the frame in the slot not be there; those below it become roots.
  void make_absent(std::uint32_t slot);

  /// Makes all that was pushed visible at once.
  void commit();
  void commit_structure();

  /// One edge, given by its newest version.
  [[nodiscard]] Result<void> update_one(const HeldVersion& edge, const Transform& X_PC,
                                        std::optional<Time> stamp);
  [[nodiscard]] bool may_be_moving(const HeldVersion& edge) const {
    return edge.samples != nullptr || default_timing_.moving;
  }

  /// All of them as one commit, or none; `frame` gives the id or the handle of an update. Under mutex_, as all here.
  template <class Update, class Frame>
  [[nodiscard]] Result<void> update_all(const std::vector<Update>& edges, Frame frame,
                                        std::optional<Time> stamp);
  /// The edges' values with the parts that are given.
  [[nodiscard]] Result<std::vector<EdgeUpdate>> completed(
      const std::vector<PartialUpdate>& edges) const;

  // Of history (forest_history.cpp).

  /// Of what stamp an update is to be for all these edges: that given, or the clock's where it counts, later than all
  /// that these have.
  [[nodiscard]] Result<std::int64_t> stamp_for(const std::uint32_t* slots, std::size_t count,
                                               std::optional<Time> given);
  [[nodiscard]] const EdgeTiming& timing_of(const HeldVersion& edge) const {
    return edge.samples != nullptr ? edge.samples->timing() : default_timing_;
  }
  /// @return kInvalidInput (naming both times) where the stamp is too far ahead of the clock, which is counted
  [[nodiscard]] Result<void> check_ahead(const HeldVersion& edge, std::int64_t stamp);
  /// Pushes a checked update: a sample where the edge is moving or is to be, else the value for all times.
  void push_value(std::uint32_t slot, const Transform& X_PC, std::int64_t stamp);
  /// Makes the fresh version static, with nothing of the history that its predecessor has, but as much to be kept.
  void forget_history(HeldVersion& fresh);
  /// A history with all its samples, of which the newest may still be the newest version: that one is superseded next.
  void give_back(SampleHistory* samples, std::uint32_t slot);

  // Of what another forest tells (forest_mirror.cpp).

  /// Pushes a value of one of its edges. @return whether that is new here
  bool push_told(const HeldVersion& edge, const PushedValue& value, bool replace);
  bool push_told_sample(const HeldVersion& edge, const Transform& X_PC, std::int64_t stamp,
                        bool replace);
  void begin_told_history(std::uint32_t slot, const PushedValue& value);

  // Of what errors have to do with each other (forest_correlation.cpp).

  /// Gives the fresh version another correlation; null for none.
  void set_correlation(HeldVersion& fresh, std::unique_ptr<EdgeCorrelation> correlation);
  /// What an observation has said of the edge goes with its value.
  void end_revision(HeldVersion& fresh) {
    if (fresh.correlation != nullptr && fresh.correlation->revised) correlate_as_said(fresh);
  }
  void correlate_as_said(HeldVersion& fresh);
  /// Pushes the newest value once more, with another correlation.
  void say_correlation(std::uint32_t slot, const Correlation& said);
  [[nodiscard]] Result<void> check_revision(const HeldVersion& edge, const Revision& revision,
                                            std::optional<Time> stamp, std::uint64_t seen);
  /// With the whole covariance that an edge has but for common errors of declared sources: what is kept of an observed one
  /// where those of observations are not.
  [[nodiscard]] static Transform whole(const Transform& X_PC, const Correlation& correlation);
  [[nodiscard]] static Transform whole(const HeldVersion& edge) {
    const bool observed = edge.correlation != nullptr && edge.correlation->revised;
    return observed ? whole(edge.X_PC, edge.correlation->now) : edge.X_PC;
  }
  [[nodiscard]] static ChangedEdge kept(const HeldVersion& edge);
  /// The moving edge's sample of that stamp, where there is one, becomes another.
  void replace_sample(const HeldVersion& newest, const Transform& X_PC, std::int64_t stamp);

  Frames frames_;
  EdgeTiming default_timing_;
  /// With whose they are.
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
  std::vector<const Name*> released_names_;  // by the commit being made
  std::vector<std::uint32_t> free_slots_;
  std::vector<std::uint32_t> to_update_;  // of the update being made; kept for its memory
};

}  // namespace tfdude
