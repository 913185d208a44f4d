#pragma once

#include <cstdint>
#include <functional>
#include <future>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "tfdude/base/export.hpp"
#include "tfdude/base/result.hpp"
#include "tfdude/base/time.hpp"
#include "tfdude/client/partition_watch.hpp"
#include "tfdude/client/stream.hpp"
#include "tfdude/client/subscription.hpp"
#include "tfdude/client/watch.hpp"
#include "tfdude/math/observation.hpp"
#include "tfdude/math/point.hpp"
#include "tfdude/math/transform.hpp"
#include "tfdude/transport/transport.hpp"
#include "tfdude/types/change.hpp"
#include "tfdude/types/clock_difference.hpp"
#include "tfdude/types/cloud.hpp"
#include "tfdude/types/correlation.hpp"
#include "tfdude/types/edge.hpp"
#include "tfdude/types/edge_sample.hpp"
#include "tfdude/types/explanation.hpp"
#include "tfdude/types/frame.hpp"
#include "tfdude/types/joint_spec.hpp"
#include "tfdude/types/limits.hpp"
#include "tfdude/types/many.hpp"
#include "tfdude/types/options.hpp"
#include "tfdude/types/partition_info.hpp"
#include "tfdude/types/query.hpp"
#include "tfdude/types/transformed_points.hpp"

namespace tfdude {

class Participant;

/// A process's access to all frames of a domain. See Node for a process that owns frames.
///
/// Each process has a replica of the structure. So missing frames are known without a request, and
/// requests go straight to the owners. With ClientOptions::follow it has no replica, see there.
///
/// @par Thread safety  All functions may be called from any thread. Each waits for its own answer
///   only.
/// @par Errors  Every function may also fail with kUnreachable (a partition concerned is known to
///   be down), kTimeout (the message names the partition that did not answer in time) or kNotOwner
///   (the structure kept changing during the request). The functions below do not list these. A
///   change that failed with one of the first two may have been applied, or will be when an owner
///   that hung goes on.
/// @par Waiting  Functions that read and have a parameter `wait` wait at most so long for missing
///   frames and data, as lookup() does. Zero: they do not wait for those.
/// @par Time bounds  Each call has one deadline for all that it waits for: discovery, requests and
///   replies. Unless stated otherwise it is Options::timeout after the call began. During the first
///   Options::discovery of a participant, the remainder of that is added. A call returns 20 ms
///   after its deadline at the latest, as far as the operating system schedules it. It then fails
///   with kTimeout, which says who or what was missing. While discovery is incomplete, kTimeout
///   also replaces kUnknown... and kNotConnected.
class TFDUDE_EXPORT Client {
 public:
  /// Joins a domain over DDS. Waits for no other participant; takes some milliseconds.
  /// @return kConfig (profile), kTransport, kInvalidInput (domain).
  [[nodiscard]] static Result<Client> open(const ClientOptions& options = {});

  /// Joins over any transport. Returns immediately.
  [[nodiscard]] static Result<Client> open(TransportPtr transport,
                                           const ClientOptions& options = {});

  Client(const Client&) = delete;
  Client& operator=(const Client&) = delete;
  Client(Client&&) noexcept;
  Client& operator=(Client&&) noexcept;
  /// Leaves the domain. After it has returned, no callback is running or will run, except a
  /// callback that calls it itself, which may go on without the Client. Cancels lookups that wait;
  /// their futures get kTransport. Waits for running callbacks, and at most Options::linger until
  /// owners have acknowledged streamed values.
  ~Client();

  /// Ends the waits of other threads, and those of later calls, for frames, data, values, times and
  /// participants: within 50 ms they return kTransport, or what is known. So a thread can be joined
  /// before the client is destroyed. An owner that was asked is waited for as long as before.
  /// @par Thread safety  May be called during any other call.
  void end_waits();

  /// Adds a frame. An empty parent makes it a root.
  /// @param partition  its owner; empty: the parent's owner (for a root on a Node: this node)
  /// @return kAlreadyExists, kUnknownParent, kUnknownPartition, kInvalidInput.
  [[nodiscard]] Result<void> add(const std::string& id, const std::string& parent,
                                 const Transform& X_PC, const std::string& partition = {});

  /// Removes a frame and all frames below it, whoever owns them. All partitions concerned are asked
  /// in parallel. If one of them does not answer, the frames of the others are removed all the
  /// same.
  /// @return kUnknownFrame.
  [[nodiscard]] Result<void> remove(const std::string& id);

  /// Declares that an unreachable partition will not return. All participants drop what they keep
  /// of it, also those that are away now, as soon as they return. The partition's own file is not
  /// touched; if it is started again, it counts as new.
  /// @return kUnknownPartition; kPartitionTaken if this participant, or another that was told, can
  ///   reach the partition; kUnreachable if nobody is reachable who could remember it.
  [[nodiscard]] Result<void> forget(const std::string& partition);

  /// Sets the value of the edge from a frame's parent to the frame; the owner acknowledges it. For
  /// an own edge of a Node this uses no network, no allocation and no lock that readers take, and
  /// never waits.
  ///
  /// With a stamp (of the source's clock) the value is a sample. From its first sample on the edge
  /// is dynamic: its value is interpolated between samples, and undefined before and after them.
  /// Without a stamp, the value is a sample with the owner's time of arrival if the edge is
  /// dynamic, and the value for all times if it is static. While the owner's clock stands still,
  /// such a sample replaces the one before. An owner whose external clock has no time yet rejects
  /// samples that need it, with kNotYet.
  /// @return kUnknownFrame, kTooOld (older than the kept history), kStampTaken.
  [[nodiscard]] Result<void> update(const std::string& id, const Transform& X_PC,
                                    const std::optional<Time>& stamp = std::nullopt);
  [[nodiscard]] Result<void> update(Handle frame, const Transform& X_PC,
                                    const std::optional<Time>& stamp = std::nullopt);

  /// Updates many edges. Each owner applies its share as one atomic commit. All samples have the
  /// same stamp, so a lookup at an instant sees all of them or none, whoever owns them. Another
  /// process accepts at most kMaxItems edges at once.
  [[nodiscard]] Result<void> update(const std::vector<EdgeUpdate>& edges,
                                    const std::optional<Time>& stamp = std::nullopt);
  [[nodiscard]] Result<void> update(const std::vector<HandleUpdate>& edges,
                                    const std::optional<Time>& stamp = std::nullopt);

  /// Sets parts of edges: translation, rotation or covariance. The owner takes the other parts from
  /// the edge's newest value, in the commit of the update. Otherwise as update().
  /// @return kUnknownFrame, kInvalidInput (naming the part), kTooOld, kStampTaken.
  [[nodiscard]] Result<void> update_partial(const std::vector<PartialUpdate>& edges,
                                            std::optional<Time> stamp = std::nullopt);

  /// Replaces the samples of a dynamic edge within an interval, as SLAM does when it has closed a
  /// loop: values, covariances and stamps. The owner does it in one commit, which it acknowledges:
  /// every lookup, every watch and every recording has the history before, or the one after, and
  /// never a part of it. What observations have found out about the replaced samples ends with
  /// them; the given covariances count instead. Samples before and after the interval stay.
  ///
  /// Watchers are sent all samples from the interval on, at most kMaxRewritten. An owner in another
  /// process gets the samples in several messages, and keeps none of them if they do not all come.
  /// O(samples from the interval on).
  /// @param interval  from its first to its last instant
  /// @param samples  at least one; stamps within the interval, each later than the one before
  /// @return kUnknownFrame, kTooOld (the first is older than the kept history), kTooMuch (more than
  ///   the history keeps, or kMaxRewritten), kInvalidInput (naming the sample; an edge that is
  ///   static or drifts), kUnsupported (an owner of an earlier version). Then nothing has changed,
  ///   except after kTimeout, as with every call.
  [[nodiscard]] Result<void> rewrite(const std::string& id, const TimeInterval& interval,
                                     const std::vector<EdgeSample>& samples);

  /// Streams edge values to their owners without acknowledgement, for example joints at 1 kHz and
  /// more. Waits only until the owners can be reached, within the deadline of all calls. A share
  /// that an owner cannot take in time may be lost, but never in part. If one owner cannot be
  /// reached, the others still get their shares. Stamps as for update(); rejected samples are
  /// counted (histories()).
  /// @return kUnknownFrame.
  [[nodiscard]] Result<void> publish(const std::vector<EdgeUpdate>& edges,
                                     std::optional<Time> stamp = std::nullopt);

  /// Opens a stream of edges, or joints, for a real-time thread (stream.hpp), which never waits.
  /// The edges need not exist yet. Sends no requests, but creates what is needed to send to the
  /// known owners (some milliseconds).
  /// @return kInvalidInput: an invalid or duplicate id; more than kMaxItems.
  [[nodiscard]] Result<EdgeStream> stream(const std::vector<std::string>& edges);
  [[nodiscard]] Result<JointStream> stream_joints(const std::vector<std::string>& names);

  /// Waits until everything that this client has streamed has reached the owners. Takes at most
  /// `wait`. Owners that have left, and processes in whose place a later one serves, do not count.
  /// @return kTimeout or kUnreachable, naming an owner that has not received everything. More than
  ///   64 samples at once may overwrite each other on their way; those count as arrived.
  [[nodiscard]] Result<void> flush(Milliseconds wait);

  /// Streams joint positions to the owners of the frames that the joints move, without
  /// acknowledgement. A joint takes about 40 bytes instead of 250 for its edge. Each owner computes
  /// poses and covariances (joint_transform()) of all joints of the call in one commit; joints that
  /// mimic another move with it. All samples have the same stamp, as for update(). If one owner
  /// cannot be reached, the others get their shares all the same.
  /// @param names  PARTITION/JOINT where several partitions have a joint of one name
  /// @param positions  one per name [rad or m]
  /// @param variances  of the positions [rad² or m²]; none: unspecified, and so are the edges
  /// @return kUnknownJoint, kAmbiguousJoint, kInvalidInput (naming the joint: not a number, a
  ///   negative variance; or not one of each per name).
  [[nodiscard]] Result<void> publish_joints(const std::vector<std::string>& names,
                                            const std::vector<double>& positions,
                                            const std::vector<double>& variances = {},
                                            std::optional<Time> stamp = std::nullopt);
  /// The same, for joints of which some have no variance.
  [[nodiscard]] Result<void> publish_joints(std::vector<JointValue> joints,
                                            std::optional<Time> stamp = std::nullopt);

  /// As publish_joints(), acknowledged by the owners.
  /// @return also kInvalidInput if a position is outside the limits of a strict joint, or if no
  ///   joint moves a frame; kTooOld, kStampTaken.
  [[nodiscard]] Result<void> update_joints(const std::vector<std::string>& names,
                                           const std::vector<double>& positions,
                                           const std::vector<double>& variances = {},
                                           std::optional<Time> stamp = std::nullopt);
  [[nodiscard]] Result<void> update_joints(std::vector<JointValue> joints,
                                           std::optional<Time> stamp = std::nullopt);

  /// The joints of a partition and their positions, sorted by name. One round trip per kMaxItems of
  /// them, after `wait` for the partition.
  /// @return kUnknownPartition.
  [[nodiscard]] Result<std::vector<JointInfo>> joints(const std::string& partition,
                                                      Milliseconds wait = {});

  /// The robot description (URDF) of a partition, NodeOptions::description of its Node; empty: it
  /// has none. One round trip per 32 KiB.
  /// @return kUnknownPartition; kUnsupported (an owner of protocol 1.0).
  [[nodiscard]] Result<std::string> description(const std::string& partition);

  /// How far the system's clock of a partition's host is ahead of this host's. Eight round trips.
  /// @return kUnknownPartition; kUnsupported (a partition of this process, or not over DDS)
  [[nodiscard]] Result<ClockDifference> clock_difference(const std::string& partition);

  /// Moves a frame, with all frames below it, to a new parent (empty: makes it a root). The owner
  /// stays the same.
  /// @param X_PC  the new edge's value, a Transform or parts of one; absent parts keep their value,
  ///   as the owner has it
  /// @return kUnknownFrame, kUnknownParent, kCycle.
  [[nodiscard]] Result<void> move(const std::string& id, const std::string& parent,
                                  const PartialTransform& X_PC = {});

  /// Hands a frame over to another partition, which must be reachable: from then on that owns it,
  /// and all frames below it that its owner had and reaches through its own frames, with their
  /// history, correlation, and history settings. A frame below them of another partition stays
  /// where it is. Readers find the frame, with the same values, all the time. Changes and samples
  /// are rejected for the moment that it takes, with kNotOwner if a call cannot wait. If anything
  /// fails, the frame is as before; docs/handover.md says what a death of an owner leaves, and how
  /// long it takes. Does nothing if the partition owns the frame already. O(frames and samples).
  /// @return kUnknownFrame, kUnknownPartition; kInvalidInput (a joint moves one of the frames);
  ///   kTooMuch (more than kMaxItems frames, or 65,536 samples; or the partition has no room);
  ///   kNotOwner (another handover of the frame is in progress), kChangedMeanwhile (it has lasted
  ///   too long, and the owner has kept the frame), kUnsupported (an owner of an earlier version).
  [[nodiscard]] Result<void> hand_over(const std::string& id, const std::string& partition);
  /// The same, and moves the frame below another parent (empty: makes it a root), in one step: as
  /// by move(), its edge loses its history, and those of the frames below it keep theirs.
  /// @param X_PC  as of move()
  /// @return also kUnknownParent, kCycle.
  [[nodiscard]] Result<void> hand_over(const std::string& id, const std::string& partition,
                                       const std::string& parent,
                                       const PartialTransform& X_PC = {});

  /// X_AB, the pose of frame b in frame a, with the covariance of its right perturbation, expressed
  /// in b, at one instant for all partitions: that of the query, or the newest one for which all
  /// dynamic edges on the path have data. Correlations are those that the owners state
  /// (Correlation); other edges count as independent. If the covariance of an edge is unspecified,
  /// the answer's is not complete (StatedCovariance), and its basis names the edge.
  ///
  /// A path of own edges of a Node uses no network, no lock and no allocation. Other paths take one
  /// round trip, however many partitions they cross, or two if the partitions have no common
  /// instant near the predicted one. An answer at a predicted instant may be older than the latest
  /// common time: by up to two samples of the slowest edge, and 20 ms. Of answers of the owners,
  /// none is older than an earlier one. A handle is valid for this client only; other clients treat
  /// it as an unknown frame.
  /// @param wait  how long to wait for missing frames and data, whatever happens meanwhile;
  ///   Milliseconds::max(): without a limit. Options::timeout then only bounds how long an owner is
  ///   waited for before the request is repeated. Data that is older than the kept history is not
  ///   waited for.
  /// @return kUnknownStart, kUnknownEnd, kNotConnected; kNotYet, kTooOld (naming the edge without
  ///   data for the instant, and the gap; or all edges have no instant in common); after a wait the
  ///   last reason; kTimeout if there was no answer at all.
  [[nodiscard]] Result<StampedTransform> lookup(std::string_view a, std::string_view b,
                                                const Query& query = {}, Milliseconds wait = {});
  [[nodiscard]] Result<StampedTransform> lookup(Handle a, Handle b, const Query& query = {});

  /// As lookup() of the latest common time, without the covariance. On a path of own edges this
  /// takes a fraction of the time.
  [[nodiscard]] Result<Pose> lookup_pose(std::string_view a, std::string_view b);
  [[nodiscard]] Result<Pose> lookup_pose(Handle a, Handle b);

  /// Frame b at one instant seen from frame a at another, through a frame that is assumed fixed in
  /// between: X_AF(at_a) X_FB(at_b). A static edge on both ways has the same error twice, and
  /// that of one that drifts goes on. If another dynamic edge is on both, its errors may be
  /// correlated in any way, and the covariance is an upper bound.
  [[nodiscard]] Result<StampedTransform> lookup(std::string_view a, const Query& at_a,
                                                std::string_view b, const Query& at_b,
                                                std::string_view fixed, Milliseconds wait = {});

  /// Many lookups at one common instant: that of the query, or the newest one for which all dynamic
  /// edges of all paths have data. Each owner concerned gets one request, with kMaxItems segments
  /// at most; several paths may share segments. A pair that cannot be answered gets its own error,
  /// does not count for the instant, and costs further requests: about four round trips. Values of
  /// one owner are of one commit.
  /// @param wait  until all are answered, in rounds with pauses of at most 50 ms
  /// @return one result per pair, each as of lookup(); the same error for all if there is no answer
  ///   at all
  [[nodiscard]] std::vector<Result<StampedTransform>> lookup_many(
      const std::vector<FramePair>& pairs, const Query& query = {}, Milliseconds wait = {});
  /// The poses of many frames in one.
  [[nodiscard]] std::vector<Result<StampedTransform>> lookup_many(
      const std::string& a, const std::vector<std::string>& frames, const Query& query = {},
      Milliseconds wait = {});

  /// X_AB at many instants, in any order: each as lookup() answers it. Own edges take as long as a
  /// lookup each, 0.3 to 0.6 µs. Those of others are asked for two instants a request, some dozens
  /// of requests at once, each with the deadline of a call. Instants without an answer do not keep
  /// others from theirs.
  /// @param query  Query::at is not used
  /// @param wait  for the last of the instants
  /// @return kUnknownStart, kUnknownEnd, kNotConnected
  [[nodiscard]] Result<Trajectory> trajectory(std::string_view a, std::string_view b,
                                              const std::vector<Time>& instants,
                                              const Query& query = {}, Milliseconds wait = {});

  /// As lookup() with a wait, but passes the answer to a function, on a library thread that holds
  /// no lock. The function may use the client, destroy it or the PendingLookup, and take any time
  /// (other threads call the other functions meanwhile). It must not throw. Returns immediately;
  /// thousands of waiting lookups need one thread only.
  [[nodiscard]] PendingLookup lookup_async(const std::string& a, const std::string& b,
                                           const Query& query, Milliseconds wait,
                                           PendingLookup::Callback callback);
  /// As above, with a future. It is ready when the client is destroyed, and at the latest after
  /// `wait`; without a wait, at the deadline of a call.
  [[nodiscard]] std::future<Result<StampedTransform>> lookup_async(const std::string& a,
                                                                   const std::string& b,
                                                                   const Query& query,
                                                                   Milliseconds wait);

  /// Points and directions p_B of frame b, in frame a, with the covariance of both: one lookup and
  /// tfdude::transform(). joint_covariance() of the answer's X_AB says how their errors are
  /// correlated.
  /// @return as lookup(); kInvalidInput naming the point.
  [[nodiscard]] Result<TransformedPoints> transform(std::string_view a, std::string_view b,
                                                    const std::vector<Point>& points_B,
                                                    const Query& query = {},
                                                    Milliseconds wait = {});
  /// X_AC of a pose X_BC, for example of an object seen by camera b. The error of X_BC counts as
  /// independent of the path's. @return as lookup().
  [[nodiscard]] Result<StampedTransform> transform(std::string_view a, std::string_view b,
                                                   const Transform& X_BC, const Query& query = {},
                                                   Milliseconds wait = {});

  /// A cloud of points of frame b, as columns [m], in frame a. One lookup, or with a stamp a point
  /// one for each stamp that occurs (CloudQuery::group: for each group of them), then cloud.hpp.
  /// Covariances are of second order.
  /// @param wait  for the last of the stamps
  /// @return as lookup(); kInvalidInput: not one stamp a point; a covariance that is none; the
  ///   order is not the second. If a stamp has no data, there is no answer.
  [[nodiscard]] Result<TransformedCloud<double>> transform_cloud(
      std::string_view a, std::string_view b, const Eigen::Ref<const Eigen::Matrix3Xd>& points_B,
      const CloudQuery& query = {}, Milliseconds wait = {});
  [[nodiscard]] Result<TransformedCloud<float>> transform_cloud(
      std::string_view a, std::string_view b, const Eigen::Ref<const Eigen::Matrix3Xf>& points_B,
      const CloudQuery& query = {}, Milliseconds wait = {});

  /// Whether lookup() would succeed; if not, why. Takes as long as lookup().
  [[nodiscard]] Result<void> can_lookup(std::string_view a, std::string_view b,
                                        const Query& query = {}, Milliseconds wait = {});

  /// Explains a lookup: how its variance is made up, and which measurement would reduce it; or why
  /// there is no answer, and what would help. For people and tools: takes some round trips, and no
  /// longer than a call. To second order. A path of more than kMaxCorrelated edges is not divided.
  [[nodiscard]] Explanation why(const std::string& a, const std::string& b,
                                const WhyQuery& query = {});

  /// Asks the owners of the path to push its changes. Waits until the first values have arrived, at
  /// most Options::timeout, after `wait` for frames and data.
  /// @return as lookup().
  [[nodiscard]] Result<PathWatch> watch(const std::string& a, const std::string& b,
                                        const WatchOptions& options = {}, Milliseconds wait = {});

  /// As watch(), for the edges of these frames, wherever they are: to follow many edges. While an
  /// owner is unreachable or an edge does not exist, the others get nothing new for more than
  /// seconds either, so watch the edges of each owner separately. Waits before for the frames.
  /// @return kUnknownFrame; kInvalidInput (no edges, a root, more than kMaxItems of one owner,
  ///   `composed`).
  [[nodiscard]] Result<EdgesWatch> watch_edges(const std::vector<std::string>& ids,
                                               const WatchOptions& options = {},
                                               Milliseconds wait = {});

  /// The mean velocity of frame b in frame a over an interval: the difference of its poses at both
  /// ends, divided by the length. The counterpart of tf2's lookupVelocity(b, a, time, interval):
  /// expressed in a's axes, at the origin of b.
  ///
  /// The covariance is of first order. The error of a static edge is the same at both ends, so only
  /// the part that depends on the motion remains. How the errors of a dynamic edge at the two ends
  /// are correlated is not known, so its share is an upper bound for any correlation. That is at
  /// most twice the variance of independent errors, and it is too large if the error changes
  /// slowly. The same holds for sources that dynamic edges share. Unspecified edges are named, and
  /// the covariance is that of the others. The velocity is a mean: how far it is from the velocity
  /// at an instant is not part of the covariance. Three to five round trips for the path of others.
  /// @return as lookup(); kInvalidInput (the interval is not positive; more than 128 edges; an edge
  ///   has samples that came without a stamp, around the interval or after it: they tell none; b
  ///   turns by more than half a turn on its way to the middle of the interval and on to its end).
  [[nodiscard]] Result<Velocity> velocity(const std::string& a, const std::string& b,
                                          const VelocityQuery& query = {}, Milliseconds wait = {});

  /// The time of this client's clock (Options::clock). An external clock that has not got its time
  /// yet is waited for.
  /// @return kNotYet: nobody has set or published the time.
  [[nodiscard]] Result<Time> now();

  /// Waits until this client's clock (Options::clock) has reached a time.
  /// @return kTimeout: not within `wait` of the system's time; the message says what time it is;
  ///   kTransport: the client ends
  [[nodiscard]] Result<void> wait_until(Time time, Milliseconds wait);
  [[nodiscard]] Result<void> wait_until(ExternalTime time, Milliseconds wait) {
    return wait_until(stamp_of(time), wait);
  }

  /// Sets the external clock of this client, for simulators that embed it and for tests. If the
  /// time is earlier than before, a Node clears the histories of its edges that have samples at
  /// this time or later (clear_history()). Participants that watch these edges are told. Ownership,
  /// structure and static edges stay. Samples that were on their way then are rejected.
  /// @return kInvalidInput: a negative time; the client uses the system's clock.
  [[nodiscard]] Result<void> set_time(ExternalTime now);

  /// Sends the time to all participants of the domain with an external clock, and sets that of this
  /// client, if it has one. Not acknowledged: a value may be lost. Participants that start later
  /// have no time before the next value, so publish it also while it stands still. The first call
  /// takes some milliseconds, later calls do not wait. There should be one publisher: each time
  /// that is earlier than the one before clears histories.
  /// @return kInvalidInput: a negative time; kNotPermitted, kTransport.
  [[nodiscard]] Result<void> publish_clock(ExternalTime now);

  /// As publish_clock(), acknowledged: returns when the clocks of all reachable owners that have an
  /// external clock show the time, for simulations in lock-step. Others, and clients, are not
  /// waited for. One round trip, if nothing is lost. Nobody else may publish the time.
  /// @return kInvalidInput, kNotPermitted, kTransport as publish_clock(); kTimeout: not within
  ///   `wait`, naming an owner; kUnsupported: an owner of protocol 1.0
  [[nodiscard]] Result<void> advance_to(ExternalTime time, Milliseconds wait);

  /// Asks the owner of a partition to push all its values and their changes, and reports them with
  /// the partition's structure to a function: for displays and recordings of whole robots. Returns
  /// before the first news. Watch each partition that on_change() reports as up to see all of them.
  /// Values of one commit come together, or in several parts if the partition has more than
  /// kMaxItems edges, or more than kMaxCommonErrors that are correlated with others.
  /// @return kUnknownPartition, kInvalidInput (the rate).
  [[nodiscard]] Result<PartitionWatch> watch_partition(const std::string& partition,
                                                       const PartitionWatchOptions& options);

  /// Applies a measurement of X_AB: corrects the edges between a and b according to their
  /// uncertainty (see tfdude/math/observation.hpp), whoever owns them. Each owner applies its part
  /// as one commit. Dynamic edges are corrected by a sample with the measurement's stamp. A
  /// measurement that the gate rejects changes nothing; this is not an error. Takes at least two
  /// round trips, since each edge is requested separately, together with those that were observed
  /// with it. If an owner rejects its part, the others' parts are taken back.
  /// @param X_AB  with the covariance of the measurement's own error
  /// @param stamp  time of the measurement; absent: the newest instant for which all dynamic edges
  ///   have data
  /// @return as lookup(); kChangedMeanwhile (an edge keeps being written), kInvalidInput (no edge
  ///   is uncertain, or all uncertain ones are of unknown correlation). The error says if only some
  ///   owners have applied their part.
  [[nodiscard]] Result<Observed> observe(const std::string& a, const std::string& b,
                                         const Transform& X_AB,
                                         std::optional<Time> stamp = std::nullopt,
                                         const ObserveOptions& options = {});

  /// Gives one edge the value by which a path over it is X_AB, as observe() does with an edge of
  /// unspecified covariance: the value replaces the one before, and no other edge is corrected. For
  /// poses that a filter has estimated from the same sensors as those before: X_AB is that of the
  /// robot in the map, the edge that of the odometry's frame in the map.
  /// @param id  the frame whose edge to its parent takes the value
  /// @return as observe(); kInvalidInput: the path has no such edge
  [[nodiscard]] Result<Observed> determine(const std::string& id, const std::string& a,
                                           const std::string& b, const Transform& X_AB,
                                           std::optional<Time> stamp = std::nullopt);

  /// As observe(), for the edge from a frame's parent to the frame: merges a measurement with the
  /// edge's value.
  /// @return as observe(); kUnknownFrame, kInvalidInput (a root).
  [[nodiscard]] Result<Observed> fuse(const std::string& id, const Transform& X_PC,
                                      std::optional<Time> stamp = std::nullopt,
                                      const ObserveOptions& options = {});

  /// Sets how the error of an edge is correlated with those of other edges, for all its values
  /// including its history, until the next call. An empty correlation makes it independent. From
  /// then on the edge's covariance is that of its own part. The owner acknowledges it and stores it
  /// like a value. Correlations from earlier observations are dropped.
  /// @return kUnknownFrame, kInvalidInput (naming the source; sources of observations may not be
  ///   given; joints that mimic another, or are mimicked, set their correlation themselves).
  [[nodiscard]] Result<void> correlate(const std::string& id, const Correlation& correlation);

  /// How well covariances agree with the observations, for the edges of a partition that were
  /// observed since its process started; at most kMaxItems. @return kUnknownPartition.
  [[nodiscard]] Result<std::vector<EdgeConsistency>> consistency(const std::string& partition);

  /// Statistics of an edge's history; empty for a static edge. Waits before for the frame.
  /// @return kUnknownFrame.
  [[nodiscard]] Result<std::vector<HistoryInfo>> history(const std::string& id,
                                                         Milliseconds wait = {});
  /// As history(), for the dynamic edges of a partition, which is waited for; at most kMaxItems.
  /// @return kUnknownPartition.
  [[nodiscard]] Result<std::vector<HistoryInfo>> histories(const std::string& partition,
                                                           Milliseconds wait = {});

  /// Finds a frame once, for later calls without hashing. @return kUnknownFrame.
  /// @note This function and all below send no requests. They answer from this process's replica of
  ///   the structure, and wait only while a new participant may still be discovering others.
  ///   Without a network, and if nobody is discovered, they wait once for the rest of
  ///   Options::discovery. Then they answer from what is known here: on a Node its own frames,
  ///   otherwise nothing. They fail with kTimeout if a participant was discovered that has not
  ///   announced all its frames by the deadline.
  [[nodiscard]] Result<Handle> find(std::string_view id);

  /// The partitions that a lookup asks, in the order of the path; empty if a is b.
  /// @return kUnknownStart, kUnknownEnd, kNotConnected.
  [[nodiscard]] Result<std::vector<PathSegment>> path(std::string_view a, std::string_view b);

  /// The id of the parent; empty for a root. @return kUnknownFrame.
  [[nodiscard]] Result<std::string> parent(const std::string& id);
  /// The ids of the children, sorted. @return kUnknownFrame.
  [[nodiscard]] Result<std::vector<std::string>> children(const std::string& id);
  /// Frames without an existing parent, sorted.
  [[nodiscard]] Result<std::vector<std::string>> roots();
  /// Whether a frame with this id is known here at the deadline at the latest. False also if that
  /// could not be determined, as without a network; whether_exists() tells the two apart.
  [[nodiscard]] bool exists(const std::string& id);
  /// Whether a frame with this id exists. Beware: the Result is true also if its value is false.
  /// @return kTimeout, kUnreachable, kIncompatible, kNotPermitted: nobody can say now.
  [[nodiscard]] Result<bool> whether_exists(const std::string& id);
  /// All frames, sorted by id; also those of partitions that were lost before this process started,
  /// as an owner of others knows them. Those that a partition has announced and does not send are
  /// missing: then its PartitionInfo::complete is false.
  [[nodiscard]] Result<std::vector<Frame>> frames();
  /// All partitions, including unreachable ones, sorted by name.
  [[nodiscard]] Result<std::vector<PartitionInfo>> partitions();
  /// Asks all reachable partitions whether their memory can be read from here, as the first lookup
  /// of one of their frames does in the background: so partitions() tells it, and the next lookup
  /// reads it. Waits at most for Options::timeout for each that does not answer. O(partitions).
  void find_memory();

  /// Calls a function for each later change of the structure: partitions that come or go, frames
  /// added, removed or moved, conflicts. What this participant already knows is not reported. One
  /// call at a time, in order, from a library thread that holds no lock. The function may use the
  /// client, and end its Subscription or the client (see Subscription). It must not throw. Returns
  /// immediately.
  [[nodiscard]] Subscription on_change(std::function<void(const Change&)> listener);

 protected:
  explicit Client(std::unique_ptr<Participant> participant);
  std::unique_ptr<Participant> participant_;
};

}  // namespace tfdude
