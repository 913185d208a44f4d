#include "poses.hpp"

#include "tfdude/math/perturbation.hpp"

#include "geodetic.hpp"
#include "names.hpp"
#include "stamps.hpp"

namespace tfdude::ros {
namespace {

using RowMajor = Eigen::Matrix<double, 6, 6, Eigen::RowMajor>;

// Without a covariance it cannot be weighed.
Result<Measurement> with_weight(Result<Measurement> measured) {
  if (!measured || measured->X_AB.covariance.complete()) return measured;
  return fail(Errc::kInvalidInput, "covariance: the message has none");
}

}  // namespace

std::optional<PoseWithCovariance> message_of(const PoseOut& out, const StampedTransform& X,
                                             Time now) {
  const StatedCovariance stated = ros_covariance(X);
  const Covariance* covariance = stated.if_complete();
  const auto frame = ros_name_of(out.frame, out.prefix);
  if (covariance == nullptr || !frame) return std::nullopt;
  PoseWithCovariance message{X.stamp.value_or(now), *frame, ros_pose_of(X.pose), {}};
  Eigen::Map<RowMajor>(message.covariance.data()) = covariance->matrix();
  return message;
}

std::optional<Odometry> message_of(const PoseOut& out, const StampedTransform& X,
                                   const Velocity& velocity, Time now) {
  auto pose = message_of(out, X, now);
  const Covariance* covariance = velocity.covariance.if_complete();
  auto child = ros_name_of(out.child, out.prefix);
  if (!pose || covariance == nullptr || !child) return std::nullopt;
  Odometry message{*std::move(pose), *std::move(child)};
  const Eigen::Matrix3d R_CA = X.pose.rotation().conjugate().toRotationMatrix();
  Eigen::Map<Eigen::Vector3d>(message.linear.data()) = R_CA * velocity.linear;
  Eigen::Map<Eigen::Vector3d>(message.angular.data()) = R_CA * velocity.angular;
  Matrix6d T = Matrix6d::Zero();
  T.topLeftCorner<3, 3>() = R_CA;
  T.bottomRightCorner<3, 3>() = R_CA;
  Eigen::Map<RowMajor>(message.twist_covariance.data()) = T * covariance->matrix() * T.transpose();
  return message;
}

bool is_repeat(const PoseWithCovariance& message, const PoseWithCovariance& before) {
  return given_stamp(message.stamp) && message.stamp == before.stamp &&
         message.frame == before.frame && message.pose.xyz == before.pose.xyz &&
         message.pose.quat == before.pose.quat && message.covariance == before.covariance;
}

Result<Measurement> pose_message(const PoseWithCovariance& message, const std::string& child,
                                 const std::string& prefix, const Variances& variances) {
  auto a = id_of(message.frame, prefix);
  if (!a) return tl::unexpected(std::move(a.error()));
  auto b = id_of(child, prefix);
  if (!b) return tl::unexpected(std::move(b.error()));
  const auto pose = pose_of(message.pose);
  if (!pose) return tl::unexpected(pose.error());
  auto X_AB = with_ros_covariance(*pose, variances, message.covariance);
  if (!X_AB) return tl::unexpected(std::move(X_AB.error()));
  return Measurement{*std::move(a), *std::move(b), *std::move(X_AB), given_stamp(message.stamp)};
}

Result<Measurement> measurement_of(const PoseIn& in, const PoseWithCovariance& message,
                                   const std::string& child) {
  return with_weight(pose_message(message, child, in.prefix, in.variances));
}

Result<Measurement> measurement_of(const PoseIn& in, const GeoPose& message) {
  return with_weight(geodetic_message(message, in.frame, in.child, in.prefix, in.variances));
}

}  // namespace tfdude::ros
