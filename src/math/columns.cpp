#include "math/columns.hpp"

namespace tfdude::kernel {

Columns columns_of(const Pose& X) {
  const Eigen::Matrix3d R = X.rotation().toRotationMatrix();
  const Eigen::Vector3d t = X.translation();
  Columns columns;
  for (Eigen::Index k = 0; k < 3; ++k) {
    for (Eigen::Index i = 0; i < 3; ++i) columns.R[k][i] = R(i, k);
    columns.t[k] = t[k];
  }
  return columns;
}

Pose pose_of(const Columns& X) {
  Eigen::Matrix3d R;
  for (Eigen::Index k = 0; k < 3; ++k) {
    for (Eigen::Index i = 0; i < 3; ++i) R(i, k) = X.R[k][i];
  }
  return Pose::trusted(Eigen::Quaterniond(R).normalized(), {X.t[0], X.t[1], X.t[2]});
}

Covariance::Upper upper_of(const Blocks& sigma) {
  const auto& P = sigma.P;
  const auto& C = sigma.C;
  const auto& Q = sigma.Q;
  return {P[0][0], P[1][0], P[2][0], C[0][0], C[1][0], C[2][0], P[1][1],
          P[2][1], C[0][1], C[1][1], C[2][1], P[2][2], C[0][2], C[1][2],
          C[2][2], Q[0][0], Q[1][0], Q[2][0], Q[1][1], Q[2][1], Q[2][2]};
}

}  // namespace tfdude::kernel
