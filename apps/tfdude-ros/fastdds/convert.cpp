#include "convert.hpp"

#include <algorithm>
#include <utility>

namespace tfdude::ros {
namespace {

constexpr std::int64_t kSecond = 1'000'000'000;

Time plain_time(const builtin_interfaces::msg::dds_::Time_& time) {
  return time_of(time.sec_() * kSecond + time.nanosec_());
}

// Before the epoch the seconds are rounded down, as the nanoseconds have no sign.
builtin_interfaces::msg::dds_::Time_ generated_time(Time time) {
  const std::int64_t total = nanoseconds(time);
  const std::int64_t rest = ((total % kSecond) + kSecond) % kSecond;
  builtin_interfaces::msg::dds_::Time_ out;
  out.sec_(static_cast<std::int32_t>((total - rest) / kSecond));
  out.nanosec_(static_cast<std::uint32_t>(rest));
  return out;
}

template <class Vector, class Quaternion>
RosPose plain_pose(const Vector& p, const Quaternion& q) {
  return {{p.x_(), p.y_(), p.z_()}, {q.x_(), q.y_(), q.z_(), q.w_()}};
}

template <class Vector>
void set_vector(const std::array<double, 3>& numbers, Vector& out) {
  out.x_(numbers[0]);
  out.y_(numbers[1]);
  out.z_(numbers[2]);
}

template <class Vector, class Quaternion>
void set_pose(const RosPose& pose, Vector& p, Quaternion& q) {
  set_vector(pose.xyz, p);
  q.x_(pose.quat[0]);
  q.y_(pose.quat[1]);
  q.z_(pose.quat[2]);
  q.w_(pose.quat[3]);
}

std_msgs::msg::dds_::Header_ header(Time stamp, const std::string& frame) {
  std_msgs::msg::dds_::Header_ out;
  out.stamp_(generated_time(stamp));
  out.frame_id_(frame);
  return out;
}

template <class Stamped>
PoseWithCovariance plain_stamped(Stamped& message) {
  auto& pose = message.pose_();
  return {plain_time(message.header_().stamp_()), std::move(message.header_().frame_id_()),
          plain_pose(pose.pose_().position_(), pose.pose_().orientation_()), pose.covariance_()};
}

template <class Stamped>
void set_stamped(const PoseWithCovariance& message, Stamped& out) {
  out.header_(header(message.stamp, message.frame));
  auto& pose = out.pose_().pose_();
  set_pose(message.pose, pose.position_(), pose.orientation_());
  out.pose_().covariance_(message.covariance);
}

}  // namespace

TfMessage plain(wire::Tf& message) {
  TfMessage out;
  out.reserve(message.transforms_().size());
  for (auto& one : message.transforms_()) {
    auto& transform = one.transform_();
    out.push_back({plain_time(one.header_().stamp_()), std::move(one.header_().frame_id_()),
                   std::move(one.child_frame_id_()),
                   plain_pose(transform.translation_(), transform.rotation_())});
  }
  return out;
}

JointState plain(wire::JointState& message) {
  return {plain_time(message.header_().stamp_()), std::move(message.name_()),
          std::move(message.position_())};
}

Text plain(wire::String& message) { return {std::move(message.data_())}; }

PoseWithCovariance plain(wire::Pose& message) { return plain_stamped(message); }

Odometry plain(wire::Odometry& message) {
  const auto& twist = message.twist_().twist_();
  return {plain_stamped(message),
          std::move(message.child_frame_id_()),
          {twist.linear_().x_(), twist.linear_().y_(), twist.linear_().z_()},
          {twist.angular_().x_(), twist.angular_().y_(), twist.angular_().z_()},
          message.twist_().covariance_()};
}

GeoPose plain(wire::NavSatFix& message) {
  GeoPose out{plain_time(message.header_().stamp_()),
              std::move(message.header_().frame_id_()),
              {message.latitude_(), message.longitude_(), message.altitude_()}};
  if (message.position_covariance_type_() != 0) out.covariance = message.position_covariance_();
  out.fixed = static_cast<std::int8_t>(message.status_().status_()) >= 0;
  return out;
}

GeoPose plain(wire::GeoPose& message) {
  const auto& p = message.pose_().position_();
  const auto& q = message.pose_().orientation_();
  return {plain_time(message.header_().stamp_()),
          std::move(message.header_().frame_id_()),
          {p.latitude_(), p.longitude_(), p.altitude_()},
          std::array<double, 4>{q.x_(), q.y_(), q.z_(), q.w_()}};
}

Detections plain(wire::Detections& message) {
  Detections out{
      plain_time(message.header_().stamp_()), std::move(message.header_().frame_id_()), {}};
  for (auto& one : message.detections_()) {
    if (out.frame.empty()) out.frame = one.header_().frame_id_();
    auto& results = one.results_();
    const auto best =
        std::max_element(results.begin(), results.end(), [](const auto& a, const auto& b) {
          return a.hypothesis_().score_() < b.hypothesis_().score_();
        });
    if (best == results.end()) continue;
    const auto& pose = best->pose_().pose_();
    std::string& id = one.id_().empty() ? best->hypothesis_().class_id_() : one.id_();
    out.objects.push_back({std::move(id), plain_pose(pose.position_(), pose.orientation_()),
                           best->pose_().covariance_()});
  }
  return out;
}

Detections plain(wire::Tags& message) {
  Detections out{
      plain_time(message.header_().stamp_()), std::move(message.header_().frame_id_()), {}};
  for (const auto& one : message.detections_()) {
    const auto& pose = one.pose_().pose_();
    out.objects.push_back({std::to_string(one.id_()),
                           plain_pose(pose.pose_().position_(), pose.pose_().orientation_()),
                           pose.covariance_()});
  }
  return out;
}

Detections plain(wire::Markers& message) {
  Detections out{
      plain_time(message.header_().stamp_()), std::move(message.header_().frame_id_()), {}};
  const std::size_t count = std::min(message.marker_ids_().size(), message.poses_().size());
  for (std::size_t i = 0; i < count; ++i) {
    const auto& pose = message.poses_()[i];
    out.objects.push_back({std::to_string(message.marker_ids_()[i]),
                           plain_pose(pose.position_(), pose.orientation_()),
                           {}});
  }
  return out;
}

ClockTime plain(wire::Clock& message) { return {plain_time(message.now_())}; }

wire::Tf generated(const TfMessage& message) {
  wire::Tf out;
  out.transforms_().resize(message.size());
  for (std::size_t i = 0; i < message.size(); ++i) {
    auto& one = out.transforms_()[i];
    one.header_(header(message[i].stamp, message[i].parent));
    one.child_frame_id_(message[i].child);
    set_pose(message[i].pose, one.transform_().translation_(), one.transform_().rotation_());
  }
  return out;
}

wire::JointState generated(const JointState& message) {
  wire::JointState out;
  out.header_(header(message.stamp, {}));
  out.name_(message.names);
  out.position_(message.positions);
  return out;
}

wire::String generated(const Text& message) {
  wire::String out;
  out.data_(message.data);
  return out;
}

wire::Pose generated(const PoseWithCovariance& message) {
  wire::Pose out;
  set_stamped(message, out);
  return out;
}

wire::Odometry generated(const Odometry& message) {
  wire::Odometry out;
  set_stamped(message.pose, out);
  out.child_frame_id_(message.child);
  set_vector(message.linear, out.twist_().twist_().linear_());
  set_vector(message.angular, out.twist_().twist_().angular_());
  out.twist_().covariance_(message.twist_covariance);
  return out;
}

wire::Clock generated(const ClockTime& message) {
  wire::Clock out;
  out.now_(generated_time(message.now));
  return out;
}

}  // namespace tfdude::ros
