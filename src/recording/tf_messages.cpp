#include "tfdude/base/id.hpp"

#include "recording/messages.hpp"

// Transforms as ROS has them: tf2_msgs/msg/TFMessage.
namespace tfdude::recording {
namespace {

constexpr std::int64_t kSecond = 1'000'000'000;
constexpr std::size_t kLeastTransform = 8 + 4 + 4 + 56;

}  // namespace

TfEncoder::TfEncoder(std::string& out) : writer_(out), count_place_(writer_.later()) {}

void TfEncoder::add(const WatchedFrame& edge, const Pose& X_PC, Time stamp) {
  ++count_;
  const std::int64_t ns = nanoseconds(stamp);
  writer_.u32(static_cast<std::uint32_t>(ns / kSecond));
  writer_.u32(static_cast<std::uint32_t>(ns % kSecond));
  writer_.text(edge.parent);
  writer_.text(edge.id);
  for (int i = 0; i < 3; ++i) writer_.f64(X_PC.translation()[i]);
  const Eigen::Quaterniond& q = X_PC.rotation();
  for (const double number : {q.x(), q.y(), q.z(), q.w()}) writer_.f64(number);
}

Result<std::vector<RecordedValue>> decode_tf(std::string_view message) {
  CdrReader reader(message);
  const std::uint32_t count = reader.count(kLeastTransform);
  std::vector<RecordedValue> values;
  for (std::uint32_t i = 0; i < count && reader.good(); ++i) {
    const auto seconds = static_cast<std::int32_t>(reader.u32());
    const std::uint32_t nanos = reader.u32();
    RecordedValue recorded;
    recorded.edge.parent = reader.text();
    recorded.edge.id = reader.text();
    Eigen::Vector3d p;
    for (int n = 0; n < 3; ++n) p[n] = reader.f64();
    Eigen::Quaterniond q;
    q.x() = reader.f64();
    q.y() = reader.f64();
    q.z() = reader.f64();
    q.w() = reader.f64();
    if (!reader.good()) break;
    const auto pose = Pose::create(q, p);
    const bool edge = check_id(recorded.edge.id, "id") &&
                      check_id(recorded.edge.parent, "parent") &&
                      recorded.edge.id != recorded.edge.parent;
    if (!pose || !edge || seconds < 0) continue;
    recorded.value.stamp = time_of(seconds * kSecond + nanos);
    recorded.value.X_PC = {*pose, StatedCovariance::unspecified()};
    values.push_back(std::move(recorded));
  }
  if (!reader.good()) {
    return fail(Errc::kState, "a message is not a valid one of " + std::string("transforms"));
  }
  return values;
}

}  // namespace tfdude::recording
