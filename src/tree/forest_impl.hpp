#pragma once

#include <mutex>

#include "tree/epoch.hpp"
#include "tree/forest.hpp"
#include "tree/graph.hpp"
#include "tree/id_table.hpp"
#include "tree/versions.hpp"
#include "tree/write_lock.hpp"

namespace tfdude {

/// What a walk comes to, with the ties of what has any.
struct Reached {
  Transform X;
  Ties ties;
};

/// The shared state of Forest: what readers see (ids_, slots_, committed_) and what writers keep beside it
/// under mutex_ (graph_, free slots, pools).
///
/// A commit pushes a new version on each slot it concerns, all with the next commit number, then stores
/// that number. A reader takes the number once and skips newer versions, so it sees all of a commit or
/// nothing of it.
class Forest::Impl {
 public:
  explicit Impl(Clock clock) : clock_(std::move(clock)) {}
  ~Impl();

  // --- reading, under an epoch::Guard (forest_queries.cpp, forest_lookup.cpp) ---

  [[nodiscard]] std::uint64_t snapshot() const {
    return committed_.load(std::memory_order_seq_cst);
  }

  /// What the slot held at that commit.
  [[nodiscard]] static const Version* at(const Head& head, std::uint64_t commit) {
    const Version* version = head.load(std::memory_order_acquire);
    while (version->commit > commit) version = version->older;
    return version;
  }
  [[nodiscard]] const Version* at(std::uint32_t slot, std::uint64_t commit) const {
    return at(slots_[slot], commit);
  }

  /// The version of the id's slot at that commit; null if no slot stood for the id then.
  [[nodiscard]] const Version* named(std::string_view id, std::uint64_t commit) const;

  /// The same where the frame was there.
  [[nodiscard]] const Version* present(std::string_view id, std::uint64_t commit) const {
    const Version* version = named(id, commit);
    return version != nullptr && version->present() ? version : nullptr;
  }

  /// The version of the handle's frame at that commit; null if it was not there.
  [[nodiscard]] const Version* of(Handle frame, std::uint64_t commit) const;

  /// The two ends of a path as they are in one commit.
  struct Ends {
    const Version* a;
    const Version* b;
    std::uint64_t commit;
  };
  [[nodiscard]] Result<Ends> ends(std::string_view a, std::string_view b) const;
  [[nodiscard]] Result<Ends> ends(Handle a, Handle b) const;

  [[nodiscard]] static tl::unexpected<Error> unknown_start(std::string_view id);
  [[nodiscard]] static tl::unexpected<Error> unknown_end(std::string_view id);
  [[nodiscard]] static tl::unexpected<Error> not_connected(const Version& a, const Version& b);

  /// Both ends climb to where they meet. Frames that are not there end the climb, or may be passed.
  enum class Absent { kEnds, kMayPass };

  /// The walk that all lookups share. `take` is handed the accumulation that an edge belongs to, and the edge, whose value it
  /// adds to that; the walk ends in an error of its.
  template <class Value, class Take>
  [[nodiscard]] Result<Value> walk(const Ends& ends, Absent absent, Order order, Take take) const;

  /// What a walk has met.
  struct Met {
    const HeldVersion* limiting =
        nullptr;  ///< whose newest sample is the oldest; null where none is moving
    bool moving = false;
    bool tied = false;  ///< an edge has ties: a Transform is not enough, and none is given
  };

  /// X_AB at the newest instant that all moving edges have: that of the newest sample of Met::limiting.
  template <class Value>
  [[nodiscard]] Result<Value> walk_newest(const Ends& ends, Absent absent, Order order,
                                          Met& met) const;

  /// X_AB at t.
  template <class Value>
  [[nodiscard]] Result<Value> walk_at(const Ends& ends, Absent absent, std::int64_t t,
                                      const Query& query, Met& met) const;

  [[nodiscard]] Result<Reached> reach_newest(const Ends& ends, Absent absent, Order order,
                                             Met& met) const;
  [[nodiscard]] Result<Reached> reach_at(const Ends& ends, Absent absent, std::int64_t t,
                                         const Query& query, Met& met) const;

  // The same for many segments.
  [[nodiscard]] Result<std::vector<Ends>> all_ends(const std::vector<PathEnds>& segments) const;
  [[nodiscard]] Result<std::vector<Reached>> newest_values(const std::vector<Ends>& segments,
                                                           Order order, Met& met) const;
  [[nodiscard]] Result<std::vector<Reached>> values_at(const std::vector<Ends>& segments,
                                                       std::int64_t t, const Query& query,
                                                       Met& met) const;

  /// The newest history of the edges on these segments.
  [[nodiscard]] static std::uint64_t newest_history(const std::vector<Ends>& segments);

  /// Adds what each single edge was observed with.
  void tell_observed_with(const std::vector<Ends>& edges, SegmentValues& found) const;

  /// Value is Transform, or Pose where the covariance is not asked for; Name is an id or a handle.
  template <class Value, class Name>
  [[nodiscard]] Result<Value> look_up(Name a, Name b) const;
  template <class Name>
  [[nodiscard]] Result<StampedTransform> look_up(Name a, Name b, const Query& query) const;

  /// Calls visit(edge, from, to) for the edges from a to b, in order; an edge's version is that of its child.
  template <class Visit>
  [[nodiscard]] static Result<void> for_each_edge(const Ends& ends, Visit visit);

  /// The version of a held edge in the newest commit. @return kUnknownFrame, kNotOwner.
  [[nodiscard]] Result<const HeldVersion*> held_value(std::string_view id) const;

  [[nodiscard]] FrameInfo info_of(const Version& version, std::uint64_t commit) const;

  // --- writing, under mutex_ (forest_write.cpp) ---

  /// The newest version, that of the commit being made where there is one.
  [[nodiscard]] const Version& newest(std::uint32_t slot) const {
    return *slots_[slot].load(std::memory_order_relaxed);
  }

  /// The id's newest version, there or not; null if the id is not interned.
  [[nodiscard]] const Version* newest_named(std::string_view id) const;

  /// Checks that the frame is there and held here. @return kUnknownFrame, kNotOwner.
  [[nodiscard]] Result<std::uint32_t> held_slot(std::string_view id) const;
  [[nodiscard]] Result<std::uint32_t> held_slot(Handle frame) const;
  /// The newest version of the frame if it is held here, else null.
  [[nodiscard]] const Version* newest_held(Handle frame) const {
    if (frame.slot >= slots_.size()) return nullptr;
    const Version& version = newest(frame.slot);
    return version.held() && version.generation == frame.generation ? &version : nullptr;
  }

  /// One edge, given by its newest version.
  [[nodiscard]] Result<void> update_one(const HeldVersion& edge, const Transform& X_PC,
                                        std::optional<Time> stamp);
  [[nodiscard]] bool may_be_moving(const HeldVersion& edge) const {
    return edge.ring != nullptr || default_timing_.moving;
  }

  /// All of them as one commit, or none; `frame` gives the id or the handle of an update. Under mutex_, as all here.
  template <class Update, class Frame>
  [[nodiscard]] Result<void> update_all(const std::vector<Update>& edges, Frame frame,
                                        std::optional<Time> stamp);
  /// The edges' values with the parts that are given.
  [[nodiscard]] Result<std::vector<EdgeUpdate>> completed(
      const std::vector<PartialUpdate>& edges) const;

  // Of the past (forest_history.cpp).

  /// Of what stamp an update is to be for all these edges: that given, or the clock's where it counts, later than all
  /// that these have.
  [[nodiscard]] Result<std::int64_t> stamp_for(const std::uint32_t* slots, std::size_t count,
                                               std::optional<Time> given) const;
  [[nodiscard]] const EdgeTiming& timing_of(const HeldVersion& edge) const {
    return edge.ring != nullptr ? edge.ring->timing() : default_timing_;
  }
  /// @return kInvalidInput (naming both times) where the stamp is too far ahead of the clock, which is counted
  [[nodiscard]] Result<void> check_ahead(const HeldVersion& edge, std::int64_t stamp) const;
  /// Whether a sample that is older than the span is the one after which the history starts again; counts it.
  [[nodiscard]] bool starts_again(const HeldVersion& newest, std::int64_t stamp) const;
  /// @return kTooOld, kStampTaken; both are counted
  [[nodiscard]] Result<void> check_sample(const HeldVersion& newest, std::int64_t stamp) const;
  /// Pushes a checked update: a sample where the edge is moving or is to be, else the value for all times.
  void push_value(std::uint32_t slot, const Transform& X_PC, std::int64_t stamp);
  /// Makes the fresh version static, with nothing of the past that its predecessor has, but as much to be kept.
  void forget_past(HeldVersion& fresh);
  /// A ring with all its samples, of which the newest may still be the newest version: that one is superseded next.
  void give_back(Ring* ring, std::uint32_t slot);

  // Of what another forest tells (forest_mirror.cpp).

  /// Pushes a value of one of its edges. @return whether that is new here
  bool push_told(const HeldVersion& edge, const News& value, bool replace);
  bool push_told_sample(const HeldVersion& edge, const Transform& X_PC, std::int64_t stamp,
                        bool replace);
  void begin_told_history(std::uint32_t slot, const News& value);

  // Of what errors have to do with each other (forest_ties.cpp).

  /// Gives the fresh version other ties; null for none.
  void set_ties(HeldVersion& fresh, std::unique_ptr<EdgeTies> ties);
  /// What an observation has said of the edge goes with its value.
  void end_revision(HeldVersion& fresh) {
    if (fresh.ties != nullptr && fresh.ties->revised) tie_as_said(fresh);
  }
  void tie_as_said(HeldVersion& fresh);
  /// Pushes the newest value once more, with other ties.
  void say_ties(std::uint32_t slot, const Correlation& correlation);
  [[nodiscard]] Result<void> check_revision(const HeldVersion& edge, const Revision& revision,
                                            std::optional<Time> stamp, std::uint64_t seen) const;
  /// With the whole covariance that an edge has but for shares of declared sources: what is kept of an observed one where
  /// shares of observations are not.
  [[nodiscard]] static Transform whole(const Transform& X_PC, const Correlation& correlation);
  [[nodiscard]] static Transform whole(const HeldVersion& edge) {
    const bool observed = edge.ties != nullptr && edge.ties->revised;
    return observed ? whole(edge.X_PC, edge.ties->now) : edge.X_PC;
  }
  [[nodiscard]] static ChangedEdge kept(const HeldVersion& edge);
  /// The moving edge's sample of that stamp, where there is one, becomes another.
  void replace_sample(const HeldVersion& newest, const Transform& X_PC, std::int64_t stamp);

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

  /// The number of the commit that is being made.
  [[nodiscard]] std::uint64_t commit_being_made() const {
    return committed_.load(std::memory_order_relaxed) + 1;
  }

  /// Makes all that was pushed visible at once.
  void commit();
  void commit_structure();

  SlotArray slots_;
  EdgeTiming default_timing_;
  /// With whose they are.
  std::vector<std::pair<const void*, std::function<void()>>> commit_listeners_;
  std::function<void(const HistoryRestart&)> restart_listener_;
  std::atomic<std::uint64_t> structure_version_{0};
  mutable WriteLock mutex_;
  Graph graph_;

  [[nodiscard]] const HeldVersion& newest_value(std::uint32_t slot) const {
    return static_cast<const HeldVersion&>(newest(slot));
  }

 private:
  // How many superseded versions may wait before the readers are asked: rare enough to cost little (locked
  // instructions, and the readers' cache lines), few enough that the pool stays in the first-level cache.
  static constexpr std::size_t kCollectAt = 64;

  template <class T>
  T& push(VersionPool<T>& pool, std::uint32_t slot);
  void append_sample(const HeldVersion& newest, const Transform& X_PC, std::int64_t stamp);
  void restart_history(const HeldVersion& newest, const Transform& X_PC, std::int64_t stamp);
  void insert_sample(const HeldVersion& newest, const Transform& X_PC, std::int64_t stamp);
  void show_commit();
  void tell_commit() const {
    for (const auto& [whose, listener] : commit_listeners_) listener();
  }
  void drop_oldest(Ring& ring);
  void drop_samples(Ring& ring);
  void replace(Ring* ring);
  void hang(Version& fresh, std::uint32_t parent) const;
  void renew_depths(std::uint32_t top);
  void release(Version& fresh);
  void release_if_unused(std::uint32_t slot);
  void collect();

  IdTable ids_;
  const Clock clock_;
  // What the clock said last, for stamps that are given. It is asked anew where that does not do, and after kClockGoesFor
  // updates, as it may have been set back.
  static constexpr int kClockGoesFor = 64;
  mutable std::int64_t clock_said_ = 0;
  mutable int clock_asked_ago_ = 0;
  std::atomic<std::uint64_t> committed_{0};
  VersionPool<HeldVersion> held_pool_;
  VersionPool<Version> remote_pool_;
  std::vector<Version*> superseded_;  // by commits since the readers were last asked
  std::vector<std::unique_ptr<Ring>> superseded_rings_;  // likewise
  std::vector<std::unique_ptr<Ring>> retired_rings_;
  std::vector<std::unique_ptr<EdgeTies>> superseded_ties_;  // likewise
  std::vector<std::unique_ptr<EdgeTies>> retired_ties_;
  std::vector<const Name*> released_names_;  // by the commit being made
  std::vector<std::uint32_t> free_slots_;
  std::vector<std::uint32_t> to_update_;  // of the update being made; kept for its memory
};

}  // namespace tfdude
