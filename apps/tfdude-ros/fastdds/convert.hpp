#pragma once

#include <ros2_types.hpp>

#include "../messages.hpp"

// Between the generated types of messages and plain structs.
namespace tfdude::ros {

namespace wire {
using Tf = tf2_msgs::msg::dds_::TFMessage_;
using JointState = sensor_msgs::msg::dds_::JointState_;
using String = std_msgs::msg::dds_::String_;
using Pose = geometry_msgs::msg::dds_::PoseWithCovarianceStamped_;
using Odometry = nav_msgs::msg::dds_::Odometry_;
using NavSatFix = sensor_msgs::msg::dds_::NavSatFix_;
using GeoPose = geographic_msgs::msg::dds_::GeoPoseStamped_;
using Detections = vision_msgs::msg::dds_::Detection3DArray_;
using Tags = isaac_ros_apriltag_interfaces::msg::dds_::AprilTagDetectionArray_;
using Markers = ros2_aruco_interfaces::msg::dds_::ArucoMarkers_;
using Clock = rosgraph_msgs::msg::dds_::Clock_;
}  // namespace wire

[[nodiscard]] TfMessage plain(wire::Tf& message);
[[nodiscard]] JointState plain(wire::JointState& message);
[[nodiscard]] Text plain(wire::String& message);
[[nodiscard]] PoseWithCovariance plain(wire::Pose& message);
[[nodiscard]] Odometry plain(wire::Odometry& message);
[[nodiscard]] GeoPose plain(wire::NavSatFix& message);
[[nodiscard]] GeoPose plain(wire::GeoPose& message);
/// An object's id is that of its track; without one, its most probable class.
[[nodiscard]] Detections plain(wire::Detections& message);
[[nodiscard]] Detections plain(wire::Tags& message);
/// Without the ids that have no pose.
[[nodiscard]] Detections plain(wire::Markers& message);
[[nodiscard]] ClockTime plain(wire::Clock& message);

[[nodiscard]] wire::Tf generated(const TfMessage& message);
[[nodiscard]] wire::JointState generated(const JointState& message);
[[nodiscard]] wire::String generated(const Text& message);
[[nodiscard]] wire::Pose generated(const PoseWithCovariance& message);
[[nodiscard]] wire::Odometry generated(const Odometry& message);
[[nodiscard]] wire::Clock generated(const ClockTime& message);

}  // namespace tfdude::ros
