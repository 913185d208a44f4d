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
#include "tfdude/client/stream.hpp"
#include "tfdude/client/subscription.hpp"
#include "tfdude/client/watch.hpp"
#include "tfdude/math/observation.hpp"
#include "tfdude/math/transform.hpp"
#include "tfdude/transport/transport.hpp"
#include "tfdude/types/change.hpp"
#include "tfdude/types/correlation.hpp"
#include "tfdude/types/edge.hpp"
#include "tfdude/types/frame.hpp"
#include "tfdude/types/joint_spec.hpp"
#include "tfdude/types/options.hpp"
#include "tfdude/types/partition_info.hpp"
#include "tfdude/types/query.hpp"

namespace tfdude {

class Participant;

/// A process's access to all frames of a domain. See Node for a process that owns frames.
///
/// Frames are found in this process's replica of the structure, so that what is not there is known
/// without asking; requests go straight to the owners.
///
/// @par Thread safety  All functions may be called from any thread; each waits for its own answer only.
/// @par Errors  Every function may also fail with kUnreachable (a partition concerned is known to be
///   down), kTimeout (one did not answer in time, named in the message) or kNotOwner (the structure kept
///   changing while asked); those are left out below.
/// @par Time bounds  Each call has one deadline, which counts for all that it waits for: meeting others, asking, waiting.
///   Where nothing else is said it is Options::timeout after the call began; in the first Options::discovery of a
///   participant, what is left of that later. A call returns 20 ms after its deadline at the latest, as far as the
///   machine lets it run; it then fails with kTimeout, which says who or what was missing. Before everybody who is there
///   was met, that is said instead of kUnknown... and kNotConnected.
class TFDUDE_EXPORT Client {
 public:
  /// Joins a domain over DDS; does not wait for anybody. At once (some milliseconds).
  /// @return kConfig (profile), kTransport, kInvalidInput (domain).
  [[nodiscard]] static Result<Client> open(const Options& options = {});

  /// Joins over any transport. At once.
  [[nodiscard]] static Result<Client> open(TransportPtr transport, const Options& options = {});

  Client(const Client&) = delete;
  Client& operator=(const Client&) = delete;
  Client(Client&&) noexcept;
  Client& operator=(Client&&) noexcept;
  /// Leaves. After this has returned no callback is running or will run, but for one that calls this itself, which may go
  /// on without the Client. Lookups that wait are cancelled; futures of them are answered kTimeout. Waits for callbacks
  /// that run, and at most for Options::linger until owners have acknowledged what was streamed to them.
  ~Client();

  /// Adds a frame; an empty parent makes a root.
  /// @param partition  its owner; empty: its parent's (or, on a Node without a parent, this node's)
  /// @return kAlreadyExists, kUnknownParent, kUnknownPartition, kInvalidInput.
  [[nodiscard]] Result<void> add(const std::string& id, const std::string& parent,
                                 const Transform& X_PC, const std::string& partition = {});

  /// Removes a frame and all below it, whoever owns them; all partitions concerned are told at once.
  /// Where a partition does not answer, the others' frames are removed none the less.
  /// @return kUnknownFrame.
  [[nodiscard]] Result<void> remove(const std::string& id);

  /// Says that a partition which is not there is gone for good: nothing of it is kept by anybody, neither by those who
  /// are away now and hear of it when they return. Its own file is not touched; if it is started again, it is new.
  /// Thread-safe; takes `timeout` at most, beside the discovery.
  /// @return kUnknownPartition; kPartitionTaken where it is there, for this participant or for one that was told
  [[nodiscard]] Result<void> forget(const std::string& partition);

  /// Gives the edge from a frame's parent to the frame a new value, acknowledged by its owner. On a Node an
  /// own edge costs no network, no lock that readers know, no allocation, and never waits.
  ///
  /// With a stamp (of the source's clock) the value is a sample, and the edge is moving from its first one on: between
  /// samples it is interpolated, before and after them it has no value. Without a stamp it is, on a moving edge, a
  /// sample of when its owner gets it, and on a static edge the value for all times.
  /// @return kUnknownFrame, kTooOld (older than what is kept), kStampTaken.
  [[nodiscard]] Result<void> update(const std::string& id, const Transform& X_PC,
                                    std::optional<Time> stamp = std::nullopt);
  [[nodiscard]] Result<void> update(Handle frame, const Transform& X_PC,
                                    std::optional<Time> stamp = std::nullopt);

  /// Many edges: each owner applies its share as one, so that nobody sees half of it. Another process takes
  /// at most kMaxItems edges at once. All are of one stamp, so that lookups at an instant see all or none, whoever owns
  /// them.
  [[nodiscard]] Result<void> update(const std::vector<EdgeUpdate>& edges,
                                    std::optional<Time> stamp = std::nullopt);
  [[nodiscard]] Result<void> update(const std::vector<HandleUpdate>& edges,
                                    std::optional<Time> stamp = std::nullopt);

  /// Gives parts of edges new values: translation, rotation or covariance, whichever is given. The rest stays as it is in
  /// the edge's newest value at its owner, who decides that in the commit of the update. For the rest as update().
  /// @return kUnknownFrame, kInvalidInput (naming the part), kTooOld, kStampTaken.
  [[nodiscard]] Result<void> update_partial(const std::vector<PartialUpdate>& edges,
                                            std::optional<Time> stamp = std::nullopt);

  /// Streams new edge values to their owners, unacknowledged: the path for joints at 1 kHz and more. Waits, within the bound
  /// of all calls, only until they can be reached. A share that an owner cannot take in time may be lost, never torn. Whoever
  /// can be reached gets its share, also where another cannot. Stamps as for update(); refused samples are counted
  /// (histories()).
  /// @return kUnknownFrame.
  [[nodiscard]] Result<void> publish(const std::vector<EdgeUpdate>& edges,
                                     std::optional<Time> stamp = std::nullopt);

  /// Edges, or joints, to which a real-time thread streams without waiting (stream.hpp); they may come later. Asks nobody, but
  /// makes what is needed to send to those who are known (some milliseconds).
  /// @return kInvalidInput: one that is no id, or is named twice; more than kMaxItems.
  [[nodiscard]] Result<EdgeStream> stream(const std::vector<std::string>& edges);
  [[nodiscard]] Result<JointStream> stream_joints(const std::vector<std::string>& names);

  /// Waits until all that was streamed by this client has reached the owners. At most `wait`.
  /// @return kTimeout or kUnreachable, naming one whom not all has reached. More than 64 samples at once may overwrite each
  ///   other on their way: those count as arrived.
  [[nodiscard]] Result<void> flush(Milliseconds wait);

  /// Streams positions of joints to those who have the frames that they move, unacknowledged: about 40 bytes a joint instead
  /// of 250 for its edge. The owners compute poses and covariances (joint_transform()), of all joints of the call as one commit; those that
  /// follow a joint move with it. All are of one stamp, as for update(). Whoever can be reached gets its share, also where
  /// another cannot.
  /// @param positions  one a name [rad or m]
  /// @param variances  of these [rad² or m²]
  /// @return kUnknownJoint, kInvalidInput (naming the joint: not a number, a negative variance; not one of each a name).
  [[nodiscard]] Result<void> publish_joints(const std::vector<std::string>& names,
                                            const std::vector<double>& positions,
                                            const std::vector<double>& variances,
                                            std::optional<Time> stamp = std::nullopt);

  /// The same, acknowledged by the owners. @return also kInvalidInput where a joint that is strict is to leave its limits, or
  ///   none moves a frame; kTooOld, kStampTaken.
  [[nodiscard]] Result<void> update_joints(const std::vector<std::string>& names,
                                           const std::vector<double>& positions,
                                           const std::vector<double>& variances,
                                           std::optional<Time> stamp = std::nullopt);

  /// A partition's joints, and where they are, sorted by name. One round trip for each kMaxItems of them.
  /// @return kUnknownPartition.
  [[nodiscard]] Result<std::vector<JointInfo>> joints(const std::string& partition);

  /// Hangs a frame with all below it under a new parent (empty: makes it a root); it stays its owner's.
  /// @param X_PC  the new edge's value; where absent, the old edge's is kept
  /// @return kUnknownFrame, kUnknownParent, kCycle.
  [[nodiscard]] Result<void> move(const std::string& id, const std::string& parent,
                                  const std::optional<Transform>& X_PC = std::nullopt);

  /// X_AB, the pose of frame b in frame a, with the covariance of its right perturbation, expressed in b, at the newest
  /// instant of which all moving edges on the path have data. Edges are taken as their owners say (Correlation), of which
  /// nothing is said as independent; covariance to second order. On a Node a
  /// path of own edges costs no network, no lock and no allocation; else one round trip, whatever the number of
  /// partitions on the path, or two where these have no common instant near that which was foreseen (see latest.hpp):
  /// where the answer was foreseen, it may be up to two samples of the slowest edge older than the newest.
  /// A handle is of this client only: another's is that of no frame.
  /// @return kUnknownStart, kUnknownEnd, kNotConnected, kNotYet, kTooOld (no instant of which all edges have data).
  [[nodiscard]] Result<Transform> lookup(std::string_view a, std::string_view b);
  [[nodiscard]] Result<Transform> lookup(Handle a, Handle b);

  /// The same without its covariance. On a path of own edges this takes a fraction of the time.
  [[nodiscard]] Result<Pose> lookup_pose(std::string_view a, std::string_view b);
  [[nodiscard]] Result<Pose> lookup_pose(Handle a, Handle b);

  /// X_AB at an instant: all partitions answer for the same.
  /// @return as above; kNotYet, kTooOld (naming the edge that has no data of it, and the gap).
  [[nodiscard]] Result<StampedTransform> lookup(std::string_view a, std::string_view b,
                                                const Query& query);
  [[nodiscard]] Result<StampedTransform> lookup(Handle a, Handle b, const Query& query);

  /// The same, waiting for frames and data that are not there yet, so long at most, whatever has to be done meanwhile
  /// (Options::timeout bounds only how long an owner is waited for before it is asked anew). Milliseconds::max(): without
  /// end. What is not kept any more fails at once.
  /// @return as above, what was missing last; kTimeout where there was no answer at all.
  [[nodiscard]] Result<StampedTransform> lookup(std::string_view a, std::string_view b,
                                                const Query& query, Milliseconds wait);

  /// Frame b at one instant seen from frame a at another, by way of a frame that is taken as fixed meanwhile:
  /// X_AF(at_a) X_FB(at_b). The two ways are taken as independent.
  [[nodiscard]] Result<StampedTransform> lookup(std::string_view a, const Query& at_a,
                                                std::string_view b, const Query& at_b,
                                                std::string_view fixed);

  /// As lookup() with a wait, answering to a function, on a thread of the library's that holds no lock. The function may
  /// use the client, destroy it or the PendingLookup, take any time (others are called by other threads meanwhile), and must
  /// not throw. Returns at once; thousands that wait need one thread.
  [[nodiscard]] PendingLookup lookup_async(const std::string& a, const std::string& b,
                                           const Query& query, Milliseconds wait,
                                           PendingLookup::Callback callback);
  /// The same, answering to a future: the wait later at most, or when the client is destroyed.
  [[nodiscard]] std::future<Result<StampedTransform>> lookup_async(const std::string& a,
                                                                   const std::string& b,
                                                                   const Query& query,
                                                                   Milliseconds wait);

  /// Whether lookup() would answer; if not, why. Takes as long as that.
  [[nodiscard]] Result<void> can_lookup(std::string_view a, std::string_view b,
                                        const Query& query = {});

  /// Has the path's owners push what changes on it; waits until its first values are here, Options::timeout at most.
  /// @return as lookup().
  [[nodiscard]] Result<PathWatch> watch(const std::string& a, const std::string& b,
                                        const WatchOptions& options = {});

  /// Takes a measurement of X_AB into account: distributes it over the edges between a and b by their uncertainty (see
  /// tfdude/math/observation.hpp), whoever owns them; each owner applies its part as one commit. Moving edges are corrected
  /// by a sample of the measurement's stamp. A measurement that the gate refuses changes nothing, which is no error.
  /// Takes two round trips and more, as edges are asked one by one, with those that were observed together with them.
  /// @param X_AB  its covariance is that of the measurement's own error
  /// @param stamp  when it was taken; absent: the newest instant of which all moving edges have data
  /// @return as lookup(); kChangedMeanwhile (an edge goes on being written), kInvalidInput (no edge is uncertain, or all
  ///   that are have an unknown correlation). Where only some owners have applied their part, the error says so.
  [[nodiscard]] Result<Observed> observe(const std::string& a, const std::string& b,
                                         const Transform& X_AB,
                                         std::optional<Time> stamp = std::nullopt,
                                         const ObserveOptions& options = {});

  /// The same for the edge from a frame's parent to the frame: merges a measurement with what the edge holds.
  /// @return as observe(); kUnknownFrame, kInvalidInput (a root).
  [[nodiscard]] Result<Observed> fuse(const std::string& id, const Transform& X_PC,
                                      std::optional<Time> stamp = std::nullopt,
                                      const ObserveOptions& options = {});

  /// Says how the error of an edge is correlated with those of others: for all its values, also those of its history, until
  /// it is said anew; an empty one makes it independent. Its covariance is that of its own part from now on. Acknowledged by
  /// its owner, and stored like a value. What observations have left of correlation goes.
  /// @return kUnknownFrame, kInvalidInput (naming the source; the names of observations' are not to be given; a joint that
  ///   follows another, or is followed, says it itself).
  [[nodiscard]] Result<void> correlate(const std::string& id, const Correlation& correlation);

  /// How well covariances agree with what was observed, of those edges of a partition that were observed since its process
  /// began; of kMaxItems at most. @return kUnknownPartition.
  [[nodiscard]] Result<std::vector<EdgeConsistency>> consistency(const std::string& partition);

  /// What is kept of the history of one edge; nothing for one that is static. @return kUnknownFrame.
  [[nodiscard]] Result<std::vector<HistoryInfo>> history(const std::string& id);
  /// That of a partition's moving edges, of kMaxItems at most. @return kUnknownPartition.
  [[nodiscard]] Result<std::vector<HistoryInfo>> histories(const std::string& partition);

  /// Finds a frame once, for calls that then need no hashing. @return kUnknownFrame.
  /// @note This and all below asks nobody: they answer from this process's replica of the structure, and wait only while a
  ///   new participant may still be meeting others. Without a network, and where nobody is met, they wait for the
  ///   rest of Options::discovery once, and then tell of what is known here: on a Node its own frames, else nothing.
  ///   kTimeout where somebody was met who has not told all of his by the deadline.
  [[nodiscard]] Result<Handle> find(std::string_view id);

  /// Which partitions a lookup asks, in the order of the path; empty where a is b.
  /// @return kUnknownStart, kUnknownEnd, kNotConnected.
  [[nodiscard]] Result<std::vector<PathSegment>> path(std::string_view a, std::string_view b);

  /// Empty for a root. @return kUnknownFrame.
  [[nodiscard]] Result<std::string> parent(const std::string& id);
  /// Sorted. @return kUnknownFrame.
  [[nodiscard]] Result<std::vector<std::string>> children(const std::string& id);
  /// Frames without a parent that is there; sorted.
  [[nodiscard]] Result<std::vector<std::string>> roots();
  /// Whether a frame of this id is known here at the deadline at the latest: false also where that could not be found out,
  /// as without a network. parent() tells both apart.
  [[nodiscard]] bool exists(const std::string& id);
  /// All frames, sorted by id.
  [[nodiscard]] Result<std::vector<Frame>> frames();
  /// All partitions, also those that are not reachable now; sorted by name.
  [[nodiscard]] Result<std::vector<PartitionInfo>> partitions();

  /// Calls a function with each change of the structure from now on: partitions that come and go, frames added,
  /// removed and moved, conflicts. What this participant knows already is not told. One call at a time, in
  /// order, from a thread of the library's that holds no lock: it may use the client, end its Subscription or the client
  /// (see Subscription), and must not throw. Returns at once.
  [[nodiscard]] Subscription on_change(std::function<void(const Change&)> listener);

 protected:
  explicit Client(std::unique_ptr<Participant> participant);
  std::unique_ptr<Participant> participant_;
};

}  // namespace tfdude
