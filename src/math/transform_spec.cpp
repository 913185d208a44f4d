#include "tfdude/math/transform_spec.hpp"

#include <cmath>
#include <string>

#include "tfdude/math/earth.hpp"

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

Result<Pose> pose_of(const TransformSpec& spec) {
  if (spec.geodetic) {
    if (spec.xyz || spec.matrix) {
      return fail(Errc::kInvalidInput, "geodetic is given beside xyz or matrix, one is enough");
    }
    const auto& [latitude, longitude, altitude] = *spec.geodetic;
    const auto X_EN = enu_pose({latitude, longitude, altitude});
    if (!X_EN) return fail_at("geodetic", X_EN.error());
    const auto R_NB = rotation_of(spec).and_then(
        [](const Eigen::Quaterniond& q) { return Pose::create(q, Eigen::Vector3d::Zero()); });
    return R_NB ? Result<Pose>(*X_EN * *R_NB) : R_NB;
  }
  if (spec.matrix) {
    if (spec.xyz || spec.rpy || spec.quat) {
      return fail(Errc::kInvalidInput, "matrix is given beside xyz, rpy or quat, one is enough");
    }
    return Pose::from_matrix(
        Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>>(spec.matrix->data()));
  }
  const auto rotation = rotation_of(spec);
  if (!rotation) return tl::unexpected(rotation.error());
  const auto t = spec.xyz.value_or(std::array<double, 3>{});
  return Pose::create(*rotation, {t[0], t[1], t[2]});
}

Result<StatedCovariance> covariance_of(const TransformSpec& spec,
                                       const StatedCovariance& otherwise) {
  const auto both = [](const char* fields) {
    return fail(Errc::kInvalidInput, std::string(fields) + " are both given, one is enough");
  };
  if (spec.stddev && spec.cov) return both("stddev and cov");
  if (spec.stddev && spec.covariance) return both("stddev and covariance");
  if (spec.cov && spec.covariance) return both("cov and covariance");
  const auto stated = [](const Covariance& sigma) { return StatedCovariance(sigma); };
  if (spec.stddev) return Covariance::from_stddev(*spec.stddev).map(stated);
  if (spec.cov) return Covariance::from_upper(*spec.cov).map(stated);
  return spec.covariance ? covariance_named(*spec.covariance) : otherwise;
}

}  // namespace

Result<StatedCovariance> covariance_named(std::string_view word) {
  if (word == "unspecified") return StatedCovariance::unspecified();
  if (word == "exact") return StatedCovariance::exact();
  return fail(Errc::kInvalidInput, "covariance must be unspecified or exact");
}

Result<Transform> TransformSpec::build(const StatedCovariance& otherwise) const {
  const auto pose = pose_of(*this);
  if (!pose) return tl::unexpected(pose.error());
  const auto stated = covariance_of(*this, otherwise);
  if (!stated) return tl::unexpected(stated.error());
  return Transform{*pose, *stated};
}

}  // namespace tfdude
