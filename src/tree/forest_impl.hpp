#pragma once

#include <map>

#include "tree/epoch.hpp"
#include "tree/forest.hpp"
#include "tree/former_edges.hpp"
#include "tree/frames.hpp"
#include "tree/graph.hpp"
#include "tree/oldest_samples.hpp"
#include "tree/past.hpp"
#include "tree/path_lookup.hpp"
#include "tree/reclaimer.hpp"
#include "tree/revised_sample.hpp"
#include "tree/sample_rules.hpp"
#include "tree/stamp_clock.hpp"
#include "tree/write_lock.hpp"

namespace tfdude {

/// @return kInvalidInput (naming the field).
[[nodiscard]] Result<void> check_timing(const EdgeTiming& timing);

/// The writer's side of Forest. It works under mutex_: it pushes versions on slots, and then
/// commits them. It is one class, since one commit may concern structure, samples and correlations
/// at once, and all three are pushed as one version of an edge. Separate parts are: what readers
/// see (Frames), how they walk it (PathLookup), what is reused or deleted after them (Reclaimer),
/// the hierarchy (Graph), the samples of an edge (SampleHistory), which of them it accepts
/// (check_sample()), and the clock (StampClock).
class Forest::Impl {
 public:
  Impl(Clock clock, std::shared_ptr<Arena> arena)
      : arena_(arena != nullptr ? std::move(arena) : std::make_shared<Arena>()),
        frames_(*arena_),
        now_(clock),
        clock_(std::move(clock)),
        reclaimer_(*arena_) {}
  ~Impl();

  [[nodiscard]] PathLookup paths() const { return {frames_, now_}; }

  // Structure and values (forest_write.cpp).

  /// The newest versions of an id and of its intended parent; null if not interned.
  struct Pair {
    std::string_view id;
    std::string_view parent;
    const Version* frame;
    const Version* above;
  };
  [[nodiscard]] Pair newest_pair(std::string_view id, std::string_view parent) const
      TFDUDE_REQUIRES(mutex_);

  /// Checks that the parent (empty: none) is allowed for the frame. @return kCycle.
  [[nodiscard]] Result<void> check_no_cycle(const Pair& pair) const TFDUDE_REQUIRES(mutex_);

  /// The parent's slot; a new absent one if the id is not interned; kNoSlot for an empty id.
  std::uint32_t parent_slot(const Pair& pair) TFDUDE_REQUIRES(mutex_);

  /// Creates a name for an id that is not interned, on a slot whose next version is to get it.
  const Name* intern(std::string_view id) TFDUDE_REQUIRES(mutex_);

  /// Pushes a copy of the newest version, to be changed before commit().
  HeldVersion& push_held(std::uint32_t slot, const Transform& X_PC) TFDUDE_REQUIRES(mutex_);
  Version& push_remote(std::uint32_t slot) TFDUDE_REQUIRES(mutex_);

  /// Moves the slot with this fresh version to another parent (kNoSlot: none).
  void relink(Version& fresh, std::uint32_t parent) TFDUDE_REQUIRES(mutex_);

  /// Makes the frame in the slot absent; frames below it become roots.
  void make_absent(std::uint32_t slot) TFDUDE_REQUIRES(mutex_);

  /// Makes everything pushed visible at once.
  void commit() TFDUDE_REQUIRES(mutex_);
  void commit_structure() TFDUDE_REQUIRES(mutex_);

  /// Updates one edge, given by its id or its handle. Takes the lock.
  template <class Frame>
  [[nodiscard]] Result<void> update_one(Frame frame, const Transform& X_PC,
                                        const std::optional<Time>& stamp);
  [[nodiscard]] bool may_be_moving(const HeldVersion& edge) const TFDUDE_REQUIRES(mutex_) {
    return edge.samples != nullptr || default_timing_.moving;
  }
  /// Whether a value without a stamp is a sample, with the time of its arrival.
  [[nodiscard]] bool is_timed(const HeldVersion& edge) const TFDUDE_REQUIRES(mutex_) {
    return edge.moving() || timing_of(edge).moving;
  }

  /// Updates all as one commit, or none; `frame` gives the id or the handle of an update.
  template <class Update, class Frame>
  [[nodiscard]] Result<void> update_all(const std::vector<Update>& edges, Frame frame,
                                        const std::optional<Time>& stamp) TFDUDE_REQUIRES(mutex_);
  /// The edges' values, with the given parts replaced.
  [[nodiscard]] Result<std::vector<EdgeUpdate>> completed(
      const std::vector<PartialUpdate>& edges) const TFDUDE_REQUIRES(mutex_);

  // History (forest_history.cpp).

  /// The stamp for an update of all these edges: the given one, or, if one is needed, the clock's,
  /// or that of their newest sample if the clock is not there yet. That sample is then replaced.
  [[nodiscard]] Result<std::int64_t> stamp_for(const HeldVersion* const* edges, std::size_t count,
                                               const std::optional<Time>& given)
      TFDUDE_REQUIRES(mutex_);
  /// That of the newest sample of edges whose history does not restart now; kAlways: of none.
  [[nodiscard]] static std::int64_t newest_that_stays(const HeldVersion* const* edges,
                                                      std::size_t count, std::int64_t now);
  [[nodiscard]] const EdgeTiming& timing_of(const HeldVersion& edge) const TFDUDE_REQUIRES(mutex_) {
    return edge.samples != nullptr ? edge.samples->timing() : default_timing_;
  }
  /// @return kInvalidInput (naming both times) if the stamp is too far ahead of the clock; counts
  ///   it
  [[nodiscard]] Result<void> check_ahead(const HeldVersion& edge, std::int64_t stamp)
      TFDUDE_REQUIRES(mutex_);
  /// Pushes a checked update: a sample if the edge is dynamic or becomes so, otherwise the value
  /// for all times.
  void push_value(std::uint32_t slot, const GivenValue& value, std::int64_t stamp)
      TFDUDE_REQUIRES(mutex_);
  /// The stamp of the edge's newest sample is made up.
  void mark_made_up(std::uint32_t slot) TFDUDE_REQUIRES(mutex_) {
    const HeldVersion& edge = frames_.newest_value(slot);
    if (past_ != nullptr) past_->prepare(slot);
    edge.samples->set_made_up(edge.number);
  }
  /// Makes the fresh version's history another one, of which watchers have nothing.
  void begin_again(HeldVersion& fresh) TFDUDE_REQUIRES(mutex_) {
    fresh.history = fresh.commit;
    fresh.samples->forget_earlier();
  }
  /// Makes the fresh version static and clears its history, but keeps its timing.
  void forget_history(HeldVersion& fresh) TFDUDE_REQUIRES(mutex_);
  /// Pushes a version of a dynamic edge without any sample.
  void clear_history(const HeldVersion& edge) TFDUDE_REQUIRES(mutex_);
  /// Makes the fresh version, which has no sample, dynamic.
  void await_sample(HeldVersion& fresh, std::int64_t stamp = kUnsampled) TFDUDE_REQUIRES(mutex_);
  /// Makes the value of the fresh version, which has no sample, what an earlier process has left.
  /// @param given  as StoredCorrelation::given
  void resume_history(HeldVersion& fresh, const StoredTime& left, const std::optional<Pose>& given)
      TFDUDE_REQUIRES(mutex_);
  /// Retires a history with all its samples.
  void give_back(SampleHistory* samples) TFDUDE_REQUIRES(mutex_);
  /// A sample of the current commit for a place in a history; it shares with a neighbour there what
  /// they have in common.
  [[nodiscard]] Sample sample_at(const SampleHistory& samples, std::uint64_t place,
                                 const GivenValue& value, std::int64_t stamp)
      TFDUDE_REQUIRES(mutex_);

  // Rewriting (forest_rewrite.cpp).

  /// A sample to be added.
  struct TimedValue {
    std::int64_t stamp = 0;
    const Transform* X_PC = nullptr;
    const SampleRevision* revision = nullptr;  ///< as of GivenValue
  };
  /// Whether so many samples may replace those of the edge within the interval.
  [[nodiscard]] Result<void> check_rewrite(const HeldVersion& edge, const TimeInterval& interval,
                                           std::size_t count) TFDUDE_REQUIRES(mutex_);
  /// Pushes a version of a dynamic edge in which these samples, sorted and at least one, are those
  /// of the time from the first to the second instant. O(samples from the first on).
  void replace_samples(const HeldVersion& newest, std::int64_t from, std::int64_t to,
                       const std::vector<TimedValue>& samples) TFDUDE_REQUIRES(mutex_);
  /// The values of one edge from kept_before on, of which the first has it.
  void rewrite_told(const HeldVersion& edge, const std::vector<const PushedValue*>& values)
      TFDUDE_REQUIRES(mutex_);

  // The limit of all histories (forest_limit.cpp).

  /// Drops the oldest samples while all take more memory than they may.
  void keep_to_limit() TFDUDE_REQUIRES(mutex_) {
    if (reclaimer_.samples().bytes() > full_at_) drop_down_to_limit();
  }

  // What was believed before (forest_believed.cpp).

  /// From now on, as the timing of an edge says.
  void remember(const EdgeTiming& timing) TFDUDE_REQUIRES(mutex_);
  /// Call before these samples of the slot's edge are dropped or replaced.
  void bury(std::uint32_t slot, const SampleHistory& samples, const SampleHistory::Range& dropped)
      TFDUDE_REQUIRES(mutex_) {
    if (past_ != nullptr) past_->bury(slot, samples, dropped);
  }
  /// Finds paths, and goes back with them to Query::believed_at. The caller has an epoch::Guard.
  /// @return the paths then, in `former`; also as FormerEdges::take()
  [[nodiscard]] Result<std::vector<Ends>> go_back(
      std::optional<FormerEdges>& former, const Query& query, std::optional<Time> hint,
      const std::function<Result<std::vector<Ends>>()>& find) const;
  /// X_AB at Query::believed_at.
  template <class Name>
  [[nodiscard]] Result<StampedTransform> believed(Name a, Name b, const Query& query) const;

  // Handing over (forest_handover.cpp).

  /// @return kNotOwner if the held frame is being handed over
  [[nodiscard]] Result<void> check_not_frozen(std::uint32_t slot) const TFDUDE_REQUIRES(mutex_) {
    return frozen_.empty() ? Result<void>() : is_not_frozen(slot);
  }
  /// As Frames::held_slot(), for a change.
  template <class Frame>
  [[nodiscard]] Result<std::uint32_t> slot_to_change(Frame frame) const TFDUDE_REQUIRES(mutex_) {
    auto slot = frames_.held_slot(frame);
    if (!slot) return slot;
    auto ok = check_not_frozen(*slot);
    return ok ? slot : tl::unexpected(std::move(ok.error()));
  }
  /// Whether a jump back of the clock to that time clears the history of the edge.
  [[nodiscard]] static bool is_cleared(const HeldVersion& edge, std::int64_t from) {
    return edge.moving() && !edge.lacks_sample() && edge.stamp >= from;
  }
  /// The history of an edge that is taken over; null: none.
  [[nodiscard]] SampleHistory* adopted_history(const HandedEdge& edge, std::uint64_t commit)
      TFDUDE_REQUIRES(mutex_);
  void adopt(const HandedEdge& edge) TFDUDE_REQUIRES(mutex_);
  /// The frame may be changed again. @return whether its history was cleared
  bool thaw(std::uint32_t slot) TFDUDE_REQUIRES(mutex_);
  void hand_to(Owner owner, const HandedFrame& frame) TFDUDE_REQUIRES(mutex_);
  [[nodiscard]] Result<void> check_handed(const HandedEdge& edge) const TFDUDE_REQUIRES(mutex_);

  // Values from another forest (forest_mirror.cpp).

  /// Pushes a value of one edge. @return whether it is new here
  bool push_told(const HeldVersion& edge, const PushedValue& value, bool replace)
      TFDUDE_REQUIRES(mutex_);
  /// What a watcher knows of a sample of an edge that drifts; empty: it is as it was given.
  [[nodiscard]] std::optional<SampleRevision> told_of_drift(const HeldVersion& edge,
                                                            const GivenValue& value,
                                                            std::int64_t stamp)
      TFDUDE_REQUIRES(mutex_);
  [[nodiscard]] static SampleRevision told_revision(const HeldVersion& edge,
                                                    const PushedValue& told);
  bool push_told_sample(const HeldVersion& edge, const PushedValue& told, bool replace)
      TFDUDE_REQUIRES(mutex_);
  bool push_told_sample(const HeldVersion& edge, const GivenValue& value, std::int64_t stamp,
                        bool replace) TFDUDE_REQUIRES(mutex_);
  void take_said(std::uint32_t slot, const Correlation& said) TFDUDE_REQUIRES(mutex_);
  void begin_told_history(std::uint32_t slot, const PushedValue& value) TFDUDE_REQUIRES(mutex_);

  // Correlations (forest_correlation.cpp).

  /// Sets the correlation of the fresh version; null for none.
  void set_correlation(HeldVersion& fresh, InArena<EdgeCorrelation> correlation)
      TFDUDE_REQUIRES(mutex_);
  void correlate(HeldVersion& fresh, Correlation said) TFDUDE_REQUIRES(mutex_) {
    set_correlation(fresh, make_in<EdgeCorrelation>(*arena_, std::move(said)));
  }
  /// @param now  as observations have left it
  void correlate(HeldVersion& fresh, Correlation said, Correlation now) TFDUDE_REQUIRES(mutex_) {
    set_correlation(fresh, make_in<EdgeCorrelation>(*arena_, std::move(said), std::move(now)));
  }
  [[nodiscard]] static bool drifts(const HeldVersion& edge) {
    return edge.samples != nullptr && edge.samples->timing().drifts;
  }
  /// What becomes of what the former value was tied to.
  enum class Ties : std::uint8_t {
    kEnd,
    kStay,  ///< it is still a sample, or an observation gives the next one, and says it itself
  };
  /// Drops what an observation has set for the edge, with its value.
  void end_revision(HeldVersion& fresh, Ties ties = Ties::kEnd) TFDUDE_REQUIRES(mutex_);
  /// The edges that were observed with this one are not correlated with it any more.
  void unlink(const HeldVersion& edge, const std::vector<std::string>& partners)
      TFDUDE_REQUIRES(mutex_);
  /// Unlinks the last row of a dynamic edge, if the revisions leave it out. As revise_samples().
  void leave_out(std::uint32_t slot, const std::vector<const Revision*>& revisions,
                 std::int64_t stamp) TFDUDE_REQUIRES(mutex_);
  /// Makes the row of a dynamic edge's newest sample that of the edge.
  void show_revision(std::uint32_t slot) TFDUDE_REQUIRES(mutex_);
  /// Whether watchers are told of a corrected sample at once. To tell all earlier ones with each
  /// observation would take many times the bytes; they have what they were told last.
  enum class Telling : std::uint8_t { kNow, kLater };
  /// Corrects a dynamic edge at an instant. If it drifts, later samples have the same error, up to
  /// the next one that was observed itself.
  void revise_sample(const HeldVersion& newest, const Revision& revision, std::int64_t stamp,
                     const RowInfo& row, Telling telling) TFDUDE_REQUIRES(mutex_);
  /// Corrects the samples after a row, up to the next one. @param row  number of its sample
  void carry_on(std::uint32_t slot, std::uint64_t row, Telling telling) TFDUDE_REQUIRES(mutex_);
  /// Gives consecutive samples, at least one, other revisions, with their values.
  void replace_revisions(const HeldVersion& edge, std::uint64_t first,
                         const std::vector<std::pair<Transform, SampleRevision>>& values,
                         Telling telling) TFDUDE_REQUIRES(mutex_);
  /// Gives consecutive samples, at least one, other values.
  /// @param follows  stamp of the row that they follow
  void replace_followers(const HeldVersion& edge, std::uint64_t first, std::int64_t follows,
                         const std::vector<CorrelatedValue>& values, Telling telling)
      TFDUDE_REQUIRES(mutex_);
  /// Corrects a dynamic edge at the instants of the revisions, sorted by their stamps.
  /// @param stamp  of those that have none
  void revise_samples(std::uint32_t slot, const std::vector<const Revision*>& revisions,
                      std::int64_t stamp) TFDUDE_REQUIRES(mutex_);
  /// Makes what observations have found of an edge's samples errors of their own.
  /// @param until  not included
  void untie_samples(std::uint32_t slot, std::int64_t from, std::int64_t until)
      TFDUDE_REQUIRES(mutex_);
  /// Whether what is said fits beside what observations have left.
  [[nodiscard]] static Result<void> check_room(const HeldVersion& edge, const Correlation& said);
  /// Pushes the newest value again, with another correlation, for which there is room.
  void say_correlation(std::uint32_t slot, const Correlation& said) TFDUDE_REQUIRES(mutex_);
  /// Of the samples that have a correlation of their own. @param before  what was said
  void say_of_samples(std::uint32_t slot, const Correlation& before, const Correlation& said)
      TFDUDE_REQUIRES(mutex_);
  [[nodiscard]] Result<void> check_revision(const HeldVersion& edge, const Revision& revision,
                                            std::optional<Time> stamp, std::uint64_t seen)
      TFDUDE_REQUIRES(mutex_);
  /// The newest value with all of its covariance, except for what is said of it: what remains of it
  /// if the common errors of observations are left out.
  [[nodiscard]] static Transform whole(const HeldVersion& edge) {
    const EdgeCorrelation* correlation = edge.correlation;
    const bool observed = correlation != nullptr && correlation->revised();
    return observed ? tfdude::whole(edge.X_PC, correlation->now(), &correlation->said())
                    : edge.X_PC;
  }
  [[nodiscard]] static ChangedEdge kept(const HeldVersion& edge);
  /// Replaces the dynamic edge's sample with that stamp, or inserts it. The value is taken as it
  /// is: the error of an edge that drifts is in it already.
  void replace_sample(const HeldVersion& newest, const GivenValue& value, std::int64_t stamp,
                      Telling telling = Telling::kNow) TFDUDE_REQUIRES(mutex_);

  const std::shared_ptr<Arena> arena_;
  Frames frames_;
  const Clock now_;  // for readers
  StampClock clock_ TFDUDE_GUARDED_BY(mutex_);
  EdgeTiming default_timing_ TFDUDE_GUARDED_BY(mutex_);
  std::size_t max_bytes_ TFDUDE_GUARDED_BY(mutex_) = SIZE_MAX;  // of all samples
  // The bytes at which samples are dropped: max_bytes_, unless there is nothing to drop.
  std::size_t full_at_ TFDUDE_GUARDED_BY(mutex_) = SIZE_MAX;
  std::function<void()> on_full_ TFDUDE_GUARDED_BY(mutex_);
  std::atomic<std::uint64_t> dropped_samples_{0};
  /// With the owner of each.
  std::vector<std::pair<const void*, std::function<void()>>> commit_listeners_
      TFDUDE_GUARDED_BY(mutex_);
  std::function<void(const HistoryRestart&)> restart_listener_ TFDUDE_GUARDED_BY(mutex_);
  std::atomic<std::uint64_t> structure_version_{0};
  /// Held frames that are being handed over; after a jump of the clock, with the time to which it
  /// has jumped back: then it clears the history when that is over.
  std::map<std::uint32_t, std::optional<std::int64_t>> frozen_ TFDUDE_GUARDED_BY(mutex_);
  /// Null: no edge is remembered.
  std::unique_ptr<Past> past_ TFDUDE_GUARDED_BY(mutex_);
  mutable WriteLock mutex_;
  Graph graph_ TFDUDE_GUARDED_BY(mutex_);

 private:
  template <class T>
  T& push(Head& head) TFDUDE_REQUIRES(mutex_);
  [[nodiscard]] Result<void> update_one(const HeldVersion& edge, const Transform& X_PC,
                                        const std::optional<Time>& stamp) TFDUDE_REQUIRES(mutex_);
  [[nodiscard]] Result<void> is_not_frozen(std::uint32_t slot) const TFDUDE_REQUIRES(mutex_);
  /// The error for a value that is not finite.
  template <class Frame>
  [[nodiscard]] Result<void> not_finite(Frame frame, const Transform& X_PC);
  /// Takes a late pose of an edge that drifts, for the stamp of an observation.
  void give_between(const HeldVersion& newest, const Sample& there, const Pose& G_PC)
      TFDUDE_REQUIRES(mutex_);
  void push_of_drift(const HeldVersion& newest, const GivenValue& value, std::int64_t stamp)
      TFDUDE_REQUIRES(mutex_);
  void push_checked(const HeldVersion& old, const GivenValue& value, std::int64_t stamp)
      TFDUDE_REQUIRES(mutex_);
  void append_sample(const HeldVersion& newest, const GivenValue& value, std::int64_t stamp)
      TFDUDE_REQUIRES(mutex_);
  void restart_history(const HeldVersion& newest, const GivenValue& value, std::int64_t stamp)
      TFDUDE_REQUIRES(mutex_);
  void begin_history(const HeldVersion& newest, const GivenValue& value, std::int64_t stamp)
      TFDUDE_REQUIRES(mutex_);
  void insert_sample(const HeldVersion& newest, const GivenValue& value, std::int64_t stamp)
      TFDUDE_REQUIRES(mutex_);
  void show_commit() TFDUDE_REQUIRES(mutex_);
  void remember_commit() TFDUDE_REQUIRES(mutex_);
  void tell_commit() const TFDUDE_REQUIRES(mutex_) {
    for (const auto& [whose, listener] : commit_listeners_) listener();
  }
  /// Makes the fresh version's value the newest sample.
  void append_to(HeldVersion& fresh, const GivenValue& value, std::int64_t stamp)
      TFDUDE_REQUIRES(mutex_);
  void drop_oldest(std::uint32_t slot, SampleHistory& samples) TFDUDE_REQUIRES(mutex_) {
    bury(slot, samples, {samples.oldest(), samples.oldest() + 1});
    samples.drop_oldest(reclaimer_.samples());
  }
  void drop_samples(const HeldVersion& edge) TFDUDE_REQUIRES(mutex_);
  void drop_down_to_limit() TFDUDE_REQUIRES(mutex_);
  [[nodiscard]] bool drop_oldest_samples() TFDUDE_REQUIRES(mutex_);
  [[nodiscard]] bool drop_oldest_found() TFDUDE_REQUIRES(mutex_);
  void find_oldest_samples() TFDUDE_REQUIRES(mutex_);
  void hang(Version& fresh, std::uint32_t parent) const TFDUDE_REQUIRES(mutex_);
  void renew_depths(std::uint32_t top) TFDUDE_REQUIRES(mutex_);
  void release(Version& fresh) TFDUDE_REQUIRES(mutex_);
  void release_if_unused(std::uint32_t slot) TFDUDE_REQUIRES(mutex_);

  OldestSamples oldest_ TFDUDE_GUARDED_BY(mutex_);
  std::size_t drops_until_search_ TFDUDE_GUARDED_BY(mutex_) = 0;
  Reclaimer reclaimer_ TFDUDE_GUARDED_BY(mutex_);
  std::vector<const Name*> released_names_ TFDUDE_GUARDED_BY(mutex_);  // by the current commit
  std::vector<std::uint32_t> free_slots_ TFDUDE_GUARDED_BY(mutex_);
  std::vector<const HeldVersion*> to_update_
      TFDUDE_GUARDED_BY(mutex_);  // edges of the current update; kept to reuse its memory
};

// In the header, so that they are inlined into an update.

template <class T>
T& Forest::Impl::push(Head& head) {
  Version* old = head.load(std::memory_order_relaxed);
  T* fresh = reclaimer_.take<T>();
  fresh->commit = frames_.commit_being_made();
  fresh->older = old;
  fresh->name = old->name;
  fresh->above = old->above;
  fresh->parent = old->parent;
  fresh->depth = old->depth;
  fresh->owner = old->owner;
  fresh->slot = old->slot;
  fresh->generation = old->generation;
  fresh->attachment = old->attachment;
  reclaimer_.supersede(old);
  // Readers skip the fresh version by its number until commit(), so it may be filled in later.
  head.store(fresh, std::memory_order_release);
  return *fresh;
}

inline HeldVersion& Forest::Impl::push_held(std::uint32_t slot, const Transform& X_PC) {
  HeldVersion& fresh = push<HeldVersion>(frames_.head(slot));
  fresh.owner = kHeldHere;
  fresh.X_PC = X_PC;
  if (fresh.older->held()) {
    const auto& before = static_cast<const HeldVersion&>(*fresh.older);
    fresh.stamp = before.stamp;
    fresh.number = before.number;
    fresh.samples = before.samples;
    fresh.correlation = before.correlation;
    fresh.history = before.history;
  } else {
    fresh.stamp = kAlways;
    fresh.samples = nullptr;
    fresh.correlation = nullptr;
    fresh.history = fresh.commit;
  }
  return fresh;
}

inline Version& Forest::Impl::push_remote(std::uint32_t slot) {
  return push<Version>(frames_.head(slot));
}

inline void Forest::Impl::commit() {
  show_commit();
  tell_commit();
}

inline void Forest::Impl::commit_structure() {
  show_commit();
  structure_version_.fetch_add(1, std::memory_order_release);
  tell_commit();
}

inline void Forest::Impl::show_commit() {
  if (past_ != nullptr) remember_commit();
  frames_.show_commit();
  // Only now: a reader of the previous commit may still reach a name through the version it sees.
  for (const Name* name : released_names_) {
    free_slots_.push_back(name->slot);
    frames_.drop_name(name);
  }
  released_names_.clear();
  if (reclaimer_.is_due()) reclaimer_.collect(frames_);
}

}  // namespace tfdude
