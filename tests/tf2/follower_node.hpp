// A node of ROS 2 as it is written for tf2: it follows a frame, and brings detections to its map.
// CMake replaces the two lines that include tf2_ros, and nothing else, before the test compiles it.
#pragma once

#include <cmath>
#include <memory>
#include <string>

#include "geometry_msgs/msg/messages.hpp"
#include "rclcpp/rclcpp.hpp"
#include "tf2_ros/buffer.h"
#include "tf2_ros/transform_listener.h"

class FollowerNode : public rclcpp::Node {
 public:
  FollowerNode() : Node("follower") {
    tf_buffer_ = std::make_unique<tf2_ros::Buffer>(this->get_clock());
    tf_listener_ = std::make_shared<tf2_ros::TransformListener>(*tf_buffer_);
  }

  bool on_timer() {
    geometry_msgs::msg::TransformStamped t;
    try {
      t = tf_buffer_->lookupTransform("follower", "leader", tf2::TimePointZero);
    } catch (const tf2::TransformException& ex) {
      RCLCPP_WARN(this->get_logger(), "Could not transform: %s", ex.what());
      return false;
    }
    command_.angular.z = 1.0 * atan2(t.transform.translation.y, t.transform.translation.x);
    command_.linear.x =
        0.5 * sqrt(pow(t.transform.translation.x, 2) + pow(t.transform.translation.y, 2));
    last_ = rclcpp::Time(t.header.stamp);
    return true;
  }

  void on_detection(const std::shared_ptr<const geometry_msgs::msg::PointStamped>& msg) {
    if (!tf_buffer_->canTransform("map", msg->header.frame_id, msg->header.stamp,
                                  rclcpp::Duration::from_seconds(0.05))) {
      RCLCPP_WARN(this->get_logger(), "%s", "no transform from " + msg->header.frame_id);
      return;
    }
    try {
      tf_buffer_->transform(*msg, detection_, "map", tf2::durationFromSec(0.1));
    } catch (const tf2::LookupException& ex) {
      RCLCPP_WARN(this->get_logger(), "%s", ex.what());
    } catch (const tf2::ExtrapolationException& ex) {
      RCLCPP_WARN(this->get_logger(), "%s", ex.what());
    }
  }

  void on_pose(const geometry_msgs::msg::PoseWithCovarianceStamped& msg) {
    pose_ = tf_buffer_->transform(msg, "map");
    const auto transform =
        tf_buffer_->lookupTransform("map", msg.header.frame_id, msg.header.stamp);
    tf2::doTransform(heading_, heading_, transform);
  }

  geometry_msgs::msg::Twist command_;
  geometry_msgs::msg::PointStamped detection_;
  geometry_msgs::msg::PoseWithCovarianceStamped pose_;
  geometry_msgs::msg::Vector3Stamped heading_;
  rclcpp::Time last_;

 private:
  std::unique_ptr<tf2_ros::Buffer> tf_buffer_;
  std::shared_ptr<tf2_ros::TransformListener> tf_listener_;
};
