#include <cmath>
#include <string>
#include <utility>

#include "tfdude/base/id.hpp"

#include "partition/watching.hpp"
#include "transport/fastdds/codec.hpp"
#include "transport/fastdds/field_values.hpp"
#include "transport/fastdds/fields.hpp"

// Requests. The ids in a body are checked only where an error must name them: ids without a frame
// are rejected as unknown, and new ids are checked where they are added.
namespace tfdude::fastdds {
namespace {

// ---- changes

constexpr auto kAdd =
    record(TFDUDE_FIELD(parent, parent, Text()), TFDUDE_FIELD(x_pc, X_PC, GivenTransform()),
           TFDUDE_FIELD(lamport_time, lamport_time, kLamportTime));

constexpr auto kRemove = record(TFDUDE_FIELD(tops, tops, List(Text())),
                                TFDUDE_FIELD(lamport_time, lamport_time, kLamportTime));

// The id of the first edge is that of the request.
struct FirstEdge : GivenTransform {
  static void write(const std::vector<EdgeUpdate>& edges, Numbers& wire) {
    GivenTransform::write(edges.front().X_PC, wire);
  }
  static Result<void> read(const Numbers& wire, std::vector<EdgeUpdate>& edges,
                           const Place& place) {
    edges.assign(1, {std::string(place.frame.value_or("")), {}});
    return GivenTransform::read(wire, edges.front().X_PC, place);
  }
};

constexpr auto kUpdateRequest =
    record(TFDUDE_FIELD(x_pc, edges, FirstEdge()), TFDUDE_FIELD(stamp, stamp, Stamp("a stamp")),
           TFDUDE_FIELD(more, edges, List(GivenEdge(), kMaxItems, 1)));

constexpr auto kPartialEdge =
    record(TFDUDE_FIELD(id, id, FrameId()), TFDUDE_FIELDS(X_PC, PartialNumbers()));

constexpr auto kPartialUpdate =
    Ruled(record(TFDUDE_FIELD(stamp, stamp, Stamp("a stamp")),
                 TFDUDE_FIELD(edges, edges, List(kPartialEdge))),
          at_least_one(&PartialUpdateRequest::edges, "an update without edges"));

constexpr auto kMove = record(TFDUDE_FIELD(parent, parent, Text()),
                              TFDUDE_FIELD(lamport_time, lamport_time, kLamportTime));

constexpr auto kMoveAndUpdate =
    record(TFDUDE_FIELD(parent, parent, Text()), TFDUDE_FIELDS(X_PC, PartialNumbers()),
           TFDUDE_FIELD(lamport_time, lamport_time, kLamportTime));

bool only_moves(const MoveRequest& move) { return move.X_PC.empty(); }

constexpr auto kJointUpdate =
    Ruled(JointSamples(), at_least_one(&JointUpdate::joints, "an update without joints"));

constexpr auto kCorrelate = record(TFDUDE_FIELDS(correlation, AnyCorrelation()));

constexpr auto kForget = record(TFDUDE_FIELD(incarnation, incarnation, kIncarnation),
                                TFDUDE_FIELD(partition, partition, Text()));

// Consecutive samples mostly have one covariance.
struct RewrittenSamples {
  static void check(CdrReader& in) {
    in.sequence(kMostRewrittenAtOnce, [&] {
      Instant::check(in);
      Octet::check(in);
      GivenTransform::check(in);
    });
  }
  static void write(const std::vector<EdgeSample>& samples,
                    std::vector<wire::RewrittenSample>& wire) {
    wire.resize(samples.size());
    for (std::size_t i = 0; i < wire.size(); ++i) {
      const Transform& X = samples[i].X_PC;
      const bool as_before = i > 0 && X.covariance == samples[i - 1].X_PC.covariance;
      Instant::write(samples[i].stamp, wire[i].stamp());
      wire[i].covariance(as_before ? 1 : 0);
      if (as_before) {
        write_pose(X.pose, wire[i].x_pc());
      } else {
        GivenTransform::write(X, wire[i].x_pc());
      }
    }
  }
  static Result<void> read(const std::vector<wire::RewrittenSample>& wire,
                           std::vector<EdgeSample>& samples, const Place& place) {
    samples.resize(wire.size());
    for (std::size_t i = 0; i < wire.size(); ++i) {
      Transform& X = samples[i].X_PC;
      samples[i].stamp = time_of(wire[i].stamp());
      if (auto ok = GivenTransform::read(wire[i].x_pc(), X, place); !ok) return ok;
      const bool as_before = wire[i].covariance() != 0 && is_pose_only(wire[i].x_pc());
      if (as_before && i > 0) X.covariance = samples[i - 1].X_PC.covariance;
    }
    return {};
  }
};

constexpr auto kRewrite = Ruled(
    record(TFDUDE_FIELD(since, interval.from, Instant()),
           TFDUDE_FIELD(until, interval.to, Instant()), TFDUDE_FIELD(number, number, Count64()),
           TFDUDE_FIELD(total, total, Count32()), TFDUDE_FIELD(first, first, Count32()),
           TFDUDE_FIELD(samples, samples, RewrittenSamples())),
    at_least_one(&RewriteRequest::samples, "a rewrite without samples"));

// ---- handing over

constexpr auto kHandOver = record(
    TFDUDE_FIELD(after, after, Stamp("an instant of a handover")),
    TFDUDE_FIELD(edge, edge, Count32()),
    TFDUDE_FIELD(step, step, Enumerated(HandOverRequest::Step::kCancel, "a step of a handover")),
    TFDUDE_FIELD(to, to, PartitionName()));

struct Moves : Octet {
  static void write(const AdoptRequest& adopt, std::uint8_t& wire) { wire = adopt.parent ? 1 : 0; }
  static Result<void> read(std::uint8_t wire, AdoptRequest& adopt, const Place&) {
    if (wire != 0) adopt.parent.emplace();
    return {};
  }
};

struct NewParent : Text {
  static void write(const std::optional<std::string>& parent, wire::Identifier& wire) {
    wire = parent.value_or("");
  }
  static Result<void> read(const wire::Identifier& wire, std::optional<std::string>& parent,
                           const Place& place) {
    return parent ? Text::read(wire, *parent, place) : Result<void>();
  }
};

constexpr auto kAdopt = record(
    TFDUDE_FIELD(lamport_time, lamport_time, kLamportTime), TFDUDE_FIELD_OF_ALL(moves, Moves()),
    TFDUDE_FIELDS(X_PC, PartialNumbers()), TFDUDE_FIELD(from, from, PartitionName()),
    TFDUDE_FIELD(parent, parent, NewParent()), TFDUDE_FIELD(part, part, Handed()));

// ---- observations

// Whether an edge has a new value, and that value.
struct Revised {
  static void check(CdrReader& in) {
    Octet::check(in);
    GivenTransform::check(in);
    AnyCorrelation::check(in);
  }
  static void write(const ReviseRequest::Edge& edge, wire::RevisedEdge& wire) {
    wire.revised(edge.revision ? 1 : 0);
    wire.x_pc().clear();
    if (edge.revision) GivenTransform::write(edge.revision->X_PC, wire.x_pc());
    AnyCorrelation::write(edge.revision ? edge.revision->correlation : Correlation(),
                          wire.edge_correlation());
  }
  static Result<void> read(const wire::RevisedEdge& wire, ReviseRequest::Edge& edge,
                           const Place& place) {
    if (wire.revised() == 0) return {};
    Revision& revision = edge.revision.emplace();
    revision.id = edge.id;
    if (auto ok = ComputedTransform::read(wire.x_pc(), revision.X_PC, place); !ok) return ok;
    return AnyCorrelation::read(wire.edge_correlation(), revision.correlation, place);
  }
};

// Of the edge of an observation, whose id is not checked.
struct RevisedId : Text {
  static Result<void> read(const wire::Identifier& wire, ReviseRequest::Edge& edge, Place& place) {
    place.frame = text(wire);
    const NormalizedInnovation& innovation = edge.innovation;
    if (!std::isfinite(innovation.squares + innovation.expected + innovation.variance)) {
      return place.fail(
          {Errc::kInvalidInput, "its normalized innovation is not a finite number, or too large"});
    }
    return Text::read(wire, edge.id, place);
  }
  static void write(const ReviseRequest::Edge& edge, wire::Identifier& wire) { wire = edge.id; }
};

constexpr auto kRevisedEdge = record(
    TFDUDE_FIELD(squares, innovation.squares, Real()),
    TFDUDE_FIELD(expected, innovation.expected, Real()),
    TFDUDE_FIELD(variance, innovation.variance, Real()), TFDUDE_FIELD_OF_ALL(id, RevisedId()),
    TFDUDE_FIELD(refused, refused, Octet()), field(TFDUDE_ALL, TFDUDE_ALL, Revised()));

constexpr auto kRevise =
    Ruled(record(TFDUDE_FIELD(stamp, stamp, Stamp("the stamp of an observation")),
                 TFDUDE_FIELD(seen, seen, Count64()),
                 TFDUDE_FIELD(incarnation, incarnation, kIncarnation),
                 TFDUDE_FIELD(edges, edges, List(kRevisedEdge, kMaxCorrelated))),
          at_least_one(&ReviseRequest::edges, "an observation without edges"));

// Those of several instants: the stamps of all edges.
struct OfRows {
  static void check(CdrReader& in) {
    in.sequence(kMaxCorrelated, [&] { Instant::check(in); });
  }
  static void write(const std::vector<ReviseRequest::Edge>& edges,
                    std::vector<std::int64_t>& wire) {
    wire.clear();
    for (const ReviseRequest::Edge& edge : edges) {
      const auto stamp = edge.revision ? edge.revision->stamp : std::nullopt;
      wire.push_back(stamp ? nanoseconds(*stamp) : -1);
    }
  }
  static Result<void> read(const std::vector<std::int64_t>& wire,
                           std::vector<ReviseRequest::Edge>& edges, const Place& place) {
    if (wire.size() != edges.size()) {
      return place.fail({Errc::kInvalidInput, std::to_string(wire.size()) + " stamps of " +
                                                  std::to_string(edges.size()) + " edges"});
    }
    for (std::size_t i = 0; i < wire.size(); ++i) {
      if (wire[i] >= 0 && edges[i].revision) edges[i].revision->stamp = time_of(wire[i]);
    }
    return {};
  }
};

bool is_of_one_instant(const ReviseRequest& revise) {
  return std::none_of(revise.edges.begin(), revise.edges.end(),
                      [](const auto& edge) { return edge.revision && edge.revision->stamp; });
}

constexpr auto kReviseRows =
    record(TFDUDE_FIELD_OF_ALL(revised, kRevise), TFDUDE_FIELD(stamps, edges, OfRows()));

// ---- questions

constexpr auto kSegments =
    List(record(TFDUDE_FIELD(from, from, Text()), TFDUDE_FIELD(to, to, Text())));

bool is_of_now(const LookupRequest& lookup) { return !lookup.query.believed_at; }

bool is_plain(const LookupRequest& lookup) {
  const Query& query = lookup.query;
  return is_of_now(lookup) && !query.at && !lookup.hint && !query.age_noise_until &&
         query.extrapolate == std::chrono::nanoseconds(0) && query.order == Order::kSecond &&
         !lookup.edges;
}

constexpr auto kLookup = record(TFDUDE_FIELDS(segments, kSegments));

struct OrderNumber : Octet {
  static Result<void> read(std::uint8_t wire, Order& order, const Place& place) {
    if (wire == 2 || wire == 4) return Octet::read(wire, order, place);
    return fail(Errc::kInvalidInput,
                "the order of a lookup is 2 or 4, not " + std::to_string(wire));
  }
};

// What is asked of each segment.
struct OfEdges : Octet {
  static void write(const LookupRequest& lookup, std::uint8_t& wire) {
    wire = lookup.timed                   ? 2
           : lookup.rows == Rows::kOfPath ? 3
           : lookup.rows == Rows::kAll    ? 4
           : lookup.edges                 ? 1
                                          : 0;
  }
  static Result<void> read(std::uint8_t wire, LookupRequest& lookup, const Place&) {
    lookup.edges = wire != 0;
    lookup.timed = wire == 2;
    lookup.rows = wire == 3 ? Rows::kOfPath : wire == 4 ? Rows::kAll : Rows::kNone;
    return {};
  }
};

constexpr auto kLookupAt = record(
    TFDUDE_FIELD(at, query.at, Stamp("the instant of a lookup")),
    TFDUDE_FIELD(hint, hint, Stamp("the hint of a lookup")),
    TFDUDE_FIELD(extrapolate, query.extrapolate, Duration("an extrapolation")),
    TFDUDE_FIELD(age_noise_until, query.age_noise_until, Stamp("the end of a lookup's noise")),
    TFDUDE_FIELD(segments, segments, kSegments), TFDUDE_FIELD(order, query.order, OrderNumber()),
    TFDUDE_FIELD_OF_ALL(edges, OfEdges()));

// One is always there: that of another kind of request would be answered with what is known now.
struct BelievedAt : Number<std::int64_t> {
  static void write(const std::optional<Time>& value, std::int64_t& wire) {
    wire = std::max<std::int64_t>(nanoseconds(*value), 0);
  }
  static Result<void> read(std::int64_t wire, std::optional<Time>& value, const Place&) {
    if (wire < 0) return negative("the instant of a belief", wire);
    value = time_of(wire);
    return {};
  }
};

constexpr auto kBelieved = record(TFDUDE_FIELD(believed_at, query.believed_at, BelievedAt()),
                                  TFDUDE_FIELD_OF_ALL(lookup, kLookupAt));

// What is pushed of each segment.
struct OfSegments : Octet {
  static void write(const WatchRequest& watch, std::uint8_t& wire) {
    wire = watch.of_samples ? 2 : watch.composed ? 1 : 0;
  }
  static Result<void> read(std::uint8_t wire, WatchRequest& watch, const Place&) {
    watch.composed = wire == 1;
    watch.of_samples = wire == 2;
    return {};
  }
};

constexpr auto kWatch =
    Ruled(record(TFDUDE_FIELD(period, period, Duration("the period of a watch")),
                 TFDUDE_FIELD(from, from, Stamp("the instant of a watch")),
                 TFDUDE_FIELD(segments, segments, kSegments),
                 TFDUDE_FIELD_OF_ALL(composed, OfSegments())),
          &check_watch);

constexpr auto kOfAll = record(TFDUDE_FIELDS(all, Octet()));

constexpr auto kJointStates = record(TFDUDE_FIELDS(after, Text()));

constexpr auto kFrames =
    record(TFDUDE_FIELD(ids, ids, List(Id("id"))), TFDUDE_FIELD(trees, trees, List(Id("tree"))),
           TFDUDE_FIELD(seen, seen,
                        List(record(TFDUDE_FIELD(epoch, epoch, kEpoch),
                                    TFDUDE_FIELD(partition, partition, PartitionName())))));

constexpr auto kDescriptionRequest = record(TFDUDE_FIELDS(from, Count64()));

// The request has no fields.
struct MemoryOctet : Octet {
  static void write(const MemoryRequest&, std::uint8_t& wire) { wire = 0; }
  static Result<void> read(std::uint8_t, MemoryRequest&, const Place&) { return {}; }
};

constexpr auto kTime = record(TFDUDE_FIELDS(shown, Stamp("the time of a request")));

// ---- all of them

constexpr auto kRequestBody = cases(
    "request", TFDUDE_CASE(1, AddRequest, add, kAdd),
    TFDUDE_CASE(2, RemoveRequest, remove, kRemove),
    TFDUDE_CASE(3, UpdateRequest, update, kUpdateRequest),
    TFDUDE_CASE_IF(4, MoveRequest, move, kMove, &only_moves),
    TFDUDE_CASE(5, MoveRequest, move_and_update, kMoveAndUpdate),
    TFDUDE_CASE_IF(6, LookupRequest, lookup, kLookup, &is_plain),
    TFDUDE_CASE_IF(7, LookupRequest, lookup_at, kLookupAt, &is_of_now),
    TFDUDE_CASE(8, WatchRequest, watch, kWatch), TFDUDE_CASE(9, HistoryRequest, history, kOfAll),
    TFDUDE_CASE_IF(10, ReviseRequest, revise, kRevise, &is_of_one_instant),
    TFDUDE_CASE(11, ConsistencyRequest, consistency, kOfAll),
    TFDUDE_CASE(12, JointUpdate, joint_update, kJointUpdate),
    TFDUDE_CASE(13, JointsRequest, joint_states, kJointStates),
    TFDUDE_CASE(14, CorrelateRequest, correlate, kCorrelate),
    TFDUDE_CASE(15, PartialUpdateRequest, partial_update, kPartialUpdate),
    TFDUDE_CASE(16, ForgetRequest, forget, kForget), SignOfLife<kProbe>(),
    TFDUDE_CASE(18, FramesRequest, structure, kFrames),
    TFDUDE_CASE(19, DescriptionRequest, description, kDescriptionRequest),
    TFDUDE_CASE(20, MemoryRequest, memory, MemoryOctet()),
    TFDUDE_CASE(21, TimeRequest, time, kTime), TFDUDE_CASE(22, RewriteRequest, rewrite, kRewrite),
    TFDUDE_CASE(23, ReviseRequest, revise_rows, kReviseRows),
    TFDUDE_CASE(24, HandOverRequest, hand_over, kHandOver),
    TFDUDE_CASE(25, AdoptRequest, adopt, kAdopt),
    TFDUDE_CASE(26, LookupRequest, believed, kBelieved));

constexpr auto kRequest = record(
    TFDUDE_FIELD(id, id, FrameId()), TFDUDE_FIELD_OF_ALL(addressee, NotOfMessage<std::uint32_t>()),
    TFDUDE_FIELD(sequence_number, sequence, Count32()),
    TFDUDE_FIELD(awaits_from, awaits_from, Count64()), TFDUDE_FIELD(body, body, kRequestBody));

}  // namespace

bool well_formed_request(const std::uint8_t* data, std::size_t size) {
  return well_formed(kRequest, data, size);
}

std::optional<RequestHead> read_request_head(const std::uint8_t* data, std::size_t size) {
  CdrReader in(data, size);
  RequestHead head{in.bounded_text(kMaxIdBytes), 0};
  head.addressee = in.u32();
  return in.good() ? std::optional(head) : std::nullopt;
}

void write_wire(const Request& request, std::string_view partition, wire::Request& sample) {
  kRequest.write(request, sample);
  sample.addressee(addressee_of(partition));
}

Result<Request> from_wire(const wire::Request& sample) {
  return read_as<Request>(kRequest, sample, {});
}

}  // namespace tfdude::fastdds
