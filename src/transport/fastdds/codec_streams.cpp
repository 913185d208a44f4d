#include <algorithm>
#include <string>

#include "base/stamp.hpp"
#include "transport/fastdds/codec.hpp"
#include "transport/fastdds/field_values.hpp"
#include "transport/fastdds/fields.hpp"

// Updates, samples of joints, pushed values and the clock.
namespace tfdude::fastdds {
namespace {

// ---- updates

constexpr auto kEdges = List(GivenEdge());
constexpr Stamp kUpdateStamp("the stamp of an update");
constexpr auto kUpdate = record(TFDUDE_FIELD(edges, edges, kEdges),  //
                                TFDUDE_FIELD(stamp, stamp, kUpdateStamp));

// ---- joints

// The position; then, unless it is unspecified, the variance.
struct PositionNumbers {
  static constexpr std::uint32_t kMost = 2;

  static void check(CdrReader& in) { in.numbers(kMost); }
  static void write(const JointValue& joint, Numbers& wire) {
    wire.resize(joint.variance ? 2 : 1);
    wire[0] = joint.position;
    if (joint.variance) wire[1] = *joint.variance;
  }
  static Result<void> read(const Numbers& wire, JointValue& joint, const Place&) {
    if (wire.empty() || wire.size() > kMost) {
      return fail(Errc::kInvalidInput, "joint " + quote(joint.name) + " without a position");
    }
    joint.position = wire[0];
    if (wire.size() == kMost) joint.variance = wire[1];
    return {};
  }
};

constexpr auto kPositions = List(
    record(TFDUDE_FIELD(id, name, Id("joint")), TFDUDE_FIELD_OF_ALL(numbers, PositionNumbers())));
constexpr Stamp kJointStamp("the stamp of an update of joints");
constexpr auto kJoints =
    record(TFDUDE_FIELD(positions, joints, kPositions), TFDUDE_FIELD(stamp, stamp, kJointStamp));

// ---- pushed values

// What is pushed instead of the stamp of a value if the history was cleared.
constexpr std::int64_t kClearedStamp = -2;

// A stamp that was made up is pushed as this minus the stamp.
constexpr std::int64_t kMadeUp = -3;

struct PushedStamp : Number<std::int64_t> {
  static void write(const PushedValue& entry, std::int64_t& wire) {
    wire = entry.cleared ? kClearedStamp : wire_stamp(entry.stamp);
    if (entry.made_up && wire >= 0 && wire <= INT64_MAX + kMadeUp) wire = kMadeUp - wire;
  }
  static Result<void> read(std::int64_t wire, PushedValue& entry, const Place& place) {
    entry.cleared = wire == kClearedStamp;
    entry.made_up = wire <= kMadeUp;
    if (entry.made_up) wire = -(wire - kMadeUp);
    return Stamp("the stamp of a pushed value")
        .read(entry.cleared ? kNoStamp : wire, entry.stamp, place);
  }
};

// Without the covariance if its number is known.
struct PushedTransform : ComputedTransform {
  static void write(const PushedValue& entry, Numbers& wire) {
    if (entry.covariance_known) return write_pose(entry.X.pose, wire);
    GivenTransform::write(entry.X, wire);
  }
  static Result<void> read(const Numbers& wire, PushedValue& entry, const Place& place) {
    entry.covariance_known = entry.covariance_number != 0 && is_pose_only(wire);
    return ComputedTransform::read(wire, entry.X, place);
  }
};

constexpr auto kEntry = record(
    TFDUDE_FIELD_OF_ALL(stamp, PushedStamp()), TFDUDE_FIELD(history, history, Count64()),
    TFDUDE_FIELD(index, index, Count32()), TFDUDE_FIELD(covariance, covariance_number, Count32()),
    TFDUDE_FIELD_OF_ALL(x, PushedTransform()));

// The entry that something further is about.
Result<PushedValue*> entry_of(PushedValues& pushed, std::uint32_t index, const char* about) {
  if (index < pushed.entries.size()) return &pushed.entries[index];
  return fail(Errc::kInvalidInput, "pushed values: " + std::string(about) + " entry " +
                                       std::to_string(index) + ", of " +
                                       std::to_string(pushed.entries.size()));
}

// Of those entries that are correlated.
struct PushedCorrelations {
  static void check(CdrReader& in) {
    in.sequence(kMaxCorrelated, [&] {
      Count32::check(in);
      AnyCorrelation::check(in);
    });
  }
  static void write(const PushedValues& pushed, std::vector<wire::PushedCorrelation>& wire) {
    wire.clear();
    for (std::size_t i = 0; i < pushed.entries.size(); ++i) {
      if (pushed.entries[i].correlation.empty()) continue;
      wire.emplace_back().entry(static_cast<std::uint32_t>(i));
      AnyCorrelation::write(pushed.entries[i].correlation, wire.back().edge_correlation());
    }
  }
  static Result<void> read(const std::vector<wire::PushedCorrelation>& wire, PushedValues& pushed,
                           const Place& place) {
    for (const wire::PushedCorrelation& one : wire) {
      const auto entry = entry_of(pushed, one.entry(), "correlation of");
      if (!entry) return tl::unexpected(entry.error());
      auto& correlation = (*entry)->correlation = {};
      if (auto ok = AnyCorrelation::read(one.edge_correlation(), correlation, place); !ok) {
        return ok;
      }
    }
    return {};
  }
};

// Whether an entry is listed twice among the beginnings: it had no sample yet. Where there is no
// room for that, it is sent without a value.
bool is_listed_twice(const PushedValue& entry, std::size_t& room) {
  if (!entry.unsampled || room == 0) return false;
  --room;
  return true;
}

std::size_t room_for_unsampled(const PushedValues& pushed) {
  return kMaxItems - std::min(kMaxItems, pushed.entries.size());
}

// The entries that begin a history, with the process noise of their edges.
struct PushedBeginnings {
  static void check(CdrReader& in) {
    in.sequence(kMaxItems, [&] {
      Count32::check(in);
      in.numbers(Covariance::kSize);
    });
  }
  static void write(const PushedValues& pushed, std::vector<wire::PushedBeginning>& wire) {
    wire.clear();
    std::size_t room = room_for_unsampled(pushed);
    for (std::size_t i = 0; i < pushed.entries.size(); ++i) {
      const auto& noise = pushed.entries[i].process_noise;
      for (int times = is_listed_twice(pushed.entries[i], room) ? 2
                       : noise                                  ? 1
                                                                : 0;
           times > 0; --times) {
        wire.emplace_back().entry(static_cast<std::uint32_t>(i));
        if (!noise || noise->upper() == Covariance::Upper{}) continue;
        wire.back().process_noise().assign(noise->upper().begin(), noise->upper().end());
      }
    }
    for (std::size_t i = 0; i < pushed.entries.size() && room > 0; ++i) {
      const PushedValue& entry = pushed.entries[i];
      const bool has_no_sample = !entry.stamp && !entry.cleared;
      if (!entry.drifts || !entry.process_noise || (has_no_sample && !entry.unsampled)) continue;
      auto& again = wire.emplace_back();
      again.entry(static_cast<std::uint32_t>(i));
      again.process_noise().assign(entry.process_noise->upper().begin(),
                                   entry.process_noise->upper().end());
      --room;
    }
  }
  static Result<void> read(const std::vector<wire::PushedBeginning>& wire, PushedValues& pushed,
                           const Place& place) {
    for (const wire::PushedBeginning& one : wire) {
      const auto found = entry_of(pushed, one.entry(), "a history begins with");
      if (!found) return tl::unexpected(found.error());
      Covariance noise;
      if (!one.process_noise().empty()) {
        const auto read = read_covariance(one.process_noise(), 0);
        if (!read) return place.fail(fail_at("process noise", read.error()).value());
        noise = *read;
      }
      PushedValue& entry = **found;
      const bool again = entry.process_noise.has_value();
      const bool has_no_sample = !entry.stamp && !entry.cleared;
      entry.drifts = again && (entry.unsampled || !has_no_sample);
      entry.unsampled = again && has_no_sample;
      entry.process_noise = noise;
    }
    return {};
  }
};

constexpr auto kState =
    record(TFDUDE_FIELD(group, group, Count64()), TFDUDE_FIELD(after, after, Count64()),
           TFDUDE_FIELD(commit, commit, Count64()), TFDUDE_FIELD(piece, piece, Count32()),
           TFDUDE_FIELD(pieces, pieces, Count32()), TFDUDE_FIELD(entries, entries, List(kEntry)),
           TFDUDE_FIELD_OF_ALL(correlations, PushedCorrelations()),
           TFDUDE_FIELD_OF_ALL(beginnings, PushedBeginnings()));

// ---- what filters need

// Of a stamped sequence, each element of which has an id and numbers.
std::optional<bool> any_id(CdrReader in, std::uint32_t most_numbers, const Accept& accept) {
  bool found = false;
  for (std::uint32_t left = in.count(1, kMaxItems); left > 0 && in.good() && !found; --left) {
    const std::string_view id = in.bounded_text(kMaxIdBytes);
    in.numbers(most_numbers);
    found = in.good() && accept(id);
  }
  if (!found) Stamp::check(in);
  return in.good() ? std::optional(found) : std::nullopt;
}

}  // namespace

std::optional<bool> any_edge(const std::uint8_t* data, std::size_t size, const Accept& accept) {
  return any_id({data, size}, kTransformNumbers, accept);
}

std::optional<bool> any_joint(const std::uint8_t* data, std::size_t size, const Accept& accept) {
  return any_id({data, size}, PositionNumbers::kMost, accept);
}

// ---- messages

bool well_formed_update(const std::uint8_t* data, std::size_t size) {
  return well_formed(kUpdate, data, size);
}

void write_wire(const Update& update, wire::Update& sample) { kUpdate.write(update, sample); }

Result<Update> from_wire(const wire::Update& sample, const Accept& accept) {
  Update update;
  Place place;
  const auto wanted = [&](const wire::Edge& edge) { return accept(text(edge.id())); };
  auto ok = kUpdateStamp.read(sample.stamp(), update.stamp, place);
  if (ok) ok = kEdges.read_if(sample.edges(), update.edges, place, wanted);
  if (!ok) return tl::unexpected(std::move(ok.error()));
  return update;
}

void JointSamples::check(CdrReader& in) { kJoints.check(in); }

void JointSamples::write(const JointUpdate& update, wire::Joints& wire) {
  kJoints.write(update, wire);
}

Result<void> JointSamples::read(const wire::Joints& wire, JointUpdate& update, const Place& place) {
  return kJoints.read(wire, update, place);
}

bool well_formed_joints(const std::uint8_t* data, std::size_t size) {
  return well_formed(kJoints, data, size);
}

void write_wire(const JointUpdate& update, wire::Joints& sample) { kJoints.write(update, sample); }

Result<JointUpdate> from_wire(const wire::Joints& sample, const Accept& accept) {
  JointUpdate update;
  Place place;
  const auto wanted = [&](const wire::JointPosition& one) { return accept(text(one.id())); };
  auto ok = kJointStamp.read(sample.stamp(), update.stamp, place);
  if (ok) ok = kPositions.read_if(sample.positions(), update.joints, place, wanted);
  if (!ok) return tl::unexpected(std::move(ok.error()));
  return update;
}

void Pushed::check(CdrReader& in) { kState.check(in); }

void Pushed::write(const PushedValues& pushed, wire::State& wire) {
  kState.write(pushed, wire);
  std::size_t room = room_for_unsampled(pushed);
  for (std::size_t i = 0; i < pushed.entries.size(); ++i) {
    const PushedValue& entry = pushed.entries[i];
    if (entry.unsampled && !is_listed_twice(entry, room)) wire.entries()[i].stamp(kClearedStamp);
  }
}

Result<void> Pushed::read(const wire::State& wire, PushedValues& pushed, const Place&) {
  return kState.read(wire, pushed, {"pushed values"});
}

bool well_formed_state(const std::uint8_t* data, std::size_t size) {
  return well_formed(kState, data, size);
}

void write_wire(const PushedValues& pushed, wire::State& sample) { Pushed::write(pushed, sample); }

Result<PushedValues> from_wire(const wire::State& sample) {
  return read_as<PushedValues>(Pushed(), sample, {});
}

bool well_formed_clock(const std::uint8_t* data, std::size_t size) {
  return well_formed(Number<std::int64_t>(), data, size);
}

wire::Clock to_wire(Time now) {
  wire::Clock sample;
  sample.stamp(nanoseconds(now));
  return sample;
}

Result<Time> from_wire(const wire::Clock& sample) {
  const Time now = time_of(sample.stamp());
  if (auto ok = check_stamp(now); !ok) return tl::unexpected(std::move(ok.error()));
  return now;
}

}  // namespace tfdude::fastdds
