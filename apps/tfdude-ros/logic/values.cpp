#include "values.hpp"

#include "geodetic.hpp"
#include "names.hpp"

namespace tfdude::ros {

Result<Measurement> value_of(const ValueIn& in, const PoseWithCovariance& message,
                             const std::string& child) {
  return pose_message(message, child, in.prefix, in.variances);
}

Result<TransformStamped> transform_of(const ValueIn& in, const PoseWithCovariance& message,
                                      const std::string& child) {
  const auto value = value_of(in, message, child);
  if (!value) return tl::unexpected(value.error());
  return TransformStamped{message.stamp, message.frame, child, message.pose,
                          value->X_AB.covariance};
}

Result<Measurement> value_of(const ValueIn& in, const GeoPose& message) {
  return geodetic_message(message, in.frame, in.child, in.prefix, in.variances);
}

Result<TransformStamped> transform_of(const ValueIn& in, const GeoPose& message) {
  const auto value = value_of(in, message);
  if (!value) return tl::unexpected(value.error());
  return TransformStamped{message.stamp, in.frame, in.child, ros_pose_of(value->X_AB.pose),
                          value->X_AB.covariance};
}

}  // namespace tfdude::ros
