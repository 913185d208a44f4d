// The members of the messages of ROS 2 that the test needs.
#pragma once

#include <array>
#include <string>

#include "rclcpp/rclcpp.hpp"

namespace std_msgs::msg {
struct Header {
  builtin_interfaces::msg::Time stamp;
  std::string frame_id;
};
}  // namespace std_msgs::msg

namespace geometry_msgs::msg {
struct Vector3 {
  double x = 0;
  double y = 0;
  double z = 0;
};
struct Point {
  double x = 0;
  double y = 0;
  double z = 0;
};
struct Quaternion {
  double x = 0;
  double y = 0;
  double z = 0;
  double w = 1;
};
struct Transform {
  Vector3 translation;
  Quaternion rotation;
};
struct Pose {
  Point position;
  Quaternion orientation;
};
struct PoseWithCovariance {
  Pose pose;
  std::array<double, 36> covariance{};
};
struct Twist {
  Vector3 linear;
  Vector3 angular;
};
struct TransformStamped {
  std_msgs::msg::Header header;
  std::string child_frame_id;
  Transform transform;
};
struct PointStamped {
  std_msgs::msg::Header header;
  Point point;
};
struct Vector3Stamped {
  std_msgs::msg::Header header;
  Vector3 vector;
};
struct PoseStamped {
  std_msgs::msg::Header header;
  Pose pose;
};
struct PoseWithCovarianceStamped {
  std_msgs::msg::Header header;
  PoseWithCovariance pose;
};
}  // namespace geometry_msgs::msg
