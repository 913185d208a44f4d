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
#include "tfdude/types/query.hpp"

#include "tree/path_correlation.hpp"
#include "tree/pushed_value.hpp"
#include "tree/segments.hpp"

namespace tfdude {

/// A new value X_PC for an edge, with how the edge's error is correlated with those of others, in the same commit.
struct CorrelatedUpdate {
  Handle frame;
  Transform X_PC;
  const Correlation* correlation = nullptr;  ///< null: as before
};

/// @return kInvalidInput naming the frame and the part: not finite, not of unit length, too far away.
[[nodiscard]] Result<void> check_parts(const PartialUpdate& edge);

/// That the history of an edge has started again.
struct HistoryRestart {
  std::string id;
  Time newest;  ///< sample before
  Time stamp;   ///< of the first sample of the new history
};

/// The one transform that a belief comes to, and what that rests on.
[[nodiscard]] StampedTransform collapsed(const Belief& X, Order order, std::optional<Time> stamp);

/// What of a held edge outlives its process.
struct ChangedEdge {
  std::string id;
  Transform X_PC;  ///< its covariance is that of the edge's own part where it is correlated
  StoredCorrelation correlation{};
};

/// The coordinate frames that one process knows: a forest whose edges carry either a value (held here) or
/// only the owner who holds it.
///
/// A frame may name a parent that is not there (yet); it is then a root, and is connected when the
/// parent appears.
///
/// @par Time  The value of a static edge holds for all times. An edge is moving from its first sample on, which is an
///   update with a stamp; then only its samples tell where it is, between two of them by interpolate().
/// @par Thread safety  All functions may be called from any thread. Lookups, find, exists, info and frames
///   take no lock and never wait: every commit (of one edge or of many) pushes new versions of its edges
///   and becomes visible by one store, and a reader sees the forest as it was at one commit. Writers take
///   turns on a lock that no reader touches; children() and roots() take it too.
/// @par Memory  Superseded versions are reused as soon as no reader can see them (epochs, see epoch.hpp).
class Forest {
 public:
  using Clock = std::function<Time()>;

  /// @param clock  stamps what is given none where the edge is moving; without one that is refused
  explicit Forest(Clock clock = nullptr);
  ~Forest();
  Forest(const Forest&) = delete;
  Forest& operator=(const Forest&) = delete;

  enum class MissingParent { kRefuse, kAllow };

  // --- frames held here ---

  /// Adds a frame; an empty parent makes a root. O(1) for a leaf, O(n) where n frames wait for it.
  /// @return kAlreadyExists, kUnknownParent, kCycle, kInvalidInput (id, or a value that is not finite).
  [[nodiscard]] Result<void> add(std::string_view id, std::string_view parent,
                                 const Transform& X_PC, MissingParent rule = MissingParent::kRefuse,
                                 std::uint64_t lamport_time = 0);

  /// Removes a held frame and all held frames below it that are reached through held ones. O(removed).
  /// @return the removed ids; kUnknownFrame, kNotOwner.
  [[nodiscard]] Result<std::vector<std::string>> remove(std::string_view id);

  /// Removes one held frame and nothing below it, what hangs there waits for another of that id.
  /// O(subtree). @return kUnknownFrame, kNotOwner.
  [[nodiscard]] Result<void> release(std::string_view id);

  /// Gives an edge a new value; with a stamp, a sample of it. Without one the clock's time is taken for a moving edge,
  /// while a static edge has its value replaced. Allocation-free, but while an edge's history grows to its limits and
  /// where a sample is older than another: then O(samples).
  /// @return kUnknownFrame, kNotOwner, kInvalidInput (not finite; a stamp before 1970, or further ahead of the clock than
  ///   EdgeTiming::max_ahead), kTooOld (older than what is kept), kStampTaken (equal in stamp to another sample).
  [[nodiscard]] Result<void> update(std::string_view id, const Transform& X_PC,
                                    std::optional<Time> stamp = std::nullopt);
  [[nodiscard]] Result<void> update(Handle frame, const Transform& X_PC,
                                    std::optional<Time> stamp = std::nullopt);

  /// Gives many edges new values as one commit, and of one stamp: all or, on an error, none; no reader sees a part.
  [[nodiscard]] Result<void> update(const std::vector<EdgeUpdate>& edges,
                                    std::optional<Time> stamp = std::nullopt);
  [[nodiscard]] Result<void> update(const std::vector<HandleUpdate>& edges,
                                    std::optional<Time> stamp = std::nullopt);
  /// The same with correlations. @return as update(); kInvalidInput also where a correlation is none, naming the source.
  [[nodiscard]] Result<void> update_correlated(const std::vector<CorrelatedUpdate>& edges,
                                               std::optional<Time> stamp = std::nullopt);

  /// Gives parts of edges new values, as one commit: what is absent stays as it is in the newest value of then.
  /// @return as update(); kInvalidInput also where a part is none (naming it).
  [[nodiscard]] Result<void> update_partial(const std::vector<PartialUpdate>& edges,
                                            std::optional<Time> stamp = std::nullopt);

  /// Says how an edge behaves in time; what was kept of its history goes.
  /// @return kUnknownFrame, kNotOwner, kInvalidInput (naming the field).
  [[nodiscard]] Result<void> set_timing(std::string_view id, const EdgeTiming& timing);

  /// That of all edges for which nothing else is said, from their first sample on.
  [[nodiscard]] Result<void> set_default_timing(const EdgeTiming& timing);

  /// Says how an edge's error is correlated with those of others, from now on and for all its history. Updates leave that as
  /// it is.
  /// @return kUnknownFrame, kNotOwner, kInvalidInput (naming the source).
  [[nodiscard]] Result<void> correlate(std::string_view id, const Correlation& correlation);

  /// Takes up what an earlier process has kept of a held edge's correlation.
  /// @return as correlate().
  [[nodiscard]] Result<void> resume(std::string_view id, const StoredCorrelation& correlation);

  /// Gives edges the values that an observation makes of them, as one commit: all, or on an error none. What it says of
  /// correlation holds until the edge's next update; on a moving edge, whose next sample comes anyway, it is only added to
  /// the covariance. A sample of the very stamp is replaced.
  /// @param stamp  of moving edges
  /// @param seen  the commit of the values that were observed
  /// @return as update(); kChangedMeanwhile (a static edge was written since `seen`, or a moving one has no stamp given).
  [[nodiscard]] Result<void> revise(const std::vector<Revision>& edges, std::optional<Time> stamp,
                                    std::uint64_t seen);

  /// Hangs a held frame, with all below it, under a new parent; empty makes it a root. Keeps the edge's
  /// value where X_PC is not given, but nothing of its history, which was that of another edge: it is static until its next
  /// sample. O(subtree).
  /// @return kUnknownFrame, kNotOwner, kUnknownParent, kCycle, kInvalidInput (not finite).
  [[nodiscard]] Result<void> move(std::string_view id, std::string_view parent,
                                  const std::optional<Transform>& X_PC = std::nullopt,
                                  std::uint64_t lamport_time = 0);

  // --- frames held elsewhere: structure only ---

  /// Notes that `owner` holds a frame, new or known. A held frame is not touched.
  /// @return kAlreadyExists (it is held here), kCycle (kept as a root), kInvalidInput (id, owner).
  [[nodiscard]] Result<void> put_remote(std::string_view id, std::string_view parent, Owner owner,
                                        std::uint64_t lamport_time = 0);

  /// Forgets a frame if `owner` holds it.
  void drop_remote(std::string_view id, Owner owner);

  // --- reading ---

  /// X_AB at the newest instant of which all moving edges on the path have data. Allocation-free on success;
  /// O(depth of both below their common ancestor).
  /// @return kUnknownStart, kUnknownEnd, kNotConnected, kNotOwner (an edge on the path is held
  ///   elsewhere: see segments()), kNotYet and kTooOld (an edge has no data of that instant, named with the gap).
  [[nodiscard]] Result<Transform> lookup(std::string_view a, std::string_view b) const;
  [[nodiscard]] Result<Transform> lookup(Handle a, Handle b) const;

  /// The same without its covariance, at a fraction of the time.
  [[nodiscard]] Result<Pose> lookup_pose(std::string_view a, std::string_view b) const;
  [[nodiscard]] Result<Pose> lookup_pose(Handle a, Handle b) const;

  /// X_AB at an instant.
  [[nodiscard]] Result<StampedTransform> lookup(std::string_view a, std::string_view b,
                                                const Query& query) const;
  [[nodiscard]] Result<StampedTransform> lookup(Handle a, Handle b, const Query& query) const;

  /// As lookup, for segments that somebody else's path needs: their ends may be frames that are not there,
  /// as long as held edges name them as their parent.
  /// @param hint  another instant that may be wanted
  /// @param edges  the segments are single edges, whose own correlation is wanted in full
  [[nodiscard]] Result<SegmentValues> lookup_segments(const std::vector<PathEnds>& segments,
                                                      const Query& query = {},
                                                      std::optional<Time> hint = std::nullopt,
                                                      bool edges = false) const;

  /// The path from a to b as runs of edges by owner, in order; empty where a is b.
  /// @return kUnknownStart, kUnknownEnd, kNotConnected.
  [[nodiscard]] Result<std::vector<Segment>> segments(std::string_view a, std::string_view b) const;

  /// The edges of the path from a to b, in order, each named by its child.
  /// @return kUnknownStart, kUnknownEnd, kNotConnected.
  [[nodiscard]] Result<std::vector<FrameInfo>> edges(std::string_view a, std::string_view b) const;

  [[nodiscard]] std::optional<Handle> find(std::string_view id) const;
  [[nodiscard]] bool exists(std::string_view id) const { return find(id).has_value(); }
  /// True for a frame held here. Allocation-free, lock-free: fit for a filter.
  [[nodiscard]] bool holds(std::string_view id) const;
  [[nodiscard]] std::optional<FrameInfo> info(std::string_view id) const;
  [[nodiscard]] std::optional<FrameInfo> info(Handle frame) const;
  /// The value of a held edge: what observations have left of common errors is added to its covariance.
  /// @return kUnknownFrame, kNotOwner.
  [[nodiscard]] Result<Transform> value(std::string_view id) const;
  /// What of a held edge outlives its process. @return as value().
  [[nodiscard]] Result<ChangedEdge> kept(std::string_view id) const;

  /// All frames of one commit, in no particular order. O(n).
  [[nodiscard]] std::vector<FrameInfo> frames() const;
  /// The frame and all below it, whoever holds them; parents before children. Empty if unknown. O(result).
  [[nodiscard]] std::vector<FrameInfo> subtree(std::string_view id) const;
  /// Ids, sorted. @return kUnknownFrame.
  [[nodiscard]] Result<std::vector<std::string>> children(std::string_view id) const;
  /// Frames without a parent that is there, sorted.
  [[nodiscard]] std::vector<std::string> roots() const;
  /// Frames that name this one as their parent while it is not there. O(result).
  [[nodiscard]] std::vector<FrameInfo> waiting_for(std::string_view id) const;

  /// All held edges that were written since that commit, and the commit up to which this was looked for:
  /// what to ask for next. Takes no lock. O(slots).
  [[nodiscard]] std::pair<std::vector<ChangedEdge>, std::uint64_t> changed_since(
      std::uint64_t commit) const;

  /// What was written to held edges since the cursors, which are moved on to its commit: samples, also those that came
  /// late, after younger ones, or the value that holds for all times. An edge that is not held, or hangs under another
  /// parent, is left out, and its cursor stays. Takes no lock.
  [[nodiscard]] PushedCommit values_since(std::vector<EdgeCursor>& cursors,
                                          const PushedQuery& query) const;

  /// Takes over what values_since() of another forest told, as one commit. What is here already, or older than what is
  /// kept, is passed over; where process noise is told, the edge's history goes.
  /// @param edges  held here, by the values' indices
  /// @param replace  samples of which there is another with that stamp; else they are passed over
  void take(const std::vector<Handle>& edges, const std::vector<PushedValue>& values,
            bool replace = true);

  /// Calls a function after each commit, from the thread that made it, which holds the forest's lock: it must be quick
  /// and not write to the forest. Null: none any more.
  /// @param whose  each may have one
  void on_commit(std::function<void()> listener, const void* whose = nullptr);

  /// The same for histories that have started again, before the commit that does it is visible.
  void on_restart(std::function<void(const HistoryRestart&)> listener);

  /// The histories of held edges, of those that are moving; of one where an id is given. Takes no lock. O(slots
  /// and samples).
  [[nodiscard]] std::vector<HistoryInfo> histories(std::string_view id = {}) const;

  /// Grows with every change of the structure (not of values).
  [[nodiscard]] std::uint64_t structure_version() const;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace tfdude
