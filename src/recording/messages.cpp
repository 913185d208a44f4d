#include "recording/messages.hpp"

#include <algorithm>
#include <array>

#include "tfdude/base/id.hpp"

#include "math/flat.hpp"

namespace tfdude::recording {
namespace {

// The least bytes of an element of a sequence.
constexpr std::size_t kLeastText = 4;
constexpr std::size_t kLeastValue = 4 + 4 + 8 + 2 + 56 + 4 * 4;
constexpr std::size_t kLeastKept = 4 + 8;
constexpr std::size_t kLeastJoint = 4 + 4 + 2 + 8 + 4 + 4 + 4 + 32;

tl::unexpected<Error> invalid(const char* what) {
  return fail(Errc::kConfig, std::string("a message is not a valid one of ") + what);
}

// Instead of a stamp.
constexpr std::int64_t kAlways = -1;
constexpr std::int64_t kCleared = -2;
constexpr std::int64_t kUnsampled = -3;

std::int64_t stamp_of(const WatchedValue& value) {
  if (value.cleared) return kCleared;
  if (value.unsampled) return kUnsampled;
  return value.stamp ? nanoseconds(*value.stamp) : kAlways;
}

enum class CovarianceIs : std::uint8_t { kGiven = 0, kUnspecified = 1, kAsBefore = 2 };

// Whether the value begins a history of its edge.
enum class Begins : std::uint8_t { kNot = 0, kAnew = 1, kDrifting = 2 };

void put_upper(CdrWriter& writer, const Covariance& covariance) {
  writer.u32(Covariance::kSize);
  writer.f64s(covariance.upper());
}

// Whether there are numbers; then they must be 21.
bool read_upper(CdrReader& reader, Covariance::Upper& upper, bool& valid) {
  const std::uint32_t count = reader.count(sizeof(double));
  if (count == upper.size()) {
    reader.f64s(upper);
    return true;
  }
  valid = valid && count == 0;
  for (std::uint32_t i = 0; i < count; ++i) (void)reader.f64();
  return false;
}

void put(CdrWriter& writer, const Correlation& correlation) {
  writer.flag(correlation.unknown);
  writer.u32(static_cast<std::uint32_t>(correlation.common_errors.size()));
  for (const CommonError& error : correlation.common_errors) {
    writer.text(error.source);
    writer.flag(error.subtracts);
    writer.u32(static_cast<std::uint32_t>(error.loading.size()));
    for (Eigen::Index i = 0; i < error.loading.size(); ++i) writer.f64(error.loading.data()[i]);
  }
  writer.u32(static_cast<std::uint32_t>(correlation.observed_with.size()));
  for (const std::string& edge : correlation.observed_with) writer.text(edge);
}

Correlation correlation_of(CdrReader& reader, bool& valid) {
  Correlation correlation;
  correlation.unknown = reader.flag();
  const std::uint32_t errors = reader.count(12);
  for (std::uint32_t i = 0; i < errors && reader.good(); ++i) {
    CommonError error;
    error.source = reader.text();
    error.subtracts = reader.flag();
    const std::uint32_t numbers = reader.count(sizeof(double));
    if (numbers % 6 != 0 || numbers / 6 > static_cast<std::uint32_t>(kMaxLoadingColumns)) {
      valid = false;
      for (std::uint32_t n = 0; n < numbers; ++n) (void)reader.f64();
      continue;
    }
    error.loading.resize(6, static_cast<Eigen::Index>(numbers / 6));
    for (std::uint32_t n = 0; n < numbers; ++n) error.loading.data()[n] = reader.f64();
    correlation.common_errors.push_back(std::move(error));
  }
  const std::uint32_t edges = reader.count(kLeastText);
  for (std::uint32_t i = 0; i < edges && reader.good(); ++i) {
    correlation.observed_with.emplace_back(reader.text());
    valid = valid && check_id(correlation.observed_with.back(), "id");
  }
  valid = valid && (errors == 0 || check_common_errors(correlation.common_errors));
  return correlation;
}

bool is_edge(std::string_view id, std::string_view parent) {
  return check_id(id, "id") && check_id(parent, "parent") && id != parent;
}

bool has_ids(const JointInfo& joint) {
  return check_id(joint.name, "joint") && check_id(joint.frame, "frame") &&
         (!joint.mimic || check_id(joint.mimic->joint, "joint"));
}

}  // namespace

WatchedValue RecordedValue::watched(std::uint32_t frame) const {
  WatchedValue value{frame, stamp, X_PC};
  value.cleared = cleared;
  value.unsampled = unsampled;
  if (rest == nullptr) return value;
  value.correlation = rest->correlation;
  value.begins = rest->begins;
  value.kept_before = rest->kept_before;
  value.drifts = rest->drifts;
  return value;
}

ValuesEncoder::ValuesEncoder(std::string& out, std::string_view partition, std::uint64_t commit,
                             bool repeats)
    : writer_(out) {
  writer_.text(partition);
  writer_.u64(commit);
  writer_.flag(repeats);
  count_place_ = writer_.later();
}

void ValuesEncoder::add(const WatchedFrame& edge, const WatchedValue& value, bool as_before) {
  if (value.begins && value.kept_before) kept_.emplace_back(count_, *value.kept_before);
  ++count_;
  writer_.text(edge.id);
  writer_.text(edge.parent);
  writer_.i64(stamp_of(value));
  const StatedCovariance& covariance = value.X_PC.covariance;
  const CovarianceIs is = !covariance.complete() ? CovarianceIs::kUnspecified
                          : as_before            ? CovarianceIs::kAsBefore
                                                 : CovarianceIs::kGiven;
  writer_.u8(static_cast<std::uint8_t>(is));
  const Begins begins = !value.begins  ? Begins::kNot
                        : value.drifts ? Begins::kDrifting
                                       : Begins::kAnew;
  writer_.u8(static_cast<std::uint8_t>(begins));
  const Flat flat = to_flat(value.X_PC);
  for (std::size_t i = 0; i < 7; ++i) writer_.f64(flat[i]);
  if (is == CovarianceIs::kGiven) {
    put_upper(writer_, covariance.of_specified());
  } else {
    writer_.u32(0);
  }
  const bool noise = value.begins && value.begins->upper() != Covariance::Upper{};
  if (noise) {
    put_upper(writer_, *value.begins);
  } else {
    writer_.u32(0);
  }
  put(writer_, value.correlation);
}

void ValuesEncoder::put_kept() {
  writer_.u32(static_cast<std::uint32_t>(kept_.size()));
  for (const auto& [value, before] : kept_) {
    writer_.u32(value);
    writer_.i64(nanoseconds(before));
  }
}

const RecordedEdge* ValuesDecoder::decode_edge(CdrReader& reader) {
  const std::string_view id = reader.text();
  const std::string_view parent = reader.text();
  const RecordedEdge* edge = edges_->find(id, parent);
  if (edge != nullptr || !is_edge(id, parent)) return edge;
  return edges_->add(id, parent);
}

std::optional<Covariance::Upper>& ValuesDecoder::last_of(const RecordedEdge& edge) {
  if (last_.size() <= edge.frame) last_.resize(edge.frame + std::size_t{1});
  return last_[edge.frame];
}

bool ValuesDecoder::decode_value(CdrReader& reader, RecordedValue& value) {
  if (read_value(reader, value)) return true;
  // The value may have had another covariance, which the next one of its edge does not repeat.
  if (value.edge != nullptr) last_of(*value.edge).reset();
  return false;
}

bool ValuesDecoder::read_value(CdrReader& reader, RecordedValue& value) {
  value.edge = decode_edge(reader);
  const std::int64_t stamp = reader.i64();
  const auto is = static_cast<CovarianceIs>(reader.u8());
  const auto begins = static_cast<Begins>(reader.u8());
  std::array<double, 7> pose{};
  reader.f64s(pose);
  bool valid = value.edge != nullptr && stamp >= kUnsampled && stamp <= kMaxTime &&
               is <= CovarianceIs::kAsBefore;
  Covariance::Upper upper{};
  Covariance::Upper noise{};
  const bool given = read_upper(reader, upper, valid);
  const bool noisy = read_upper(reader, noise, valid);
  Correlation correlation = correlation_of(reader, valid);
  if (!reader.good() || !valid) return false;
  std::optional<Covariance::Upper>& last = last_of(*value.edge);
  if (is == CovarianceIs::kAsBefore) {
    if (!last) return false;
    upper = *last;
  } else if (!given && is != CovarianceIs::kUnspecified) {
    return false;
  }
  Flat flat{};
  std::copy(pose.begin(), pose.end(), flat.begin());
  std::copy(upper.begin(), upper.end(), flat.begin() + pose.size());
  const auto X_PC = computed_from(flat);
  if (!X_PC) return false;
  if (is == CovarianceIs::kGiven) last = upper;
  value.X_PC = *X_PC;
  value.X_PC.covariance.set_complete(is != CovarianceIs::kUnspecified);
  value.stamp = stamp >= 0 ? std::optional(time_of(stamp)) : std::nullopt;
  value.cleared = stamp == kCleared;
  value.unsampled = stamp == kUnsampled;
  value.rest.reset();
  if (!correlation.empty()) value.more().correlation = std::move(correlation);
  if (begins == Begins::kNot) return true;
  value.more().begins.emplace();
  value.more().drifts = begins == Begins::kDrifting;
  if (!noisy) return true;
  const auto checked = Covariance::from_upper(noise);
  if (checked) value.more().begins = *checked;
  return checked.has_value();
}

Result<void> ValuesDecoder::decode(std::string_view message, RecordedValues& all) {
  CdrReader reader(message);
  all.partition = reader.text();
  all.commit = reader.u64();
  all.repeats = reader.flag();
  const std::uint32_t count = reader.count(kLeastValue);
  if (!reader.good() || !check_partition_name(all.partition)) return invalid("values");
  all.values.reserve(count);
  numbers_.clear();
  for (std::uint32_t i = 0; i < count; ++i) {
    const std::size_t valid = numbers_.size();
    RecordedValue& value =
        valid < all.values.size() ? all.values[valid] : all.values.emplace_back();
    if (decode_value(reader, value)) numbers_.push_back(i);
    if (!reader.good()) return invalid("values");
  }
  all.values.resize(numbers_.size());
  decode_kept(reader, all.values);
  if (!reader.good()) return invalid("values");
  return {};
}

// Earlier versions did not write this.
void ValuesDecoder::decode_kept(CdrReader& reader, std::vector<RecordedValue>& values) const {
  if (reader.left() == 0) return;
  for (std::uint32_t left = reader.count(kLeastKept); left > 0 && reader.good(); --left) {
    const std::uint32_t number = reader.u32();
    const std::int64_t before = reader.i64();
    const auto found = std::lower_bound(numbers_.begin(), numbers_.end(), number);
    if (found == numbers_.end() || *found != number || before < 0 || before > kMaxTime) continue;
    RecordedValue& value = values[static_cast<std::size_t>(found - numbers_.begin())];
    if (value.rest && value.rest->begins) value.rest->kept_before = time_of(before);
  }
}

void encode(const RecordedFrames& frames, std::string& out) {
  CdrWriter writer(out);
  writer.text(frames.partition);
  writer.u64(frames.incarnation);
  writer.flag(frames.reachable);
  writer.text(frames.why);
  writer.flag(frames.complete);
  writer.flag(frames.repeats);
  writer.u32(static_cast<std::uint32_t>(frames.frames.size()));
  for (const WatchedFrame& frame : frames.frames) {
    writer.text(frame.id);
    writer.text(frame.parent);
  }
  writer.u32(static_cast<std::uint32_t>(frames.removed.size()));
  for (const std::string& id : frames.removed) writer.text(id);
}

Result<RecordedFrames> decode_frames(std::string_view message) {
  CdrReader reader(message);
  RecordedFrames all;
  all.partition = reader.text();
  all.incarnation = reader.u64();
  all.reachable = reader.flag();
  all.why = printable(reader.text());
  all.complete = reader.flag();
  all.repeats = reader.flag();
  const std::uint32_t count = reader.count(2 * kLeastText);
  for (std::uint32_t i = 0; i < count && reader.good(); ++i) {
    WatchedFrame frame;
    frame.id = reader.text();
    frame.parent = reader.text();
    if (check_id(frame.id, "id") && (frame.parent.empty() || is_edge(frame.id, frame.parent))) {
      all.frames.push_back(std::move(frame));
    }
  }
  const std::uint32_t removed = reader.count(kLeastText);
  for (std::uint32_t i = 0; i < removed && reader.good(); ++i) {
    const std::string_view id = reader.text();
    if (check_id(id, "id")) all.removed.emplace_back(id);
  }
  if (!reader.good() || !check_partition_name(all.partition)) return invalid("frames");
  return all;
}

void encode(const RecordedJoints& joints, std::string& out) {
  CdrWriter writer(out);
  writer.text(joints.partition);
  writer.flag(joints.repeats);
  writer.u32(static_cast<std::uint32_t>(joints.joints.size()));
  for (const JointInfo& joint : joints.joints) {
    writer.text(joint.name);
    writer.text(joint.frame);
    writer.u8(static_cast<std::uint8_t>(joint.type));
    writer.flag(joint.measured);
    writer.f64(joint.position);
    writer.u32(joint.variance ? 1 : 0);
    if (joint.variance) writer.f64(*joint.variance);
    writer.u32(joint.limits ? 2 : 0);
    if (joint.limits) {
      writer.f64(joint.limits->lower);
      writer.f64(joint.limits->upper);
    }
    writer.text(joint.mimic ? joint.mimic->joint : "");
    writer.f64(joint.mimic ? joint.mimic->multiplier : 0);
    writer.f64(joint.mimic ? joint.mimic->offset : 0);
    writer.u64(joint.outside);
    writer.u64(joint.refused);
  }
}

Result<RecordedJoints> decode_joints(std::string_view message) {
  CdrReader reader(message);
  RecordedJoints all;
  all.partition = reader.text();
  all.repeats = reader.flag();
  const std::uint32_t count = reader.count(kLeastJoint);
  for (std::uint32_t i = 0; i < count && reader.good(); ++i) {
    JointInfo joint;
    joint.name = reader.text();
    joint.frame = reader.text();
    const std::uint8_t type = reader.u8();
    joint.type = static_cast<JointType>(type);
    joint.measured = reader.flag();
    joint.position = reader.f64();
    for (std::uint32_t n = reader.count(sizeof(double)); n > 0; --n) joint.variance = reader.f64();
    std::vector<double> limits(reader.count(sizeof(double)));
    reader.f64s(limits);
    if (limits.size() == 2) joint.limits = JointLimits{limits[0], limits[1]};
    Mimic mimic;
    mimic.joint = reader.text();
    mimic.multiplier = reader.f64();
    mimic.offset = reader.f64();
    if (!mimic.joint.empty()) joint.mimic = std::move(mimic);
    joint.outside = reader.u64();
    joint.refused = reader.u64();
    if (type < 1 || type > 3) return invalid("joints");
    if (has_ids(joint)) all.joints.push_back(std::move(joint));
  }
  if (!reader.good() || !check_partition_name(all.partition)) return invalid("joints");
  return all;
}

void encode(const Change& change, std::string& out) {
  CdrWriter writer(out);
  writer.text(to_string(change.kind));
  writer.text(change.partition);
  writer.text(change.frame);
  writer.text(change.parent);
  writer.text(change.rival);
  writer.text(change.message);
  writer.i64(nanoseconds(change.time));
  writer.flag(change.stopped);
}

Result<Change> decode_event(std::string_view message) {
  CdrReader reader(message);
  const std::string_view kind = reader.text();
  Change change;
  change.partition = reader.text();
  change.frame = reader.text();
  change.parent = reader.text();
  change.rival = reader.text();
  change.message = printable(reader.text());
  change.time = checked_time(reader.i64());
  change.stopped = reader.flag();
  const auto is_none_or_id = [](const std::string& id) { return id.empty() || check_id(id, "id"); };
  if (!reader.good() || !check_partition_name(change.partition) || !is_none_or_id(change.frame) ||
      !is_none_or_id(change.parent) || !is_none_or_id(change.rival)) {
    return invalid("events");
  }
  for (auto i = ChangeKind::kPartitionUp; i <= ChangeKind::kJointConflict;
       i = static_cast<ChangeKind>(static_cast<int>(i) + 1)) {
    if (to_string(i) != kind) continue;
    change.kind = i;
    return change;
  }
  return invalid("events");
}

void encode_keyframe(bool ends, std::string& out) {
  CdrWriter writer(out);
  writer.flag(ends);
}

Result<bool> decode_keyframe(std::string_view message) {
  CdrReader reader(message);
  const bool ends = reader.flag();
  if (!reader.good()) return invalid("keyframes");
  return ends;
}

}  // namespace tfdude::recording
