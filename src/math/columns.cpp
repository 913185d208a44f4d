#include "math/columns.hpp"

#include <algorithm>
#include <cstddef>

#include "math/common_errors.hpp"

namespace tfdude::kernel {

// The layout of the kernel's numbers: quaternion, translation, upper triangle.
static_assert(std::is_standard_layout_v<Pose> && sizeof(Pose) == 7 * sizeof(double));
static_assert(std::is_standard_layout_v<Transform> && sizeof(Transform) == 29 * sizeof(double));
static_assert(offsetof(Transform, covariance) == 7 * sizeof(double));
static_assert(std::is_standard_layout_v<StatedCovariance> &&
              sizeof(StatedCovariance) == 22 * sizeof(double));

Columns columns_of(const Pose& X) {
  const Eigen::Matrix3d R = X.rotation().toRotationMatrix();
  const Eigen::Vector3d t = X.translation();
  Columns columns{};
  for (Eigen::Index k = 0; k < 3; ++k) {
    for (Eigen::Index i = 0; i < 3; ++i) columns.R[k][i] = R(i, k);
    columns.t[k] = t[k];
  }
  return columns;
}

Pose pose_of(const Edge& edge) {
  Pose X;
  std::copy_n(edge.pose, 7, numbers_of(X));
  return X;
}

Covariance transported(const Columns& X, const Covariance& sigma) {
  Covariance::Upper upper;
  functions().transport(X, sigma.upper().data(), upper.data());
  return Covariance::trusted(upper);
}

void add_transported(const Columns& X, const Loading& F, Loading& sum) {
  widen(sum, F.cols());
  functions().add_columns(X, F.data(), static_cast<std::size_t>(F.cols()), sum.data());
}

Transform transform_of(const Edge& edge) {
  Covariance::Upper upper{};
  std::copy_n(edge.upper, upper.size(), upper.begin());
  return {pose_of(edge), Covariance::trusted(upper)};
}

}  // namespace tfdude::kernel
