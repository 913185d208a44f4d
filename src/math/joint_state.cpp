#include "math/joint_state.hpp"

#include <cmath>

namespace tfdude {
namespace {

// The next better approximation of a rotation that is one up to rounding.
Eigen::Quaterniond normalized(const Eigen::Quaterniond& q) {
  return Eigen::Quaterniond((1.5 - 0.5 * q.squaredNorm()) * q.coeffs());
}

}  // namespace

PreparedJoint::PreparedJoint(const Joint& joint, double period)
    : joint_(joint),
      period_(period),
      exact_origin_(joint.X_PJ.covariance == StatedCovariance::exact() ? 1 : 0),
      unit_(joint_transform({Transform::exact({}), joint.S}, 0, 1)
                .covariance.of_specified()
                .upper()) {
  constexpr double kUnit = 1e-12;
  if (joint.S.tail<3>().isZero(0)) {
    kind_ = Kind::kSlides;
  } else if (joint.S.head<3>().isZero(0) && std::abs(joint.S.norm() - 1.0) < kUnit) {
    kind_ = Kind::kTurns;
  }
}

Pose PreparedJoint::pose(double position) const {
  const Pose& X_PJ = joint_.X_PJ.pose;
  switch (kind_) {
    case Kind::kTurns: {
      // The axis is of unit length.
      const double half = 0.5 * position;
      const Eigen::Vector3d vector = std::sin(half) * joint_.S.tail<3>();
      const Eigen::Quaterniond q(std::cos(half), vector.x(), vector.y(), vector.z());
      return Pose::trusted(normalized(X_PJ.rotation() * q), X_PJ.translation());
    }
    case Kind::kSlides:
      return Pose::trusted(X_PJ.rotation(), X_PJ * Eigen::Vector3d(position * joint_.S.head<3>()));
    case Kind::kScrews:
      break;
  }
  return X_PJ * exp(joint_.S * position);
}

void PreparedJoint::compute(const JointPosition& at, Transform& X) const {
  if (exact_origin_ == 0 || std::isnan(at.variance)) {
    X = joint_transform(joint_, at.position, at.stated());
    return;
  }
  X.pose = pose(at.position);
  // In place, since copies take as long as the rest.
  // NOLINTNEXTLINE(cppcoreguidelines-pro-type-reinterpret-cast): see path_accumulation.cpp
  auto* upper = reinterpret_cast<double*>(&X.covariance);
  for (std::size_t i = 0; i < unit_.size(); ++i) upper[i] = at.variance * unit_[i];
  X.covariance.set_complete(true);
}

}  // namespace tfdude
