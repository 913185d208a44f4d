#include "ros_domain.hpp"

// The settings are those of tf2_ros (qos.hpp), robot_state_publisher and rclcpp.
namespace tfdude::ros {

Topic tf_topic() { return {"/tf", MessageType::kTf, true, false, 100, 100}; }

// Each message of a writer has all of its static transforms, so it keeps one.
Topic tf_static_topic() { return {"/tf_static", MessageType::kTf, true, true, 100, 1}; }

Topic joint_states_topic() {
  return {"/joint_states", MessageType::kJointState, false, false, 5, 10};
}

Topic description_topic() { return {"/robot_description", MessageType::kString, true, true, 1, 1}; }

Topic clock_topic() { return {"/clock", MessageType::kClock, false, false, 1, 1}; }

Topic pose_topic(const std::string& name) {
  return {name, MessageType::kPoseWithCovarianceStamped, false, false, 10, 10};
}

Topic odometry_topic(const std::string& name) {
  return {name, MessageType::kOdometry, false, false, 10, 10};
}

Topic geodetic_topic(const std::string& name, MessageType type) {
  return {name, type, false, false, 10, 10};
}

Topic detections_topic(const std::string& name, MessageType type) {
  return {name, type, false, false, 10, 10};
}

}  // namespace tfdude::ros
