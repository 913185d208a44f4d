#include "tfdude/base/id.hpp"

#include "recording/messages.hpp"
#include "types/ros_rules.hpp"

// Transforms as ROS has them: tf2_msgs/msg/TFMessage.
namespace tfdude::recording {
namespace {

constexpr std::int64_t kSecond = 1'000'000'000;
constexpr std::size_t kLeastTransform = 8 + 4 + 4 + 56;
// Of the name of a frame that is left out.
constexpr std::size_t kShown = 60;

// What is wrong with a transform, and how many have that.
struct Fault {
  Error error;
  std::size_t& count;
};

std::optional<Fault> fault_of(const WatchedFrame& edge, std::int32_t seconds,
                              const Result<Pose>& pose, TransformCounts& counts) {
  for (auto [id, what] : {std::pair(&edge.id, "id"), std::pair(&edge.parent, "parent")}) {
    if (auto ok = check_new_id(*id, what); !ok) return Fault{std::move(ok.error()), counts.names};
  }
  const auto fault = [](const char* why, std::size_t& count) {
    return Fault{{Errc::kInvalidInput, why}, count};
  };
  if (edge.id == edge.parent) return fault("it is its own parent", counts.values);
  if (seconds < 0) return fault("its stamp is negative", counts.early);
  if (!pose) return Fault{pose.error(), counts.values};
  return std::nullopt;
}

}  // namespace

Result<RecordedTransforms> decode_tf(std::string_view message, EdgeTable& edges) {
  CdrReader reader(message);
  const std::uint32_t count = reader.count(kLeastTransform);
  RecordedTransforms all;
  for (std::uint32_t i = 0; i < count && reader.good(); ++i) {
    const auto seconds = static_cast<std::int32_t>(reader.u32());
    const std::uint32_t nanos = reader.u32();
    WatchedFrame edge;
    edge.parent = ros::without_slashes(reader.text());
    edge.id = ros::without_slashes(reader.text());
    Eigen::Vector3d p;
    for (int n = 0; n < 3; ++n) p[n] = reader.f64();
    Eigen::Quaterniond q;
    q.x() = reader.f64();
    q.y() = reader.f64();
    q.z() = reader.f64();
    q.w() = reader.f64();
    if (!reader.good()) break;
    const auto pose = ros::pose_of(q, p);
    if (const auto fault = fault_of(edge, seconds, pose, all.counts)) {
      ++fault->count;
      all.left_out.push_back("the transform of frame " + quote(edge.id.substr(0, kShown)) +
                             " is left out: " + fault->error.message);
      continue;
    }
    RecordedValue recorded;
    recorded.edge = edges.find(edge.id, edge.parent);
    if (recorded.edge == nullptr) recorded.edge = edges.add(edge.id, edge.parent);
    recorded.stamp = time_of(seconds * kSecond + nanos);
    recorded.dated = recorded.stamp == Time();
    recorded.X_PC = {*pose, StatedCovariance::unspecified()};
    all.values.push_back(std::move(recorded));
  }
  if (!reader.good()) {
    return fail(Errc::kConfig, "a message is not a valid one of " + std::string("transforms"));
  }
  return all;
}

}  // namespace tfdude::recording
