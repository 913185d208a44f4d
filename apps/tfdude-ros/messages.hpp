#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "tfdude/base/time.hpp"
#include "tfdude/math/stated_covariance.hpp"

// The messages of ROS 2 as plain structs: what the bridge works with, and no DDS.
namespace tfdude::ros {

/// As it came: neither the names nor the numbers are checked.
struct RosPose {
  std::array<double, 3> xyz{};             ///< [m]
  std::array<double, 4> quat{0, 0, 0, 1};  ///< x, y, z, w
};

/// geometry_msgs/TransformStamped: the pose of the child in its parent.
struct TransformStamped {
  Time stamp{};
  std::string parent;
  std::string child;
  RosPose pose;
  /// Of the right perturbation. /tf has none: this transform is from another topic.
  std::optional<StatedCovariance> covariance{};
};

/// tf2_msgs/TFMessage.
using TfMessage = std::vector<TransformStamped>;

/// sensor_msgs/JointState without velocities and efforts.
struct JointState {
  Time stamp{};
  std::vector<std::string> names;
  std::vector<double> positions;  ///< [rad or m]
};

/// std_msgs/String.
struct Text {
  std::string data;
};

/// geometry_msgs/PoseWithCovarianceStamped, and the part of nav_msgs/Odometry that says the same.
struct PoseWithCovariance {
  Time stamp{};
  std::string frame;
  RosPose pose;
  /// 6x6, row by row, translation first, about axes parallel to those of `frame`.
  std::array<double, 36> covariance{};
};

/// nav_msgs/Odometry.
struct Odometry {
  PoseWithCovariance pose;
  std::string child;
  std::array<double, 3> linear{};   ///< in the child's axes [m/s]
  std::array<double, 3> angular{};  ///< [rad/s]
  std::array<double, 36> twist_covariance{};
};

/// sensor_msgs/NavSatFix, or geographic_msgs/GeoPoseStamped: a place on the Earth.
struct GeoPose {
  Time stamp{};
  std::string frame;              ///< of a receiver, its antenna
  std::array<double, 3> place{};  ///< latitude, longitude [deg], altitude [m]
  /// x, y, z, w, in the axes east, north and up; absent: it is a position only.
  std::optional<std::array<double, 4>> quat{};
  /// Of the position, 3x3, row by row, along east, north and up [m²]; absent: it is not known.
  std::optional<std::array<double, 9>> covariance{};
  bool fixed = true;  ///< false: the receiver had no fix
};

/// An object that a camera has seen.
struct Detection {
  std::string id;
  RosPose pose;  ///< in the frame of the message
  std::array<double, 36> covariance{};
};

/// vision_msgs/Detection3DArray, isaac_ros_apriltag_interfaces/AprilTagDetectionArray or
/// ros2_aruco_interfaces/ArucoMarkers.
struct Detections {
  Time stamp{};
  std::string frame;
  std::vector<Detection> objects;
};

/// rosgraph_msgs/Clock.
struct ClockTime {
  Time now{};
};

using Message = std::variant<TfMessage, JointState, Text, PoseWithCovariance, Odometry, GeoPose,
                             Detections, ClockTime>;

}  // namespace tfdude::ros
