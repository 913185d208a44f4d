#include <string>
#include <utility>

#include "tfdude/base/id.hpp"

#include "transport/fastdds/codec.hpp"
#include "transport/fastdds/field_values.hpp"
#include "transport/fastdds/fields.hpp"

namespace tfdude::fastdds {
namespace {

constexpr std::size_t kMaxMessage = 4096;

struct DoneOctet : Octet {
  static void write(const Done&, std::uint8_t& wire) { wire = 0; }
  static Result<void> read(std::uint8_t, Done&, const Place&) { return {}; }
};

// For people to read, though its sender may have put anything in it.
struct ErrorText : LongText {
  static Result<void> read(const std::string& wire, std::string& value, const Place&) {
    value = printable(wire);
    return {};
  }
};

// The code was read before.
struct ErrorMessage : ErrorText {
  void write(const Error& error, std::string& wire) const { LongText::write(error.message, wire); }
  static Result<void> read(const std::string& wire, Error& error, const Place&) {
    error = error_of_text(error.code, printable(wire));
    return {};
  }
};

constexpr auto kError = record(TFDUDE_FIELD(code, code, Octet()),
                               TFDUDE_FIELD_OF_ALL(message, ErrorMessage{{{kMaxMessage}}}));

// ---- values of segments

constexpr auto kValues = List(ComputedTransform());
constexpr auto kCorrelations = List(AnyCorrelation(), kMaxCorrelated);

// The edges without which some of the values would count as complete.
struct UnspecifiedEdges {
  static void check(CdrReader& in) {
    in.sequence(kMaxItems, [&] {
      Count32::check(in);
      Text::check(in);
    });
  }
  // If there are too many, only the first of each value.
  static void write(const ValuesAtInstant& at, std::vector<wire::UnspecifiedEdge>& wire) {
    const bool all = at.unspecified.size() <= kMaxItems;
    wire.clear();
    for (const UnspecifiedEdge& edge : at.unspecified) {
      const auto value = static_cast<std::uint32_t>(edge.segment);
      if (!all && !wire.empty() && wire.back().value() == value) continue;
      wire.emplace_back().value(value);
      wire.back().id() = edge.id;
    }
  }
  static Result<void> read(const std::vector<wire::UnspecifiedEdge>& wire, ValuesAtInstant& at,
                           const Place& place) {
    at.unspecified.reserve(wire.size());
    for (const wire::UnspecifiedEdge& one : wire) {
      if (one.value() >= at.values.size()) {
        return place.fail({Errc::kInvalidInput, "an unspecified edge of value " +
                                                    std::to_string(one.value()) + ", of " +
                                                    std::to_string(at.values.size())});
      }
      at.values[one.value()].covariance.set_complete(false);
      at.unspecified.push_back({one.value(), std::string(text(one.id()))});
    }
    return {};
  }
};

constexpr auto kFixed = record(TFDUDE_FIELDS(values, kValues));

constexpr auto kStamped =
    record(TFDUDE_FIELD(stamp, stamp, Stamp("the stamp of a reply")),
           TFDUDE_FIELD(period, period, Nanoseconds()), TFDUDE_FIELD(values, values, kValues),
           TFDUDE_FIELD(at_hint, at_hint.values, kValues));

constexpr auto kCorrelated =
    record(TFDUDE_FIELD(stamp, stamp, Stamp("the stamp of a reply")),
           TFDUDE_FIELD(period, period, Nanoseconds()), TFDUDE_FIELD(seen, commit, Count64()),
           TFDUDE_FIELD(incarnation, incarnation, Count64()), TFDUDE_FIELD(values, values, kValues),
           TFDUDE_FIELD(at_hint, at_hint.values, kValues),
           TFDUDE_FIELD(correlations, correlations, kCorrelations),
           TFDUDE_FIELD(correlations_at_hint, at_hint.correlations, kCorrelations));

constexpr auto kIncomplete = record(TFDUDE_FIELD_OF_ALL(found, kCorrelated),
                                    TFDUDE_FIELD_OF_ALL(unspecified, UnspecifiedEdges()),
                                    TFDUDE_FIELD(unspecified_at_hint, at_hint, UnspecifiedEdges()));

constexpr auto kRow =
    record(TFDUDE_FIELD(stamp, stamp, Instant()), TFDUDE_FIELD(segment, segment, Count32()),
           TFDUDE_FIELD(x_pc, X_PC, ComputedTransform()),
           TFDUDE_FIELD(edge_correlation, correlation, AnyCorrelation()));

constexpr auto kWithRows = record(TFDUDE_FIELD_OF_ALL(found, kIncomplete),
                                  TFDUDE_FIELD(rows, rows, List(kRow, kMaxCorrelated)));

bool has_no_rows(const SegmentValues& found) { return found.rows.empty(); }
bool is_complete(const SegmentValues& found) {
  return has_no_rows(found) && found.unspecified.empty() && found.at_hint.unspecified.empty();
}
bool is_stamped(const SegmentValues& found) {
  return is_complete(found) && found.correlations.empty() && found.at_hint.correlations.empty();
}
bool is_fixed(const SegmentValues& found) {
  return is_stamped(found) && !found.stamp && found.at_hint.values.empty();
}

// ---- reports, with names for people to read

// An instant that is not checked: all that are negative mean none.
struct Reported : Stamp {
  constexpr Reported() : Stamp("") {}
  static Result<void> read(std::int64_t wire, std::optional<Time>& value, const Place&) {
    value = wire >= 0 ? std::optional(time_of(wire)) : std::nullopt;
    return {};
  }
};

constexpr auto kHistory = record(
    TFDUDE_FIELD(samples, samples, Count64()), TFDUDE_FIELD(bytes, bytes, Count64()),
    TFDUDE_FIELD(span_limit, span_limit, Nanoseconds()),
    TFDUDE_FIELD(count_limit, count_limit, Count64()), TFDUDE_FIELD(oldest, oldest, Reported()),
    TFDUDE_FIELD(newest, newest, Reported()), TFDUDE_FIELD(mean_gap, mean_gap, Nanoseconds()),
    TFDUDE_FIELD(max_gap, max_gap, Nanoseconds()), TFDUDE_FIELD(jitter, jitter, Nanoseconds()),
    TFDUDE_FIELD(refused_old, refused_old, Count64()),
    TFDUDE_FIELD(refused_equal, refused_equal, Count64()),
    TFDUDE_FIELD(refused_ahead, refused_ahead, Count64()), TFDUDE_FIELD(id, id, Shown()));

constexpr auto kConsistency = record(
    TFDUDE_FIELD(observations, observations, Count64()), TFDUDE_FIELD(refused, refused, Count64()),
    TFDUDE_FIELD(squares, sum.squares, Real()), TFDUDE_FIELD(expected, sum.expected, Real()),
    TFDUDE_FIELD(variance, sum.variance, Real()), TFDUDE_FIELD(id, id, Shown()));

// A number of a member that may be absent, which a later field says.
template <class Part>
struct RealOf : Real {
  double Part::*number;
  explicit constexpr RealOf(double Part::*of) : number(of) {}

  void write(const std::optional<Part>& part, double& wire) const {
    wire = part.value_or(Part{}).*number;
  }
  Result<void> read(double wire, std::optional<Part>& part, const Place&) const {
    if (!part) part.emplace();
    (*part).*number = wire;
    return {};
  }
};

struct Limited : Octet {
  static void write(const std::optional<JointLimits>& limits, std::uint8_t& wire) {
    wire = limits ? 1 : 0;
  }
  static Result<void> read(std::uint8_t wire, std::optional<JointLimits>& limits, const Place&) {
    if (wire == 0) limits.reset();
    return {};
  }
};

struct Leader : Shown {
  static void write(const std::optional<Mimic>& mimic, wire::Identifier& wire) {
    wire = mimic.value_or(Mimic{}).joint;
  }
  static Result<void> read(const wire::Identifier& wire, std::optional<Mimic>& mimic,
                           const Place& place) {
    if (auto ok = Shown::read(wire, mimic->joint, place); !ok) return ok;
    if (mimic->joint.empty()) mimic.reset();
    return {};
  }
};

constexpr auto kJoint = record(
    TFDUDE_FIELD(position, position, Real()),
    TFDUDE_FIELD(lower, limits, RealOf(&JointLimits::lower)),
    TFDUDE_FIELD(upper, limits, RealOf(&JointLimits::upper)),
    TFDUDE_FIELD(multiplier, mimic, RealOf(&Mimic::multiplier)),
    TFDUDE_FIELD(offset, mimic, RealOf(&Mimic::offset)), TFDUDE_FIELD(outside, outside, Count64()),
    TFDUDE_FIELD(refused, refused, Count64()), TFDUDE_FIELD(type, type, Octet()),
    TFDUDE_FIELD(limited, limits, Limited()), TFDUDE_FIELD(measured, measured, Octet()),
    TFDUDE_FIELD(name, name, Shown()), TFDUDE_FIELD(frame, frame, Shown()),
    TFDUDE_FIELD(follows, mimic, Leader()), TFDUDE_FIELD(variance, variance, AtMostOne(Real())));

// ---- structure

constexpr auto kFrame =
    record(TFDUDE_FIELD(id, id, Id("id")), TFDUDE_FIELD(parent, parent, Id("parent", true)),
           TFDUDE_FIELD(owner, partition, PartitionName()));

constexpr auto kDescriptionPart =
    record(TFDUDE_FIELD(size, size, Count64()), TFDUDE_FIELD(hash, hash, Count64()),
           TFDUDE_FIELD(text, text, LongText{kMaxDescriptionPart}));

// ---- memory

template <std::size_t part>
struct TokenPart : Count64 {
  static void write(const std::array<std::uint64_t, 2>& token, std::uint64_t& wire) {
    wire = token[part];
  }
  static Result<void> read(std::uint64_t wire, std::array<std::uint64_t, 2>& token, const Place&) {
    token[part] = wire;
    return {};
  }
};

constexpr std::size_t kMaxSocketName = 255;

constexpr auto kMemory = record(TFDUDE_FIELD(token_first, token, TokenPart<0>()),
                                TFDUDE_FIELD(token_second, token, TokenPart<1>()),
                                TFDUDE_FIELD(layout, layout, Count64()),
                                TFDUDE_FIELD(incarnation, incarnation, Count64()),
                                TFDUDE_FIELD(kernel, kernel, LongText{kMaxSocketName}),
                                TFDUDE_FIELD(at_socket, socket, LongText{kMaxSocketName}),
                                TFDUDE_FIELD(why_not, why_not, ErrorText{{kMaxMessage}}));

// ---- all of them

constexpr auto kReplyBody =
    cases("reply", TFDUDE_CASE(1, Error, error, kError),
          TFDUDE_CASE_IF(2, SegmentValues, transforms, kFixed, &is_fixed),
          TFDUDE_CASE(3, Done, done, DoneOctet()),
          TFDUDE_CASE_IF(4, SegmentValues, stamped, kStamped, &is_stamped),
          TFDUDE_CASE(5, PushedValues, watched, Pushed()),
          TFDUDE_CASE(6, std::vector<HistoryInfo>, histories, FirstOf(List(kHistory))),
          TFDUDE_CASE_IF(7, SegmentValues, correlated, kCorrelated, &is_complete),
          TFDUDE_CASE(8, std::vector<EdgeConsistency>, consistency, List(kConsistency)),
          TFDUDE_CASE(9, std::vector<JointInfo>, joint_states, FirstOf(List(kJoint))),
          SignOfLife<kAlive>(), TFDUDE_CASE(11, std::vector<KnownFrame>, structure, List(kFrame)),
          TFDUDE_CASE_IF(12, SegmentValues, incomplete, kIncomplete, &has_no_rows),
          TFDUDE_CASE(13, DescriptionPart, description, kDescriptionPart),
          TFDUDE_CASE(14, MemoryOffer, memory, kMemory),
          TFDUDE_CASE(15, SegmentValues, with_rows, kWithRows),
          TFDUDE_CASE(16, HandedPart, handed, Handed()));

constexpr auto kReply = record(
    TFDUDE_FIELD(epoch, epoch, kEpoch), TFDUDE_FIELD(lamport_time, lamport_time, kLamportTime),
    TFDUDE_FIELD(sequence_number, sequence, Count32()), TFDUDE_FIELD(body, body, kReplyBody));

}  // namespace

bool well_formed_reply(const std::uint8_t* data, std::size_t size) {
  return well_formed(kReply, data, size);
}

void write_wire(const Reply& reply, wire::Reply& sample) { kReply.write(reply, sample); }

Result<Reply> from_wire(const wire::Reply& sample) {
  return read_as<Reply>(kReply, sample, {"a reply"});
}

}  // namespace tfdude::fastdds
