#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "tfdude/base/result.hpp"
#include "tfdude/math/observation.hpp"
#include "tfdude/math/ros_variances.hpp"
#include "tfdude/types/query.hpp"

#include "../messages.hpp"
#include "../ros_domain.hpp"

// Poses with covariance. ROS's covariance is about axes parallel to those of the header's frame,
// ours is that of the right perturbation, in the child frame (docs/uncertainty.md).
namespace tfdude::ros {

/// A path that is sent.
struct PoseOut {
  std::string topic;
  std::string frame;
  std::string child;
  std::string prefix{};
  double rate = 10;       ///< at most [Hz]; 0: every change
  bool odometry = false;  ///< nav_msgs/Odometry: with the velocity
};

/// A topic whose messages are measurements.
struct PoseIn {
  std::string topic;
  bool odometry = false;  ///< nav_msgs/Odometry, which names the child
  std::string child{};
  std::string prefix{};
  ObserveOptions options{};
  Variances variances{};
  std::optional<MessageType> geodetic{};  ///< kNavSatFix or kGeoPoseStamped
  std::string frame{"earth"};             ///< of these: the earth's; the others name it themselves
};

/// @param now  the stamp of a path that is static
/// @return none if an edge of the path is unspecified: ROS cannot say that
[[nodiscard]] std::optional<PoseWithCovariance> message_of(const PoseOut& out,
                                                           const StampedTransform& X, Time now);

/// The same with the mean velocity, which ROS has in the axes of the child.
/// @return none also if the velocity depends on an unspecified edge
[[nodiscard]] std::optional<Odometry> message_of(const PoseOut& out, const StampedTransform& X,
                                                 const Velocity& velocity, Time now);

/// A measurement as Client::observe() takes it.
struct Measurement {
  std::string a;
  std::string b;
  Transform X_AB;
  std::optional<Time> stamp;
};

/// Whether a message with a stamp is that before it once more.
[[nodiscard]] bool is_repeat(const PoseWithCovariance& message, const PoseWithCovariance& before);

/// The path that a message is about, from its frame to the child, with its pose and covariance.
/// @return kInvalidInput naming the field: a name, the pose, a covariance that is not one
[[nodiscard]] Result<Measurement> pose_message(const PoseWithCovariance& message,
                                               const std::string& child, const std::string& prefix,
                                               const Variances& variances);

/// @return as pose_message(); also if the message has no covariance.
[[nodiscard]] Result<Measurement> measurement_of(const PoseIn& in,
                                                 const PoseWithCovariance& message,
                                                 const std::string& child);
/// @return as geodetic_message(); also if the message has no covariance.
[[nodiscard]] Result<Measurement> measurement_of(const PoseIn& in, const GeoPose& message);

}  // namespace tfdude::ros
