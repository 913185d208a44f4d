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
#include "tfdude/tree/correlation.hpp"

namespace tfdude {

/// Whose an edge is, as a small number that the layer above gives a meaning to.
using Owner = std::uint32_t;

/// The edge's value is held in this very forest.
inline constexpr Owner kHeldHere = 0;

/// A frame by number: found once by id, then used without hashing. Stands for this one frame of this one forest until
/// it is removed; a later frame of the same id gets another handle, and to other forests of the process it is that of no
/// frame.
struct Handle {
  std::uint32_t slot = 0;
  std::uint32_t generation = 0;
};

/// A new value X_PC for the edge named by its child's id.
struct EdgeUpdate {
  std::string id;
  Transform X_PC;
};

/// The same by number.
struct HandleUpdate {
  Handle frame;
  Transform X_PC;
};

/// The same with how the edge's error hangs together with those of others, in the same commit.
struct TiedUpdate {
  Handle frame;
  Transform X_PC;
  const Correlation* correlation = nullptr;  ///< null: as before
};

/// Parts of a new value X_PC for the edge named by its child's id; those that are absent stay as they are.
struct PartialUpdate {
  std::string id;
  std::optional<Eigen::Vector3d> translation{};  ///< [m]
  std::optional<Eigen::Quaterniond> rotation{};
  std::optional<Covariance> covariance{};
};

/// @return kInvalidInput naming the frame and the part: not finite, not of unit length, too far away.
[[nodiscard]] Result<void> check_parts(const PartialUpdate& edge);

/// How an edge behaves in time.
struct EdgeTiming {
  /// How much of its past is kept: samples that are not older than this before the newest,
  std::chrono::nanoseconds span = std::chrono::seconds(10);
  /// and no more than so many; at least 2.
  std::size_t count = 2048;
  /// How much the edge may have strayed from the geodesic between two samples, or from its last value: covariance
  /// a second. Between samples at distance Δt, a of the way: a (1-a) Δt Q, as of a Brownian bridge.
  Covariance process_noise{};
  /// It is moving from its first update on; else from the first that is given a stamp.
  bool moving = false;
  /// Samples further ahead of the owner's clock than this are refused; max(): none are.
  std::chrono::nanoseconds max_ahead = std::chrono::seconds(60);
  /// So many samples in a row that are older than the span, each younger than the one before, start the history again: the
  /// clock of their source has jumped back. 0: never.
  std::size_t restart_after = 5;
};

/// That the history of an edge has started again.
struct HistoryRestart {
  std::string id;
  Time newest;  ///< sample before
  Time stamp;   ///< of the first sample of the new history
};

/// What a lookup asks for: of what time, and how far covariance is to be propagated.
struct Query {
  std::optional<Time>
      at;  ///< absent: the newest instant of which all moving edges of the path have data
  /// How far beyond an edge's newest sample its motion may be taken to go on as between its last two.
  std::chrono::nanoseconds extrapolate{0};
  /// Until when the answer is to hold: the process noise of the moving edges from the instant of the answer until then
  /// is added to its covariance.
  std::optional<Time> age_noise_until;
  Order order = Order::kSecond;
};

/// What the covariance of an answer rests on. Errors that nothing is said of are taken as independent.
struct Basis {
  Order order = Order::kSecond;
  /// Edges of unknown correlation are on the path: the covariance is a bound that holds for any.
  bool bound = false;
  std::vector<std::string> sources;  ///< that edges of the path share; those of observations, too
};

/// A transform and the instant of which it tells; absent: it holds for all times, as of static edges only.
struct StampedTransform : Transform {
  std::optional<Time> stamp;
  Basis basis{};
};

/// The one transform that a belief comes to, and what that rests on.
[[nodiscard]] StampedTransform settled(const Belief& X, Order order, std::optional<Time> stamp);

/// The ends of a run of edges.
struct PathEnds {
  std::string from;
  std::string to;
};

/// What one owner says of its part of a path: all of one commit, and of one instant.
struct SegmentValues {
  std::vector<Transform> values;  ///< one a segment
  std::optional<Time> stamp;
  /// Since the sample before the newest, of the edge whose newest sample is the oldest.
  std::chrono::nanoseconds period{0};
  std::vector<Transform> at_hint;  ///< the same at another instant; empty if that is not to be had
  /// By segment, whose values' covariances are of own parts then; empty if no edge is tied to any other.
  std::vector<Ties> ties{};
  std::vector<Ties> ties_at_hint{};
  std::uint64_t commit = 0;       ///< of which the values are; see revise()
  std::uint64_t history = 0;      ///< the newest of their edges': see News
  std::uint64_t incarnation = 0;  ///< of the owner that counts the commits; see Partition
};

/// What of an edge, while it hangs under this parent, somebody has seen already: to begin with, nothing.
struct EdgeCursor {
  std::string id;
  std::string parent;
  std::uint64_t history = 0;  ///< of the values seen; 0: none
  std::uint64_t commit = 0;   ///< up to which they were seen
  Handle frame{};             ///< found by id where it is not there any more
};

/// A value of one of several edges, by its index among them.
struct News {
  std::uint32_t index = 0;
  std::optional<Time> stamp;
  Transform X;
  Correlation correlation{};  ///< of the edge, with the last of its values only
  /// Of values that have to do with each other. Where an edge is moved, or added again, or forgets its past, another one
  /// begins, of a higher number.
  std::uint64_t history = 0;
  /// That of the edge, with the first of its values that is told of a history only.
  std::optional<Covariance> process_noise{};
};

/// Values that were written to edges until a commit.
struct NewsOfCommit {
  std::vector<News> values;  ///< older stamps first, and before them those that hold for all times
  std::uint64_t commit = 0;
};

/// Which samples of a moving edge are told.
struct NewsQuery {
  bool newest_only = false;
  /// Where nothing was seen yet: those since the last that is not younger than this, instead of the newest.
  std::optional<Time> from{};
};

/// What is kept of one edge's past.
struct PastInfo {
  std::string id;
  std::size_t samples = 0;
  std::size_t bytes = 0;
  std::chrono::nanoseconds span_limit{0};
  std::size_t count_limit = 0;
  std::optional<Time> oldest;
  std::optional<Time> newest;
  std::chrono::nanoseconds mean_gap{0};  ///< between samples
  std::chrono::nanoseconds max_gap{0};
  std::chrono::nanoseconds jitter{0};  ///< standard deviation of the gaps
  std::uint64_t refused_old = 0;       ///< samples that were older than what is kept,
  std::uint64_t refused_equal = 0;     ///< or of the stamp of another,
  std::uint64_t refused_ahead = 0;     ///< or too far ahead of the owner's clock
};

/// A run of edges on a path that one owner holds: X from `from` to `to`.
struct Segment {
  Owner owner = kHeldHere;
  std::string from;
  std::string to;
};

/// What is known of one frame besides its value.
struct FrameInfo {
  std::string id;
  std::string parent;  ///< empty: a root
  Owner owner = kHeldHere;
  bool attached = false;    ///< its parent is there
  std::uint64_t since = 0;  ///< when it was hung where it hangs, as whoever did it counts
};

/// What of a held edge outlives its process.
struct ChangedEdge {
  std::string id;
  Transform X_PC;  ///< its covariance is that of the edge's own part where it has ties
  KeptTies ties{};
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
                                 std::uint64_t since = 0);

  /// Removes a held frame and all held frames below it that are reached through held ones. O(removed).
  /// @return the removed ids; kUnknownFrame, kNotOwner.
  [[nodiscard]] Result<std::vector<std::string>> remove(std::string_view id);

  /// Removes one held frame and nothing below it, what hangs there waits for another of that id.
  /// O(subtree). @return kUnknownFrame, kNotOwner.
  [[nodiscard]] Result<void> release(std::string_view id);

  /// Gives an edge a new value; with a stamp, a sample of it. Without one the clock's time is taken for a moving edge,
  /// while a static edge has its value replaced. Allocation-free, but while an edge's past grows to its limits and
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
  [[nodiscard]] Result<void> update_tied(const std::vector<TiedUpdate>& edges,
                                         std::optional<Time> stamp = std::nullopt);

  /// Gives parts of edges new values, as one commit: what is absent stays as it is in the newest value of then.
  /// @return as update(); kInvalidInput also where a part is none (naming it).
  [[nodiscard]] Result<void> update_partial(const std::vector<PartialUpdate>& edges,
                                            std::optional<Time> stamp = std::nullopt);

  /// Says how an edge behaves in time; what was kept of its past goes.
  /// @return kUnknownFrame, kNotOwner, kInvalidInput (naming the field).
  [[nodiscard]] Result<void> set_timing(std::string_view id, const EdgeTiming& timing);

  /// That of all edges for which nothing else is said, from their first sample on.
  [[nodiscard]] Result<void> set_default_timing(const EdgeTiming& timing);

  /// Says how an edge's error hangs together with those of others, from now on and for all its past. Updates leave that as
  /// it is.
  /// @return kUnknownFrame, kNotOwner, kInvalidInput (naming the source).
  [[nodiscard]] Result<void> correlate(std::string_view id, const Correlation& correlation);

  /// Takes up what an earlier process has kept of a held edge's correlation.
  /// @return as correlate().
  [[nodiscard]] Result<void> resume(std::string_view id, const KeptTies& ties);

  /// Gives edges the values that an observation makes of them, as one commit: all, or on an error none. What it says of
  /// correlation holds until the edge's next update; on a moving edge, whose next sample comes anyway, it is only added to
  /// the covariance. A sample of the very stamp is replaced.
  /// @param stamp  of moving edges
  /// @param seen  the commit of the values that were observed
  /// @return as update(); kChangedMeanwhile (a static edge was written since `seen`, or a moving one has no stamp given).
  [[nodiscard]] Result<void> revise(const std::vector<Revision>& edges, std::optional<Time> stamp,
                                    std::uint64_t seen);

  /// Hangs a held frame, with all below it, under a new parent; empty makes it a root. Keeps the edge's
  /// value where X_PC is not given, but nothing of its past, which was that of another edge: it is static until its next
  /// sample. O(subtree).
  /// @return kUnknownFrame, kNotOwner, kUnknownParent, kCycle, kInvalidInput (not finite).
  [[nodiscard]] Result<void> move(std::string_view id, std::string_view parent,
                                  const std::optional<Transform>& X_PC = std::nullopt,
                                  std::uint64_t since = 0);

  // --- frames held elsewhere: structure only ---

  /// Notes that `owner` holds a frame, new or known. A held frame is not touched.
  /// @return kAlreadyExists (it is held here), kCycle (kept as a root), kInvalidInput (id, owner).
  [[nodiscard]] Result<void> put_remote(std::string_view id, std::string_view parent, Owner owner,
                                        std::uint64_t since = 0);

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
  /// The value of a held edge: what observations have left of shares is added to its covariance.
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
  [[nodiscard]] NewsOfCommit news(std::vector<EdgeCursor>& cursors, const NewsQuery& query) const;

  /// Takes over what news() of another forest told, as one commit. What is here already, or older than what is kept, is
  /// passed over; where process noise is told, the edge's past goes.
  /// @param edges  held here, by the values' indices
  /// @param replace  samples of which there is another with that stamp; else they are passed over
  void take(const std::vector<Handle>& edges, const std::vector<News>& values, bool replace = true);

  /// Calls a function after each commit, from the thread that made it, which holds the forest's lock: it must be quick
  /// and not write to the forest. Null: none any more.
  /// @param whose  each may have one
  void on_commit(std::function<void()> listener, const void* whose = nullptr);

  /// The same for histories that have started again, before the commit that does it is visible.
  void on_restart(std::function<void(const HistoryRestart&)> listener);

  /// What is kept of the past of held edges, those that are moving; of one where an id is given. Takes no lock. O(slots
  /// and samples).
  [[nodiscard]] std::vector<PastInfo> pasts(std::string_view id = {}) const;

  /// Grows with every change of the structure (not of values).
  [[nodiscard]] std::uint64_t structure_version() const;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace tfdude
