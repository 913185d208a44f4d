#pragma once

#include <string>

#include <geometry_msgs/TransformStamped.h>

#include "tfdude/math/pose.hpp"

namespace tfdude::testing {

/// An edge as tf2 takes it.
inline geometry_msgs::TransformStamped tf2_message(const std::string& parent,
                                                   const std::string& child, const Pose& X_PC,
                                                   ros::Time at) {
  geometry_msgs::TransformStamped message;
  message.header.frame_id = parent;
  message.header.stamp = at;
  message.child_frame_id = child;
  const auto q = X_PC.rotation();
  const auto p = X_PC.translation();
  message.transform.translation.x = p.x();
  message.transform.translation.y = p.y();
  message.transform.translation.z = p.z();
  message.transform.rotation.x = q.x();
  message.transform.rotation.y = q.y();
  message.transform.rotation.z = q.z();
  message.transform.rotation.w = q.w();
  return message;
}

}  // namespace tfdude::testing
