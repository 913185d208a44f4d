#include "tfdude/math/transform_spec.hpp"

#include <cmath>
#include <string>

namespace tfdude {
namespace {

Result<Eigen::Quaterniond> rotation_of(const TransformSpec& spec) {
  if (spec.rpy && spec.quat) {
    return fail(Errc::kInvalidInput, "rpy and quat are both given, one is enough");
  }
  if (spec.quat) {
    const auto& q = *spec.quat;
    return Eigen::Quaterniond(q[3], q[0], q[1], q[2]);
  }
  if (!spec.rpy) return Eigen::Quaterniond::Identity();
  for (std::size_t i = 0; i < 3; ++i) {
    if (!std::isfinite((*spec.rpy)[i])) {
      return fail(Errc::kInvalidInput, "rpy[" + std::to_string(i) + "] is not a finite number");
    }
  }
  return from_rpy((*spec.rpy)[0], (*spec.rpy)[1], (*spec.rpy)[2]);
}

Result<Covariance> covariance_of(const TransformSpec& spec) {
  if (spec.stddev && spec.cov) {
    return fail(Errc::kInvalidInput, "stddev and cov are both given, one is enough");
  }
  if (spec.stddev) return Covariance::from_stddev(*spec.stddev);
  if (spec.cov) return Covariance::from_upper(*spec.cov);
  return Covariance();
}

}  // namespace

Result<Transform> TransformSpec::build() const {
  const auto rotation = rotation_of(*this);
  if (!rotation) return tl::unexpected(rotation.error());
  const auto t = xyz.value_or(std::array<double, 3>{});
  const auto pose = Pose::create(*rotation, {t[0], t[1], t[2]});
  if (!pose) return tl::unexpected(pose.error());
  const auto covariance = covariance_of(*this);
  if (!covariance) return tl::unexpected(covariance.error());
  return Transform{*pose, *covariance};
}

}  // namespace tfdude
