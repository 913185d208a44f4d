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

#include "tree/forest.hpp"

// What participants say to each other, free of any transport. idl/tfdude.idl has the same on the wire.
namespace tfdude {

/// Who speaks: given by the transport, unique in a domain, new at every start.
using PeerId = std::array<std::uint8_t, 12>;

/// The most edges, subtrees, segments or entries that one message holds.
inline constexpr std::size_t kMaxItems = 4096;

/// The most edges of one owner that are observed at once or correlated with others on one path, and common errors of each.
inline constexpr std::uint32_t kMaxCorrelated = kMaxCommonErrors;

/// The latest stamp of a change of the structure that a sender knows of (Directory::next_lamport_time). Its own change gets
/// a later one, whatever the owner's clock says, so that what one client does in turn counts in that order.
using LamportTime = std::uint64_t;

struct AddRequest {
  std::string parent;  ///< empty: a root
  Transform X_PC;
  LamportTime lamport_time = 0;
};

/// Removes frames with all that the asked partition owns below them. None: the reply only says how far the partition's
/// structure is; the request's id is the partition's name then.
struct RemoveRequest {
  std::vector<std::string> tops;
  LamportTime lamport_time = 0;
};

struct UpdateRequest {
  std::vector<EdgeUpdate> edges;  ///< at least one
  std::optional<Time> stamp{};    ///< of all of them
};

/// Parts of values; what is absent stays as it is at the owner.
struct PartialUpdateRequest {
  std::vector<PartialUpdate> edges;  ///< at least one
  std::optional<Time> stamp{};       ///< of all of them
};

struct MoveRequest {
  std::string parent;             ///< empty: becomes a root
  std::optional<Transform> X_PC;  ///< kept where absent
  LamportTime lamport_time = 0;
};

struct LookupRequest {
  std::vector<PathEnds> segments;  ///< at least one
  Query query{};
  /// Of what other instant the answer may be of use; see LatestHints.
  std::optional<Time> hint{};
  bool edges =
      false;  ///< each segment is an edge, to be observed: all of its correlation is wanted
};

/// What an observation has come to for edges of one owner.
struct ReviseRequest {
  struct Edge {
    std::string id;
    NormalizedInnovation innovation;
    bool refused = false;  ///< the measurement, by its gate
    std::optional<Revision> revision;
  };
  std::vector<Edge> edges;        ///< at least one
  std::optional<Time> stamp{};    ///< of which moving edges were observed
  std::uint64_t seen = 0;         ///< SegmentValues::commit of what was observed
  std::uint64_t incarnation = 0;  ///< SegmentValues::incarnation, whose commit that is
};

/// Says how the error of the edge that the request's id names is correlated with those of others.
struct CorrelateRequest {
  Correlation correlation;
};

/// How well the covariance of the edge that the request's id names, or of all that the partition has, agrees with
/// observations.
struct ConsistencyRequest {
  bool all = false;
};

/// Positions of joints, applied as one commit by each owner of some of the edges that they move. Streamed, or as a request.
struct JointUpdate {
  std::vector<JointValue> joints;
  std::optional<Time> stamp{};  ///< of all of them
};

/// What is known of the joints of the partition, sorted by name: of kMaxItems at most, whose names come after this one.
struct JointsRequest {
  std::string after{};
};

/// Says that another partition, which is not there, is gone for good; the request's id is the name of the one asked.
struct ForgetRequest {
  std::string partition;
  std::uint64_t incarnation = 0;  ///< the latest that was heard of
};

/// Asks for the values of edges, now and whenever they change: these are pushed to the group of watchers that have
/// asked for the same, until it is not renewed for kWatchLease.
struct WatchRequest {
  std::vector<PathEnds> segments;      ///< edges, each from its parent
  bool composed = false;               ///< or runs of edges, each told as one transform
  std::chrono::nanoseconds period{0};  ///< no more often than this; 0: every sample
  /// The reply has the samples since the last that is not younger than this, instead of the newest only. Not of the group.
  std::optional<Time> from{};
};

/// The longest period of a watch.
inline constexpr std::chrono::hours kMaxWatchPeriod{1};

/// How long an owner pushes to watchers of whom it hears nothing.
inline constexpr Milliseconds kWatchLease{5000};

/// What is kept of the history of the edge that the request's id names or, instead, of all that the partition has.
struct HistoryRequest {
  bool all = false;
};

/// A request to one partition.
struct Request {
  /// Counts the requests of one peer; a repeated number is answered again but not applied again.
  std::uint32_t sequence = 0;
  /// The frame concerned, by which a reader filters: one that the partition owns, or the new one of an add.
  std::string id;
  std::variant<AddRequest, RemoveRequest, UpdateRequest, MoveRequest, LookupRequest, WatchRequest,
               HistoryRequest, ReviseRequest, ConsistencyRequest, JointUpdate, JointsRequest,
               PartialUpdateRequest, CorrelateRequest, ForgetRequest>
      body;
  /// Of requests with a lower number, in whatever order they come, the sender awaits no reply. Not above `sequence`, which has
  /// its lower half only.
  std::uint64_t awaits_from = 0;
};

/// What was written to watched edges, to be taken over as one commit: a watcher that knows all up to `after` then knows
/// all up to `commit`.
struct PushedValues {
  std::uint64_t group = 0;           ///< watch_group() of the owner and the request
  std::vector<PushedValue> entries;  ///< by the index of the segment in the request
  std::uint64_t after = 0;           ///< a commit of the owner's; 0: all is told
  std::uint64_t commit = 0;          ///< a later one
  std::uint32_t piece = 0;           ///< which one of so many that have the entries
  std::uint32_t pieces = 1;
};

/// How many entries are correlated with others; a message holds no more than kMaxCorrelated of them.
[[nodiscard]] std::size_t correlated_entries(const PushedValues& pushed);

struct Done {};

struct Reply {
  std::uint32_t sequence = 0;
  /// The partition's structure after the request; a directory that has this epoch shows its effect.
  std::uint64_t epoch = 0;
  /// Done, or why not; or what was asked for.
  std::variant<Done, Error, SegmentValues, PushedValues, std::vector<HistoryInfo>,
               std::vector<EdgeConsistency>, std::vector<JointInfo>>
      body;
  /// Of a change: the latest that the owner knows of, for the next change of who has asked.
  LamportTime lamport_time = 0;
};

/// Which watchers share what an owner sends: a number of the owner, this time that it runs, and of what they ask for
/// (FNV-1a, 64 bits).
[[nodiscard]] std::uint64_t watch_group(std::string_view partition, std::uint64_t incarnation,
                                        const WatchRequest& request);

/// Edge values streamed without a reply; applied as one commit by each owner of some of them.
struct Update {
  std::vector<EdgeUpdate> edges;
  std::optional<Time> stamp{};  ///< of all of them
};

struct PageEntry {
  std::string id;
  std::string parent;  ///< empty: a root
  /// When the frame was hung there, by its owner's count (Directory::next_lamport_time): of two claims that
  /// cannot both hold, the older does.
  std::uint64_t lamport_time = 0;
};

/// That a joint moves a frame of a page.
struct PageJoint {
  std::string name;
  std::string follows;  ///< the joint that it mimics; empty: none

  friend bool operator==(const PageJoint& a, const PageJoint& b) {
    return a.name == b.name && a.follows == b.follows;
  }
};

/// What became of a frame that is not where it was, in place of it: for those who were away meanwhile, and for those who
/// want to know of conflicts.
struct Tombstone {
  enum class Kind : std::uint8_t {
    kRemoved = 1,  ///< by request; whatever hung below it since before goes, too
    kYielded = 2,  ///< `rival` has claimed the same id earlier
    kUnhung = 3,   ///< its move and an earlier one, of `rival`, make a cycle: it was made a root
    kDropped =
        4,  ///< its partition's configuration names it no more; what hung below it waits for it
  };
  std::string id;
  std::uint64_t lamport_time = 0;
  Kind kind = Kind::kRemoved;
  std::string rival;  ///< a partition; empty where removed or dropped

  friend bool operator==(const Tombstone& a, const Tombstone& b) {
    return a.id == b.id && a.lamport_time == b.lamport_time && a.kind == b.kind &&
           a.rival == b.rival;
  }
};

/// That a page was changed last in this epoch.
struct PageEpoch {
  std::uint32_t number = 0;
  std::uint64_t epoch = 0;
};

/// A piece of a partition's structure. Each page is replaced as a whole, so that a frame costs its page
/// and not the directory, and a late joiner reads pages and not frames.
struct Page {
  std::string partition;
  std::uint32_t number = 0;
  std::uint64_t incarnation = 0;
  /// What it shows.
  std::uint64_t epoch = 0;
  std::vector<PageEntry> entries;
  std::vector<Tombstone> tombstones{};
  /// The other pages that were changed last: once these have come, too, all of the structure up to the page's epoch has.
  std::vector<PageEpoch> others{};
  std::vector<PageJoint> joints{};
};

/// A partition that a participant has known, or heard of, and that is not there.
struct Absent {
  enum class Kind : std::uint8_t {
    kSilent = 1,     ///< since a moment only: it may just be busy
    kLost = 2,       ///< it has fallen silent without a word
    kStopped = 3,    ///< it said that it ends
    kBack = 4,       ///< it is there again, but what both claim is not resolved yet
    kForgotten = 5,  ///< somebody said that it is gone for good: nothing of it is kept
  };
  std::string partition;
  std::int64_t since = 0;  ///< [ns since the UNIX epoch], by the clock of who misses it
  Kind kind = Kind::kLost;
  std::uint64_t incarnation = 0;  ///< the latest that was heard of

  friend bool operator==(const Absent& a, const Absent& b) {
    return a.partition == b.partition && a.since == b.since && a.kind == b.kind &&
           a.incarnation == b.incarnation;
  }
};

/// That a partition is served, and by whom. It holds as long as its participant lives.
struct Presence {
  std::string partition;
  /// Which process of the partition's it is: the greater is the later (IncarnationSource).
  std::uint64_t incarnation = 0;
  std::string host;
  std::uint32_t pid = 0;
  std::uint32_t pages = 0;  ///< how many pages its structure has
  bool serving = false;     ///< false: the name is only being claimed yet, or not any more
  /// Whom the sender misses, for those who come only now and cannot, and for those who come back: whom it lists as
  /// lost, stopped or back has to yield to it (Succession).
  std::vector<Absent> absent{};
  bool taken = false;        ///< the name is taken; it will be served once the frames are there
  bool stopped = false;      ///< it is the last word: the process ends, or has given the name up
  std::uint64_t ticket = 0;  ///< of its claim to the name (NameClaim); the same as long as it lives

  friend bool operator==(const Presence& a, const Presence& b) {
    return a.partition == b.partition && a.incarnation == b.incarnation && a.host == b.host &&
           a.pid == b.pid && a.pages == b.pages && a.serving == b.serving && a.absent == b.absent &&
           a.taken == b.taken && a.stopped == b.stopped && a.ticket == b.ticket;
  }
};

}  // namespace tfdude
