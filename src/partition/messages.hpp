#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "tfdude/base/result.hpp"
#include "tfdude/base/time.hpp"
#include "tfdude/math/observation.hpp"
#include "tfdude/types/joint_spec.hpp"
#include "tfdude/types/limits.hpp"
#include "tfdude/types/version.hpp"

#include "partition/handover_messages.hpp"
#include "tree/forest.hpp"

// The messages between participants, independent of any transport. idl/tfdude.idl defines their
// wire format.
namespace tfdude {

/// Identifies a participant: assigned by the transport, unique in a domain, new at every start.
using PeerId = std::array<std::uint8_t, 12>;

/// The latest Lamport time of a structure change known to a sender (Directory::next_lamport_time).
/// Its own change gets a later one, whatever the owner's clock says, so that successive changes of
/// one client keep their order.
using LamportTime = std::uint64_t;

struct AddRequest {
  std::string parent;  ///< empty: a root
  Transform X_PC;
  LamportTime lamport_time = 0;
};

/// Removes frames with all frames below them that the asked partition owns. Without frames, the
/// reply only reports the epoch of the partition's structure; the request's id is then the
/// partition's name.
struct RemoveRequest {
  std::vector<std::string> tops;
  LamportTime lamport_time = 0;
};

struct UpdateRequest {
  std::vector<EdgeUpdate> edges;  ///< at least one
  std::optional<Time> stamp{};    ///< of all of them
};

/// Parts of values; the owner keeps the absent parts.
struct PartialUpdateRequest {
  std::vector<PartialUpdate> edges;  ///< at least one
  std::optional<Time> stamp{};       ///< of all of them
};

struct MoveRequest {
  std::string parent;     ///< empty: becomes a root
  PartialTransform X_PC;  ///< absent parts are unchanged
  LamportTime lamport_time = 0;
};

struct LookupRequest {
  std::vector<PathEnds> segments;  ///< at least one
  Query query{};
  /// Another instant at which the answer may be useful; see LatestHints.
  std::optional<Time> hint{};
  bool edges = false;  ///< each segment is an edge to be observed: its full correlation is needed
  Rows rows = Rows::kNone;  ///< of such edges
  /// A velocity is computed from the answer, so stamps that the owner has made up do not count.
  bool timed = false;
};

/// The result of an observation for the edges of one owner.
struct ReviseRequest {
  struct Edge {
    std::string id;
    NormalizedInnovation innovation;
    bool refused = false;  ///< the gate rejected the measurement
    std::optional<Revision> revision;
  };
  std::vector<Edge> edges;        ///< at least one
  std::optional<Time> stamp{};    ///< at which dynamic edges were observed
  std::uint64_t seen = 0;         ///< SegmentValues::commit of the observed values
  std::uint64_t incarnation = 0;  ///< SegmentValues::incarnation of that commit
};

/// Some of the samples that are to replace those of the edge named by the request's id within an
/// interval. The part with the last samples is sent when all others have been answered; with it the
/// owner replaces all of them in one commit, or answers kChangedMeanwhile if it has not all others.
struct RewriteRequest {
  std::uint64_t number = 0;  ///< of the rewrite, among those of its sender
  TimeInterval interval;
  std::uint32_t total = 0;          ///< the number of all samples
  std::uint32_t first = 0;          ///< how many are before those here
  std::vector<EdgeSample> samples;  ///< at least one, at most kMostRewrittenAtOnce
};

/// With their covariances they fit a datagram.
inline constexpr std::uint32_t kMostRewrittenAtOnce = 256;

/// Sets how the error of the edge named by the request's id is correlated with others.
struct CorrelateRequest {
  Correlation correlation;
};

/// How well the covariance of the edge named by the request's id, or of all edges of the partition,
/// agrees with observations.
struct ConsistencyRequest {
  bool all = false;
};

/// Positions of joints. Each owner of some of the moved edges applies its share as one commit.
/// Streamed, or as a request.
struct JointUpdate {
  std::vector<JointValue> joints;
  std::optional<Time> stamp{};  ///< of all of them
};

/// The state of the partition's joints, sorted by name: at most kMaxItems, with names after this
/// one.
struct JointsRequest {
  std::string after{};
};

/// Declares that another, unreachable partition will not return. The request's id is the name of
/// the partition asked.
struct ForgetRequest {
  std::string partition;
  std::uint64_t incarnation = 0;  ///< the latest heard of
};

/// Asks for the values of edges, now and on every change. Changes are pushed to the group of
/// watchers with the same request, until it was not renewed for kWatchLease.
struct WatchRequest {
  std::vector<PathEnds> segments;      ///< edges, each from its parent
  bool composed = false;               ///< or runs of edges, each sent as one transform
  bool of_samples = false;             ///< as PushedQuery::of_samples; not if composed
  std::chrono::nanoseconds period{0};  ///< minimum interval; 0: every sample
  /// The reply contains the samples from the last one not later than this, instead of the newest
  /// only. Does not affect the group.
  std::optional<Time> from{};
};

/// The longest period of a watch.
inline constexpr std::chrono::hours kMaxWatchPeriod{1};

/// How long an owner pushes without a renewal.
inline constexpr Milliseconds kWatchLease{5000};

/// The history of the edge named by the request's id, or of all edges of the partition.
struct HistoryRequest {
  bool all = false;
};

/// A change of a partition's structure that a participant knows of.
struct SeenEpoch {
  std::string partition;
  std::uint64_t epoch = 0;
};

/// Asks an owner, each of which knows the frames of all others, for frames with all that are above
/// them. The request's id is the name of the partition asked.
struct FramesRequest {
  std::vector<std::string> ids;
  /// Frames with all below them; or, ending with kAnyName, all frames whose ids begin so.
  std::vector<std::string> trees{};
  std::vector<SeenEpoch> seen{};  ///< the answer must not be older
};

/// Asks for the partition's robot description, from this byte on. The request's id is the name of
/// the partition asked.
struct DescriptionRequest {
  std::uint64_t from = 0;
};

/// Asks where processes of the same computer can read the memory of the partition. The request's id
/// is the name of the partition asked.
struct MemoryRequest {};

/// Asks whether the external clock of the partition shows a time; absent: whether it has any.
/// Answered with Done, also if it uses the system's clock, or kNotYet. The request's id is the name
/// of the partition asked.
struct TimeRequest {
  std::optional<Time> shown{};
};

/// The last character of an entry of FramesRequest::trees that is the beginning of ids.
inline constexpr char kAnyName = '*';

/// A request to one partition.
struct Request {
  /// Counts the requests of one peer. A repeated number is answered again but not applied again.
  std::uint32_t sequence = 0;
  /// The frame concerned, by which a reader filters: one owned by the partition, or the new one of
  /// an add.
  std::string id;
  std::variant<AddRequest, RemoveRequest, UpdateRequest, MoveRequest, LookupRequest, WatchRequest,
               HistoryRequest, ReviseRequest, ConsistencyRequest, JointUpdate, JointsRequest,
               PartialUpdateRequest, CorrelateRequest, ForgetRequest, FramesRequest,
               DescriptionRequest, MemoryRequest, TimeRequest, RewriteRequest, HandOverRequest,
               AdoptRequest>
      body;
  /// The sender awaits no replies of this partition to requests with lower numbers, in whatever
  /// order they come. Not greater than the full number of this request, of which `sequence` has the
  /// lower half.
  std::uint64_t awaits_from = 0;
};

/// Values written to watched edges, to be applied as one commit: a watcher that has everything up
/// to `after` then has everything up to `commit`.
struct PushedValues {
  std::uint64_t group = 0;           ///< watch_group() of the owner and the request
  std::vector<PushedValue> entries;  ///< by the index of the segment in the request
  std::uint64_t after = 0;           ///< a commit of the owner; 0: all values
  std::uint64_t commit = 0;          ///< a later commit
  std::uint32_t piece = 0;           ///< index among the pieces
  std::uint32_t pieces = 1;
};

/// The number of correlated entries; a message has at most kMaxCorrelated of them.
[[nodiscard]] std::size_t correlated_entries(const PushedValues& pushed);

/// A frame and its owner. A FramesRequest is answered with a list of them, parents before children:
/// requested frames that are not in it do not exist.
struct KnownFrame {
  std::string id;
  std::string parent;  ///< empty: a root; otherwise the frame is only attached if it exists
  std::string partition;
};

/// The bytes of a robot description that a request names, at most kMaxDescriptionPart.
struct DescriptionPart {
  std::uint64_t size = 0;  ///< of the whole text; 0: there is none
  std::uint64_t hash = 0;  ///< of the whole text, to recognize parts of another one
  std::string text;
};

inline constexpr std::size_t kMaxDescriptionPart = 32768;

/// Where processes of the same computer can read the memory of an owner.
struct MemoryOffer {
  std::string kernel;  ///< that runs the owner: the random id of its start
  std::string socket;  ///< at which it passes its memory to who shows the token; empty: nowhere
  std::array<std::uint64_t, 2> token{};  ///< random
  std::uint64_t layout = 0;              ///< layout_hash()
  std::uint64_t incarnation = 0;
  std::string why_not{};  ///< if nowhere
};

struct Done {};

struct Reply {
  std::uint32_t sequence = 0;
  /// The partition's structure after the request. A directory with this epoch shows the request's
  /// effect.
  std::uint64_t epoch = 0;
  /// Done, the error, or the requested data.
  std::variant<Done, Error, SegmentValues, PushedValues, std::vector<HistoryInfo>,
               std::vector<EdgeConsistency>, std::vector<JointInfo>, std::vector<KnownFrame>,
               DescriptionPart, MemoryOffer, HandedPart>
      body;
  /// For a change: the latest time known to the owner, for the next change of the requester.
  LamportTime lamport_time = 0;
  /// When it was sent, by the system's clock of the sender's host, as the transport knows it.
  std::optional<Time> sent{};
};

/// The group of watchers that share what an owner sends: a hash of the owner, its incarnation, and
/// the request (FNV-1a, 64 bits).
[[nodiscard]] std::uint64_t watch_group(std::string_view partition, std::uint64_t incarnation,
                                        const WatchRequest& request);

/// Edge values streamed without a reply. Each owner of some of them applies its share as one
/// commit.
struct Update {
  std::vector<EdgeUpdate> edges;
  std::optional<Time> stamp{};  ///< of all of them
};

struct PageEntry {
  std::string id;
  std::string parent;  ///< empty: a root
  /// When the frame got its parent, by its owner's count (Directory::next_lamport_time). Of two
  /// claims that exclude each other, the older one holds.
  std::uint64_t lamport_time = 0;
};

/// A joint that moves a frame of a page.
struct PageJoint {
  std::string name;
  std::string follows;  ///< the joint that it mimics; empty: none

  friend bool operator==(const PageJoint& a, const PageJoint& b) {
    return a.name == b.name && a.follows == b.follows;
  }
};

/// What became of a frame that was removed or moved, in its place: for participants that were away
/// meanwhile, and for reports of conflicts.
struct Tombstone {
  enum class Kind : std::uint8_t {
    kRemoved = 1,  ///< by request; frames that were below it before are removed, too
    kYielded = 2,  ///< `rival` has an older claim to the id
    kUnhung = 3,   ///< its move and an older one by `rival` make a cycle: it became a root
    kDropped = 4,  ///< the partition's configuration no longer names it; frames below wait for it
  };
  std::string id;
  std::uint64_t lamport_time = 0;
  Kind kind = Kind::kRemoved;
  std::string rival;  ///< a partition; empty if removed or dropped

  friend bool operator==(const Tombstone& a, const Tombstone& b) {
    return a.id == b.id && a.lamport_time == b.lamport_time && a.kind == b.kind &&
           a.rival == b.rival;
  }
};

/// A page and the epoch of its last change.
struct PageEpoch {
  std::uint32_t number = 0;
  std::uint64_t epoch = 0;
};

/// A part of a partition's structure. Pages are replaced as a whole, so that a change of a frame
/// costs its page and not the directory, and a late joiner reads pages and not frames.
struct Page {
  std::string partition;
  std::uint32_t number = 0;
  std::uint64_t incarnation = 0;
  /// The epoch that the page shows.
  std::uint64_t epoch = 0;
  std::vector<PageEntry> entries;
  std::vector<Tombstone> tombstones{};
  /// The other pages that were changed last. Once these have come, too, the structure is complete
  /// up to the page's epoch.
  std::vector<PageEpoch> others{};
  std::vector<PageJoint> joints{};
};

/// An absent partition that a participant has known or heard of.
struct Absent {
  enum class Kind : std::uint8_t {
    kSilent = 1,     ///< for a moment only: it may just be busy
    kLost = 2,       ///< silent without announcing its stop
    kStopped = 3,    ///< announced its stop
    kBack = 4,       ///< reachable again, but conflicting claims are not resolved yet
    kForgotten = 5,  ///< declared gone for good: nothing of it is kept
  };
  std::string partition;
  std::int64_t since = 0;  ///< [ns since the UNIX epoch], by the clock of the observer
  Kind kind = Kind::kLost;
  std::uint64_t incarnation = 0;  ///< the latest heard of

  friend bool operator==(const Absent& a, const Absent& b) {
    return a.partition == b.partition && a.since == b.since && a.kind == b.kind &&
           a.incarnation == b.incarnation;
  }
};

/// Announces which process serves a partition. Valid as long as its participant is alive.
struct Presence {
  std::string partition;
  /// Numbers the partition's processes; greater is later (IncarnationSource).
  std::uint64_t incarnation = 0;
  std::string host;
  std::uint32_t pid = 0;
  std::uint32_t pages = 0;  ///< number of pages of its structure
  bool serving = false;     ///< false: the name is only claimed yet, or given up
  /// The partitions that the sender misses, for new participants, which cannot know them, and for
  /// those that return: a partition listed as lost, stopped or back has to yield to the sender
  /// (Succession).
  std::vector<Absent> absent{};
  bool taken = false;        ///< the name is taken; serving starts once the frames are loaded
  bool stopped = false;      ///< the last message: the process ends, or has given up the name
  std::uint64_t ticket = 0;  ///< of its claim to the name (NameClaim); constant for the process
  ProtocolVersion protocol = kProtocolVersion;
  std::string program{};        ///< the version of its program, for people
  std::optional<Time> clock{};  ///< its external clock when sent; absent: the system's

  friend bool operator==(const Presence& a, const Presence& b) {
    return a.partition == b.partition && a.incarnation == b.incarnation && a.host == b.host &&
           a.pid == b.pid && a.pages == b.pages && a.serving == b.serving && a.absent == b.absent &&
           a.taken == b.taken && a.stopped == b.stopped && a.ticket == b.ticket &&
           a.protocol == b.protocol && a.program == b.program &&
           a.clock.has_value() == b.clock.has_value();
  }
};

/// The clock that the sender's stamps are of.
[[nodiscard]] inline ClockKind clock_of(const Presence& presence) {
  return presence.clock ? ClockKind::kExternal : ClockKind::kSystem;
}

}  // namespace tfdude
