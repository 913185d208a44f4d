#include <string>
#include <utility>

#include "tfdude/base/id.hpp"

#include "transport/fastdds/codec.hpp"
#include "transport/fastdds/field_values.hpp"
#include "transport/fastdds/fields.hpp"

// What is known of frames that are handed over. Samples and rows are lists beside that of the
// edges, so that nested bounds stay small.
namespace tfdude::fastdds {
namespace {

// A value as its owner has it, whose covariance may be unspecified.
struct OwnedTransform : ComputedTransform {
  static void write(const Transform& X, Numbers& wire) { GivenTransform::write(X, wire); }
};

struct Noise {
  static void check(CdrReader& in) { in.numbers(Covariance::kSize); }
  static void write(const Covariance& noise, Numbers& wire) {
    wire.clear();
    if (noise.upper() == Covariance::Upper{}) return;
    wire.assign(noise.upper().begin(), noise.upper().end());
  }
  static Result<void> read(const Numbers& wire, Covariance& noise, const Place& place) {
    noise = Covariance();
    if (wire.empty()) return {};
    const auto read = read_covariance(wire, 0);
    if (!read) return place.fail(fail_at("process noise", read.error()).value());
    noise = *read;
    return {};
  }
};

constexpr auto kHandedTiming = record(
    TFDUDE_FIELD(span, span, Nanoseconds()), TFDUDE_FIELD(max_ahead, max_ahead, Nanoseconds()),
    TFDUDE_FIELD(count, count, Count64()), TFDUDE_FIELD(restart_after, restart_after, Count64()));

// The timing, which may be absent. Its fields are at several places of the struct.
struct TimingStart {
  static void check(CdrReader& in) { kHandedTiming.check(in); }
  static void write(const HandedEdge& edge, wire::HandedEdge& wire) {
    const EdgeTiming timing = edge.timing.value_or(EdgeTiming());
    kHandedTiming.write(timing, wire);
    wire.timed(edge.timing ? 1 : 0);
    wire.drifts(timing.drifts ? 1 : 0);
    wire.moving(timing.moving ? 1 : 0);
    Noise::write(timing.process_noise, wire.process_noise());
  }
  static Result<void> read(const wire::HandedEdge& wire, HandedEdge& edge, const Place& place) {
    if (wire.timed() == 0) return {};
    EdgeTiming& timing = edge.timing.emplace();
    if (auto ok = kHandedTiming.read(wire, timing, place); !ok) return ok;
    timing.drifts = wire.drifts() != 0;
    timing.moving = wire.moving() != 0;
    return Noise::read(wire.process_noise(), timing.process_noise, place);
  }
};

// Three octets that were written and are read with the timing.
struct TimingFlags {
  static void check(CdrReader& in) {
    for (int i = 0; i < 3; ++i) Octet::check(in);
  }
  static void write(const HandedEdge&, const wire::HandedEdge&) {}
  static Result<void> read(const wire::HandedEdge&, const HandedEdge&, const Place&) { return {}; }
};
struct TimingNoise : TimingFlags {
  static void check(CdrReader& in) { Noise::check(in); }
};

struct Observed : Octet {
  static void write(const HandedEdge& edge, std::uint8_t& wire) { wire = edge.now ? 1 : 0; }
  static Result<void> read(std::uint8_t wire, HandedEdge& edge, const Place&) {
    if (wire != 0) edge.now.emplace();
    return {};
  }
};

struct Now : AnyCorrelation {
  static void write(const HandedEdge& edge, wire::Correlation& wire) {
    AnyCorrelation::write(edge.now.value_or(Correlation()), wire);
  }
  static Result<void> read(const wire::Correlation& wire, HandedEdge& edge, const Place& place) {
    return edge.now ? AnyCorrelation::read(wire, *edge.now, place) : Result<void>();
  }
};

constexpr auto kHandedEdge = record(
    TFDUDE_FIELD(lamport_time, lamport_time, kLamportTime),
    field(TFDUDE_ALL, TFDUDE_ALL, TimingStart()),
    TFDUDE_FIELD(state, state, Enumerated(HandedState::kSampled, "an edge that is handed over")),
    TFDUDE_FIELD(left_behind, left_behind, Octet()), field(TFDUDE_ALL, TFDUDE_ALL, TimingFlags()),
    TFDUDE_FIELD_OF_ALL(observed, Observed()), TFDUDE_FIELD(continues, continues, Octet()),
    TFDUDE_FIELD(x_pc, X_PC, OwnedTransform()), field(TFDUDE_ALL, TFDUDE_ALL, TimingNoise()),
    TFDUDE_FIELD(said, said, AnyCorrelation()), TFDUDE_FIELD_OF_ALL(now_correlation, Now()),
    TFDUDE_FIELD(id, id, Id("id")), TFDUDE_FIELD(parent, parent, Id("parent", true)));

constexpr std::uint8_t kSampleAsBefore = 1;
constexpr std::uint8_t kSampleIsRow = 2;
constexpr std::uint8_t kSampleMadeUp = 4;

void write_sample(const HandedSample& sample, const HandedSample* before, std::uint32_t edge,
                  wire::HandedSample& wire) {
  const bool as_before = before != nullptr && before->X_PC.covariance == sample.X_PC.covariance;
  wire.stamp(nanoseconds(sample.stamp));
  wire.edge(edge);
  wire.flags(static_cast<std::uint8_t>((as_before ? kSampleAsBefore : 0) |
                                       (sample.is_row ? kSampleIsRow : 0) |
                                       (sample.made_up ? kSampleMadeUp : 0)));
  if (as_before) {
    write_pose(sample.X_PC.pose, wire.x_pc());
  } else {
    OwnedTransform::write(sample.X_PC, wire.x_pc());
  }
}

constexpr std::uint8_t kRowObserved = 1;
constexpr std::uint8_t kRowBetween = 2;

void write_row(const SampleRevision& revision, std::uint32_t sample, wire::HandedRow& wire) {
  const RowInfo& row = revision.row;
  wire.follows(row.follows);
  wire.before(row.before);
  wire.sample(sample);
  wire.flags(static_cast<std::uint8_t>((row.observed ? kRowObserved : 0) |
                                       (row.between ? kRowBetween : 0)));
  wire.lasts(row.lasts);
  OwnedTransform::write(revision.given, wire.given());
  AnyCorrelation::write(revision.correlation, wire.row_correlation());
}

Result<void> read_row(const wire::HandedRow& wire, SampleRevision& revision, const Place& place) {
  revision.row = {(wire.flags() & kRowObserved) != 0,
                  (wire.flags() & kRowBetween) != 0,
                  wire.lasts(),
                  Told::kNot,
                  wire.follows(),
                  wire.before()};
  auto ok = OwnedTransform::read(wire.given(), revision.given, place);
  return ok ? AnyCorrelation::read(wire.row_correlation(), revision.correlation, place) : ok;
}

constexpr auto kHandedEdges = List(kHandedEdge, kMostHandedAtOnce);

void check_sample(CdrReader& in) {
  Instant::check(in);
  Count32::check(in);
  Octet::check(in);
  OwnedTransform::check(in);
}

void check_row(CdrReader& in) {
  Instant::check(in);
  Instant::check(in);
  Count32::check(in);
  Octet::check(in);
  Octet::check(in);
  OwnedTransform::check(in);
  AnyCorrelation::check(in);
}

// Of which edge each sample is: those of one follow each other, in the order of the edges.
Result<std::vector<HandedSample*>> read_samples(const wire::HandedPart& wire, HandedPart& part,
                                                const Place& place) {
  std::vector<std::size_t> counts(part.edges.size());
  std::uint32_t last = 0;
  for (const wire::HandedSample& one : wire.samples()) {
    if (one.edge() >= counts.size() || one.edge() < last) {
      return place.fail({Errc::kInvalidInput, "a sample of edge " + std::to_string(one.edge()) +
                                                  ", of " + std::to_string(counts.size())});
    }
    ++counts[last = one.edge()];
  }
  for (std::size_t i = 0; i < counts.size(); ++i) part.edges[i].samples.reserve(counts[i]);
  std::vector<HandedSample*> all;
  for (const wire::HandedSample& one : wire.samples()) {
    auto& samples = part.edges[one.edge()].samples;
    HandedSample sample;
    sample.stamp = time_of(one.stamp());
    sample.is_row = (one.flags() & kSampleIsRow) != 0;
    sample.made_up = (one.flags() & kSampleMadeUp) != 0;
    if (auto ok = OwnedTransform::read(one.x_pc(), sample.X_PC, place); !ok) {
      return tl::unexpected(std::move(ok.error()));
    }
    const bool as_before = (one.flags() & kSampleAsBefore) != 0 && !samples.empty();
    if (as_before) sample.X_PC.covariance = samples.back().X_PC.covariance;
    all.push_back(&samples.emplace_back(std::move(sample)));
  }
  return all;
}

}  // namespace

void Handed::check(CdrReader& in) {
  Count64::check(in);
  Count32::check(in);
  Octet::check(in);
  Octet::check(in);
  kHandedEdges.check(in);
  in.sequence(kMostHandedAtOnce, [&] { check_sample(in); });
  in.sequence(kMostHandedAtOnce, [&] { check_row(in); });
}

void Handed::write(const HandedPart& part, wire::HandedPart& wire) {
  wire.incarnation(part.incarnation);
  wire.first(part.first);
  wire.begins(part.begins ? 1 : 0);
  wire.last(part.is_last ? 1 : 0);
  kHandedEdges.write(part.edges, wire.edges());
  wire.samples().clear();
  wire.rows().clear();
  for (std::uint32_t i = 0; i < part.edges.size(); ++i) {
    const HandedSample* before = nullptr;
    for (const HandedSample& sample : part.edges[i].samples) {
      const auto number = static_cast<std::uint32_t>(wire.samples().size());
      write_sample(sample, std::exchange(before, &sample), i, wire.samples().emplace_back());
      if (sample.revision) write_row(*sample.revision, number, wire.rows().emplace_back());
    }
  }
}

Result<void> Handed::read(const wire::HandedPart& wire, HandedPart& part, const Place& place) {
  part.incarnation = wire.incarnation();
  part.first = wire.first();
  part.begins = wire.begins() != 0;
  part.is_last = wire.last() != 0;
  Place edges = place;
  if (auto ok = kHandedEdges.read(wire.edges(), part.edges, edges); !ok) return ok;
  auto samples = read_samples(wire, part, place);
  if (!samples) return tl::unexpected(std::move(samples.error()));
  for (const wire::HandedRow& one : wire.rows()) {
    if (one.sample() >= samples->size()) {
      return place.fail({Errc::kInvalidInput, "a row of sample " + std::to_string(one.sample()) +
                                                  ", of " + std::to_string(samples->size())});
    }
    HandedSample& sample = *(*samples)[one.sample()];
    if (auto ok = read_row(one, sample.revision.emplace(), place); !ok) return ok;
  }
  return {};
}

}  // namespace tfdude::fastdds
