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

Result<Pose> computed_pose(const Eigen::Quaterniond& rotation, const Eigen::Vector3d& translation) {
  // A computed translation may be longer than an accepted one.
  const bool finite = translation.allFinite();
  auto unit = Pose::create(rotation, finite ? Eigen::Vector3d(0, 0, 0) : translation);
  if (unit && finite) *unit = Pose::trusted(unit->rotation(), translation);
  return unit;
}

Result<Transform> computed_from(const Flat& flat) {
  const auto pose = computed_pose(Eigen::Quaterniond(flat[3], flat[0], flat[1], flat[2]),
                                  {flat[4], flat[5], flat[6]});
  if (!pose) return tl::unexpected(pose.error());
  Covariance::Upper upper{};
  std::copy_n(flat.begin() + 7, Covariance::kSize, upper.begin());
  const Transform X{*pose, Covariance::trusted(upper)};
  if (auto finite = check_finite(X); !finite) return tl::unexpected(finite.error());
  return X;
}

}  // namespace tfdude
