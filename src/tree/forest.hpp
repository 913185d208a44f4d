#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "tfdude/base/result.hpp"
#include "tfdude/base/time.hpp"
#include "tfdude/math/belief.hpp"
#include "tfdude/math/transform.hpp"
#include "tfdude/types/edge.hpp"
#include "tfdude/types/edge_sample.hpp"
#include "tfdude/types/query.hpp"

#include "math/joint_state.hpp"
#include "tree/handed_edge.hpp"
#include "tree/path_correlation.hpp"
#include "tree/pushed_value.hpp"
#include "tree/segments.hpp"

namespace tfdude {

class Arena;
class RemoteEdges;

/// A new value X_PC for an edge, with the edge's correlation, in the same commit.
struct CorrelatedUpdate {
  Handle frame;
  Transform X_PC;
  const Correlation* correlation = nullptr;  ///< null: unchanged
  /// If a joint gives the value: the value between two such samples is that of a position between
  /// both.
  JointState state{};
};

/// Checks a partial update.
/// @return kInvalidInput naming the frame and the part: not finite, not of unit length, too far
///   away.
[[nodiscard]] Result<void> check_parts(const PartialUpdate& edge);

/// A value with these parts replaced. @return kInvalidInput naming the frame and the invalid part.
[[nodiscard]] Result<Transform> with_parts(const Transform& X_PC, std::string_view id,
                                           const PartialTransform& parts);

/// Reports that the history of an edge has restarted.
struct HistoryRestart {
  std::string id;
  Time newest;  ///< newest sample before the restart
  Time stamp;   ///< of the first sample of the new history
};

/// Combines a belief into one transform, with the basis of its covariance.
[[nodiscard]] StampedTransform collapsed(const Belief& X, Order order, std::optional<Time> stamp);

/// When the stored value of an edge was measured. Neither: it holds for all times, or the edge had
/// no sample yet.
struct StoredTime {
  std::optional<Time> stamp{};  ///< it is a sample
  bool cleared = false;         ///< the history was cleared, and the next sample did not come
};

/// The stored part of a held edge.
struct ChangedEdge {
  std::string id;
  Transform X_PC;  ///< if the edge is correlated, the covariance is that of its own part
  StoredCorrelation correlation{};
  StoredTime time{};
};

/// Commits of a forest.
struct CommitRange {
  std::uint64_t after = 0;  ///< the one before the first
  std::uint64_t last = 0;
};

/// The coordinate frames that one process knows: a forest whose edges carry either a value (held
/// here) or only the owner who holds it.
///
/// A frame may name a parent that does not exist (yet). It is then a root, and is connected when
/// the parent appears.
///
/// @par Time  The value of a static edge holds for all times. An edge is dynamic if
///   EdgeTiming::moving says so (see set_timing()), or from its first sample on, which is an update
///   with a stamp. Then only its samples give its value, with
///   interpolate() between two of them.
/// @par Thread safety  All functions may be called from any thread. Lookups, find, exists, info and
///   frames take no lock and never wait: every commit (of one edge or of many) pushes new versions
///   of its edges and becomes visible by one store, and a reader sees the forest as of one commit.
///   Writers serialize on a lock that these readers do not take; children() and roots() take it
///   too.
/// @par Memory  Superseded versions are reused as soon as no reader can see them (epochs, see
///   epoch.hpp).
class Forest {
 public:
  /// Returns nothing while its time is not known. Thread-safe: readers also call it.
  using Clock = std::function<std::optional<Time>()>;

  /// @param clock  stamps updates of dynamic edges that have no stamp; without a clock these are
  ///   rejected
  /// @param arena  the memory of all that lookups read, which others may read, too (RemoteForest);
  ///   null: the heap
  explicit Forest(Clock clock = nullptr, std::shared_ptr<Arena> arena = nullptr);
  ~Forest();
  Forest(const Forest&) = delete;
  Forest& operator=(const Forest&) = delete;

  enum class MissingParent { kRefuse, kAllow };

  // --- frames held here ---

  /// Adds a frame; an empty parent makes it a root. O(1) for a leaf, O(n) if n frames wait for it.
  /// @return kAlreadyExists, kUnknownParent, kCycle, kInvalidInput (id, or a value that is not
  ///   finite).
  [[nodiscard]] Result<void> add(std::string_view id, std::string_view parent,
                                 const Transform& X_PC, MissingParent rule = MissingParent::kRefuse,
                                 std::uint64_t lamport_time = 0);

  /// Removes a held frame, and all held frames below it that are reached through held ones.
  /// O(removed).
  /// @param before  frames below that were added or moved at this Lamport time or later stay, with
  ///   all below them, and wait for another frame with the id of their parent
  /// @return the removed ids; kUnknownFrame, kNotOwner.
  [[nodiscard]] Result<std::vector<std::string>> remove(std::string_view id,
                                                        std::uint64_t before = UINT64_MAX);

  /// Removes one held frame only; frames below it wait for another frame with its id. O(subtree).
  /// @return kUnknownFrame, kNotOwner.
  [[nodiscard]] Result<void> release(std::string_view id);

  /// Sets the value of an edge; with a stamp, adds a sample. Without a stamp, a dynamic edge gets a
  /// sample at the clock's time, and a static edge a new value. Does not allocate, except while an
  /// edge's history grows to its limits and for a sample that is older than another: then
  /// O(samples).
  /// @return kUnknownFrame, kNotOwner, kInvalidInput (not finite; a negative stamp, or one further
  ///   ahead of the clock than EdgeTiming::max_ahead), kNotYet (this needs the time of the clock,
  ///   which is not known yet), kTooOld (older than the kept history), kStampTaken (another sample
  ///   has the stamp).
  [[nodiscard]] Result<void> update(std::string_view id, const Transform& X_PC,
                                    const std::optional<Time>& stamp = std::nullopt);
  [[nodiscard]] Result<void> update(Handle frame, const Transform& X_PC,
                                    const std::optional<Time>& stamp = std::nullopt);

  /// Sets many edges as one commit, with one stamp: all or, on an error, none. No reader sees a
  /// part.
  [[nodiscard]] Result<void> update(const std::vector<EdgeUpdate>& edges,
                                    const std::optional<Time>& stamp = std::nullopt);
  [[nodiscard]] Result<void> update(const std::vector<HandleUpdate>& edges,
                                    const std::optional<Time>& stamp = std::nullopt);
  /// As update(), with correlations.
  /// @return as update(); kInvalidInput also for an invalid correlation, naming the source.
  [[nodiscard]] Result<void> update_correlated(const std::vector<CorrelatedUpdate>& edges,
                                               std::optional<Time> stamp = std::nullopt);

  /// Sets parts of edges, as one commit. Absent parts are taken from the newest value in that
  /// commit.
  /// @return as update(); kInvalidInput also for an invalid part (naming it).
  [[nodiscard]] Result<void> update_partial(const std::vector<PartialUpdate>& edges,
                                            std::optional<Time> stamp = std::nullopt);

  /// Replaces the samples of a dynamic edge within an interval by others, as one commit. What an
  /// observation has found out about the replaced ones ends with them. Watchers get all samples
  /// from the interval on again, as another history. O(samples from the interval on).
  /// @param samples  at least one, all within the interval, each later than the one before
  /// @return kUnknownFrame, kNotOwner, kTooOld (the first is older than the history that is kept),
  ///   kTooMuch (more than the history keeps), kInvalidInput (naming the sample or what is wrong; a
  ///   static edge, or one that drifts), kNotYet as update(). Nothing has changed then.
  [[nodiscard]] Result<void> rewrite(std::string_view id, const TimeInterval& interval,
                                     const std::vector<EdgeSample>& samples);
  /// Whether so many samples may be rewritten; kInvalidInput, kTooMuch, kUnknownFrame and kNotOwner
  /// as above.
  [[nodiscard]] Result<void> check_rewrite(std::string_view id, const TimeInterval& interval,
                                           std::size_t count) const;

  /// Sets the timing of an edge, and clears its history, except what resume() has restored. An edge
  /// that is declared dynamic then has no value at any instant until its first sample; lookups of
  /// the newest value get what it has now.
  /// @return kUnknownFrame, kNotOwner, kInvalidInput (naming the field).
  [[nodiscard]] Result<void> set_timing(std::string_view id, const EdgeTiming& timing);

  /// Sets the timing of all edges without their own, from their first sample on.
  [[nodiscard]] Result<void> set_default_timing(const EdgeTiming& timing);

  /// Clears the history of a held dynamic edge. It stays dynamic, without a value until its next
  /// sample. Does nothing if the edge is static.
  /// @return kUnknownFrame, kNotOwner.
  [[nodiscard]] Result<void> clear_history(std::string_view id);
  /// Likewise for all held edges with samples at this time or later, as one commit; for a frame
  /// that is being handed over when that is over, unless another owner has it then. Also reads the
  /// clock again before the next stamp is judged. O(slots).
  /// @param jumped_from  where the clock has jumped back from: samples that were on their way then
  ///   are rejected, until it is there again
  /// @return how many
  std::size_t clear_histories(Time from, std::optional<Time> jumped_from = std::nullopt);

  /// Limits the memory of the samples of all histories together. Once it is reached, the oldest
  /// samples are dropped, except the two newest of each edge.
  /// @param on_full  called when the first ones are dropped, as a function of on_commit()
  void limit_history(std::size_t bytes, std::function<void()> on_full = nullptr);
  /// How many samples were dropped for that.
  [[nodiscard]] std::uint64_t dropped_samples() const;

  /// Sets how an edge's error is correlated with those of others, from now on and for all its
  /// history. Updates do not change it.
  /// @return kUnknownFrame, kNotOwner, kInvalidInput (naming the source).
  [[nodiscard]] Result<void> correlate(std::string_view id, const Correlation& correlation);

  /// Restores the correlation of a held edge that an earlier process stored, and when its value was
  /// measured. A restored sample is all that is known of the edge until the next sample, which
  /// begins another history: nobody has measured what was in between.
  /// @return as correlate().
  [[nodiscard]] Result<void> resume(std::string_view id, const StoredCorrelation& correlation,
                                    const StoredTime& time = {});

  /// Sets edges to the values that an observation computed, as one commit: all, or on an error
  /// none. The correlation holds until the edge's next update. For a dynamic edge it is only added
  /// to the covariance, since its next sample will come anyway. A sample with the same stamp is
  /// replaced.
  /// @param stamp  of dynamic edges
  /// @param seen  the commit of the observed values
  /// @return as update(); kChangedMeanwhile (a static edge was written since `seen`, or a dynamic
  ///   one has no stamp).
  [[nodiscard]] Result<void> revise(const std::vector<Revision>& edges, std::optional<Time> stamp,
                                    std::uint64_t seen);

  /// Moves a held frame, with all below it, to a new parent; empty makes it a root. Absent parts of
  /// X_PC keep their value. The history is cleared, as it was that of another edge: the edge is
  /// static until its next sample. O(subtree).
  /// @return kUnknownFrame, kNotOwner, kUnknownParent, kCycle, kInvalidInput (not finite).
  [[nodiscard]] Result<void> move(std::string_view id, std::string_view parent,
                                  const PartialTransform& X_PC = {},
                                  std::uint64_t lamport_time = 0);

  /// Connects a held root with a parent, which may be missing. Its value and its history are those
  /// of the new edge. O(subtree).
  /// @return kUnknownFrame, kNotOwner, kCycle, kInvalidInput (the id of the parent).
  [[nodiscard]] Result<void> attach(std::string_view id, std::string_view parent);

  // --- handing over ---

  /// Rejects changes of held frames with kNotOwner, until thaw(), which then clears the histories
  /// that clear_histories() would have cleared. All can be read as before.
  void freeze(const std::vector<std::string>& ids);
  void thaw(const std::vector<std::string>& ids);
  /// Likewise, and says when the frames got their parents.
  void thaw(const std::vector<HandedFrame>& frames);
  [[nodiscard]] bool is_frozen(std::string_view id) const;

  /// What is known of a held edge, with its samples later than `after`, the oldest first.
  /// @param most  how many of them
  /// @return kUnknownFrame, kNotOwner.
  [[nodiscard]] Result<HandedEdge> handed(std::string_view id, std::optional<Time> after,
                                          std::size_t most) const;

  /// Holds frames of others, parents before children, with all that was known of them, as one
  /// commit; frozen. O(frames and samples).
  /// @return kAlreadyExists (it is held here), kCycle, kInvalidInput (naming the frame and what is
  ///   wrong). Nothing has changed then.
  [[nodiscard]] Result<void> adopt(const std::vector<HandedEdge>& edges);

  /// Another owner holds these held frames now, as one commit. A frame whose parent is below it
  /// becomes a root.
  void hand_to(Owner owner, const std::vector<HandedFrame>& frames);

  // --- frames held elsewhere: structure only ---

  /// Records that `owner` holds a frame, new or known. A held frame is not changed.
  /// @return kAlreadyExists (it is held here), kCycle (kept as a root), kInvalidInput (id, owner).
  [[nodiscard]] Result<void> put_remote(std::string_view id, std::string_view parent, Owner owner,
                                        std::uint64_t lamport_time = 0);

  /// Removes a frame if `owner` holds it.
  void drop_remote(std::string_view id, Owner owner);

  // --- reading ---

  /// X_AB at an instant, or at the newest one for which all dynamic edges on the path have data.
  /// Does not allocate on success, if no edge is correlated or unspecified; O(depth of both below
  /// their common ancestor).
  /// @return kUnknownStart, kUnknownEnd, kNotConnected, kNotOwner (an edge on the path is held
  ///   elsewhere: see segments()), kNotYet and kTooOld (an edge has no data for the instant; the
  ///   message names it and the gap).
  [[nodiscard]] Result<StampedTransform> lookup(std::string_view a, std::string_view b,
                                                const Query& query = {}) const;
  [[nodiscard]] Result<StampedTransform> lookup(Handle a, Handle b, const Query& query = {}) const;

  /// As lookup() of the latest common time, without the covariance, in a fraction of the time.
  [[nodiscard]] Result<Pose> lookup_pose(std::string_view a, std::string_view b) const;
  [[nodiscard]] Result<Pose> lookup_pose(Handle a, Handle b) const;

  /// As above, where others hold edges of the path that can be read in their memory. All edges of
  /// one owner are of one commit.
  /// @return an error without a text: kNotOwner, if an edge is not bound; see bind(). Others: the
  ///   owners have to be asked, as they have no data, cannot be read, or must say why not
  [[nodiscard]] Result<Pose> lookup_pose(std::string_view a, std::string_view b,
                                         const RemoteEdges& others) const;
  [[nodiscard]] Result<Pose> lookup_pose(Handle a, Handle b, const RemoteEdges& others) const;
  [[nodiscard]] Result<StampedTransform> lookup(std::string_view a, std::string_view b,
                                                const Query& query,
                                                const RemoteEdges& others) const;
  [[nodiscard]] Result<StampedTransform> lookup(Handle a, Handle b, const Query& query,
                                                const RemoteEdges& others) const;
  /// As lookup_segments(), likewise. Without a period.
  /// @param motion  the segments are single edges: also which of them are dynamic and which drift,
  ///   but not what they were observed with
  /// @param timed_since  the motion since then must be known by stamps, as check_timed() says
  [[nodiscard]] Result<SegmentValues> lookup_segments(const std::vector<PathEnds>& segments,
                                                      const Query& query, std::optional<Time> hint,
                                                      const RemoteEdges& others,
                                                      bool motion = false,
                                                      std::optional<Time> timed_since = {}) const;
  /// A number that differs from an earlier one if anything of the edges of the path was written
  /// since, or if it has other edges. Empty: an edge is not bound, or cannot be read.
  [[nodiscard]] std::optional<std::uint64_t> written(std::string_view a, std::string_view b,
                                                     const RemoteEdges& others) const;
  /// An error of such a lookup, with the text that lookups of own edges have.
  [[nodiscard]] Error explain(Error error, std::string_view a, std::string_view b,
                              const Query& query, const RemoteEdges& others) const;
  /// The newest X_AB before owners have changed the path, which is not known here yet: each owner
  /// is read at the last commit at which its edges were those of the path. So it is no older than
  /// what lookups have found before.
  /// @return as lookup(); what has been overwritten cannot be read
  [[nodiscard]] Result<StampedTransform> lookup_former(std::string_view a, std::string_view b,
                                                       const RemoteEdges& others) const;
  /// Binds the edges of others on the path to the memory of those that are attached.
  /// @param former  also edges that their owners have changed since, for lookup_former()
  /// @return how many of them are bound now, if all are; otherwise 0
  std::size_t bind(std::string_view a, std::string_view b, RemoteEdges& others,
                   bool former = false) const;
  std::size_t bind(Handle a, Handle b, RemoteEdges& others) const;

  /// As lookup(), for segments of a path that another participant asks for. Their ends may be
  /// frames that do not exist, if held edges name them as their parent.
  /// @param hint  another instant that may be useful; the one that was asked for says that it is
  ///   the latest common time, which others have found
  /// @param edges  the segments are single edges, whose full correlation is needed
  /// @param rows  of such edges
  [[nodiscard]] Result<SegmentValues> lookup_segments(const std::vector<PathEnds>& segments,
                                                      const Query& query = {},
                                                      std::optional<Time> hint = std::nullopt,
                                                      bool edges = false,
                                                      Rows rows = Rows::kNone) const;

  /// Whether the motion of such segments around an instant is known by stamps that came with the
  /// samples.
  /// @return kUnknownStart, kUnknownEnd; kInvalidInput naming an edge whose owner has made up
  ///   stamps around the instant or after it, as its samples came without: those tell no velocity
  [[nodiscard]] Result<void> check_timed(const std::vector<PathEnds>& segments, Time at) const;

  /// The values of such segments at their latest common time, after those at earlier instants
  /// at which an edge has a sample, and that are not known from `seen`. All are of one commit. If
  /// the history of an edge was cleared, the last one says that there are no values.
  /// @param most  of the earlier instants, the newest
  [[nodiscard]] Result<std::vector<SegmentValues>> segments_since(
      const std::vector<PathEnds>& segments, const SeenSegments& seen, std::size_t most) const;

  /// Whether an edge of these segments has process noise.
  [[nodiscard]] bool have_noise(const std::vector<PathEnds>& segments) const;

  /// The path from a to b as runs of edges by owner, in order; empty if a is b.
  /// @return kUnknownStart, kUnknownEnd, kNotConnected.
  [[nodiscard]] Result<std::vector<Segment>> segments(std::string_view a, std::string_view b) const;

  /// The edges of the path from a to b, in order, each named by its child.
  /// @return kUnknownStart, kUnknownEnd, kNotConnected.
  [[nodiscard]] Result<std::vector<FrameInfo>> edges(std::string_view a, std::string_view b) const;

  [[nodiscard]] std::optional<Handle> find(std::string_view id) const;
  [[nodiscard]] bool exists(std::string_view id) const { return find(id).has_value(); }
  /// True for a frame held here. Lock-free and without allocation: suitable for a filter.
  [[nodiscard]] bool holds(std::string_view id) const;
  [[nodiscard]] std::optional<FrameInfo> info(std::string_view id) const;
  [[nodiscard]] std::optional<FrameInfo> info(Handle frame) const;
  /// The value of a held edge. Common errors that observations have left are added to its
  /// covariance.
  /// @return kUnknownFrame, kNotOwner.
  [[nodiscard]] Result<Transform> value(std::string_view id) const;
  /// The stored part of a held edge. @return as value().
  [[nodiscard]] Result<ChangedEdge> kept(std::string_view id) const;

  /// All frames of one commit, in no particular order. O(n).
  [[nodiscard]] std::vector<FrameInfo> frames() const;
  /// The frame and all frames below it, whoever holds them; parents before children. Empty if
  /// unknown. O(result).
  [[nodiscard]] std::vector<FrameInfo> subtree(std::string_view id) const;
  /// Ids, sorted. @return kUnknownFrame.
  [[nodiscard]] Result<std::vector<std::string>> children(std::string_view id) const;
  /// Frames without an existing parent, sorted.
  [[nodiscard]] std::vector<std::string> roots() const;
  /// Frames that name this missing frame as their parent. O(result).
  [[nodiscard]] std::vector<FrameInfo> waiting_for(std::string_view id) const;

  /// The number of the newest commit.
  [[nodiscard]] std::uint64_t newest_commit() const;

  /// All held edges that these commits have written, as of the last one. Takes no lock. O(slots).
  /// If others write meanwhile, the calling thread must have had an epoch::Guard since before the
  /// last one was the newest.
  [[nodiscard]] std::vector<ChangedEdge> changed(const CommitRange& commits) const;

  /// The values written to held edges since the cursors, which it advances to its commit: samples,
  /// including late ones that follow later stamps, or the value that holds for all times. An edge
  /// that is not held, or has another parent, is left out, and its cursor stays. Takes no lock.
  [[nodiscard]] PushedCommit values_since(std::vector<EdgeCursor>& cursors,
                                          const PushedQuery& query) const;

  /// Applies values that values_since() of another forest returned, as one commit. Values that are
  /// known here, or older than the kept history, are ignored. If process noise is given, the edge's
  /// history is cleared.
  /// @param edges  the edges held here, by the values' indices
  /// @param replace  whether to replace samples with the same stamp; otherwise these values are
  ///   ignored
  void take(const std::vector<Handle>& edges, const std::vector<PushedValue>& values,
            bool replace = true);
  /// As above, of samples without a correlation, each of the edge that is named: in a fraction of
  /// the time.
  void take(const std::vector<ToldSample>& samples);

  /// Calls a function after each commit, from the committing thread, which holds the forest's lock.
  /// The function must be quick and must not write to the forest. Null: removes it.
  /// @param whose  each owner may register one
  void on_commit(std::function<void()> listener, const void* whose = nullptr);

  /// As on_commit(), for histories that restart, before the commit that does it is visible.
  void on_restart(std::function<void(const HistoryRestart&)> listener);

  /// The histories of held dynamic edges, or of the one with the given id. Takes no lock. O(slots
  /// and samples).
  [[nodiscard]] std::vector<HistoryInfo> histories(std::string_view id = {}) const;

  /// Increases with every change of the structure (not of values).
  [[nodiscard]] std::uint64_t structure_version() const;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace tfdude
