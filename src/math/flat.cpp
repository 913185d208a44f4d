#include "math/flat.hpp"

#include <algorithm>

namespace tfdude {

Flat to_flat(const Transform& X) {
  Flat flat{};
  const Eigen::Quaterniond q = X.pose.rotation();
  const Eigen::Vector3d p = X.pose.translation();
  std::copy_n(q.coeffs().data(), 4, flat.begin());
  std::copy_n(p.data(), 3, flat.begin() + 4);
  std::copy_n(X.covariance.of_specified().upper().begin(), Covariance::kSize, flat.begin() + 7);
  return flat;
}

Result<Transform> computed_from(const Flat& flat) {
  const Eigen::Quaterniond rotation(flat[3], flat[0], flat[1], flat[2]);
  Transform X{Pose::trusted(rotation, {flat[4], flat[5], flat[6]}), {}};
  Covariance::Upper upper{};
  std::copy_n(flat.begin() + 7, Covariance::kSize, upper.begin());
  X.covariance = Covariance::trusted(upper);
  if (auto finite = check_finite(X); !finite) return tl::unexpected(finite.error());
  const auto unit = Pose::create(rotation, Eigen::Vector3d::Zero());
  if (!unit) return tl::unexpected(unit.error());
  X.pose = Pose::trusted(unit->rotation(), X.pose.translation());
  return X;
}

}  // namespace tfdude
