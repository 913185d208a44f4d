#include "tfdude/math/joint.hpp"

namespace tfdude {
namespace {

Joint along(const Transform& X_PJ, const Eigen::Vector3d& shift, const Eigen::Vector3d& turn) {
  Joint joint{X_PJ, {}};
  joint.S << shift, turn;
  return joint;
}

}  // namespace

Joint revolute_joint(const Transform& X_PJ, const Eigen::Vector3d& axis) {
  return along(X_PJ, Eigen::Vector3d::Zero(), axis);
}

Joint prismatic_joint(const Transform& X_PJ, const Eigen::Vector3d& axis) {
  return along(X_PJ, axis, Eigen::Vector3d::Zero());
}

Transform joint_transform(const Joint& joint, double position, double variance) {
  const Pose X_JC = exp(joint.S * position);
  Covariance::Upper upper{};
  for (std::size_t row = 0; row < 6; ++row) {
    for (std::size_t column = row; column < 6; ++column) {
      const auto i = static_cast<Eigen::Index>(row);
      const auto k = static_cast<Eigen::Index>(column);
      upper[upper_index(row, column)] = variance * joint.S[i] * joint.S[k];
    }
  }
  Transform X_PC{joint.X_PJ.pose * X_JC, Covariance::trusted(upper)};
  // Most origins are exact, since URDF gives no uncertainty.
  if (!joint.X_PJ.covariance.complete()) {
    X_PC.covariance = StatedCovariance::unspecified();
  } else if (joint.X_PJ.covariance != StatedCovariance()) {
    X_PC.covariance += joint.X_PJ.covariance.transported(X_JC.inverse());
  }
  return X_PC;
}

}  // namespace tfdude
