#pragma once

#include <optional>
#include <string>

#include "tfdude/base/result.hpp"
#include "tfdude/math/ros_variances.hpp"

#include "../messages.hpp"
#include "../ros_domain.hpp"
#include "poses.hpp"

// Poses of ROS as values of edges: a filter's estimate replaces the one before. No DDS, no threads
// and no clock.
namespace tfdude::ros {

/// A topic whose messages are values.
struct ValueIn {
  std::string topic;
  bool odometry = false;  ///< nav_msgs/Odometry, which names the child
  std::string child{};
  /// A frame above the child, as `odom` above `base_link`: the edge to the message's frame takes
  /// the value, so that both together are the message's pose. Empty: the child's own edge.
  std::string edge{};
  std::string prefix{};
  Variances variances{};
  std::optional<MessageType> geodetic{};  ///< kNavSatFix or kGeoPoseStamped
  std::string frame{"earth"};             ///< of these: the earth's; the others name it themselves
};

/// What a message says of the path from its frame to the child.
/// @return kInvalidInput naming the field: a name, the pose, a covariance that is not one
[[nodiscard]] Result<Measurement> value_of(const ValueIn& in, const PoseWithCovariance& message,
                                           const std::string& child);

[[nodiscard]] Result<Measurement> value_of(const ValueIn& in, const GeoPose& message);

/// The value of the child's own edge, as a transform of /tf that has a covariance.
/// @return as value_of()
[[nodiscard]] Result<TransformStamped> transform_of(const ValueIn& in,
                                                    const PoseWithCovariance& message,
                                                    const std::string& child);
[[nodiscard]] Result<TransformStamped> transform_of(const ValueIn& in, const GeoPose& message);

}  // namespace tfdude::ros
