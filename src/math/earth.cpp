#include "tfdude/math/earth.hpp"

#include <cmath>
#include <exception>
#include <string>
#include <vector>

#include <GeographicLib/Geocentric.hpp>
#include <GeographicLib/UTMUPS.hpp>

#include "tfdude/base/number.hpp"

namespace tfdude {
namespace {

using GeographicLib::Geocentric;
using GeographicLib::UTMUPS;

constexpr double kRadiansPerDegree = 0.017453292519943295;

// Of the axes east, north and up, in the earth frame.
Eigen::Matrix3d axes_at(const Geodetic& place, Eigen::Vector3d& p_E) {
  std::vector<double> M(9);  // row by row
  Geocentric::WGS84().Forward(place.latitude, place.longitude, place.altitude, p_E.x(), p_E.y(),
                              p_E.z(), M);
  return Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(M.data());
}

}  // namespace

Result<void> check_geodetic(const Geodetic& place) {
  const auto check = [](const char* field, double value, double most, const char* range) {
    if (std::abs(value) <= most) return Result<void>();  // false for NaN
    return Result<void>(fail(Errc::kInvalidInput, std::string(field) + " is " + number_text(value) +
                                                      ", not within " + range));
  };
  constexpr double kMostAltitude = kMaxTranslation - 1e7;
  return check("latitude", place.latitude, 90, "-90 and 90 degrees")
      .and_then([&] { return check("longitude", place.longitude, 540, "-540 and 540 degrees"); })
      .and_then([&] { return check("altitude", place.altitude, kMostAltitude, "9.9e8 m"); });
}

Result<Pose> enu_pose(const Geodetic& place) {
  if (auto ok = check_geodetic(place); !ok) return tl::unexpected(std::move(ok.error()));
  Eigen::Vector3d p_E;
  const Eigen::Matrix3d axes = axes_at(place, p_E);
  return Pose::create(Eigen::Quaterniond(axes).normalized(), p_E);
}

Geodetic geodetic_of(const Eigen::Vector3d& p_E) {
  Geodetic place;
  Geocentric::WGS84().Reverse(p_E.x(), p_E.y(), p_E.z(), place.latitude, place.longitude,
                              place.altitude);
  return place;
}

Result<Utm> utm_of(const Geodetic& place) {
  if (auto ok = check_geodetic(place); !ok) return tl::unexpected(std::move(ok.error()));
  try {
    Utm utm;
    double convergence = 0;
    UTMUPS::Forward(place.latitude, place.longitude, utm.zone, utm.north, utm.easting, utm.northing,
                    convergence, utm.scale);
    utm.convergence = convergence * kRadiansPerDegree;
    utm.altitude = place.altitude;
    return utm;
  } catch (const std::exception& e) {
    return fail(Errc::kInvalidInput, e.what());
  }
}

Result<Geodetic> geodetic_of(const Utm& place) {
  if (place.zone < UTMUPS::MINZONE || place.zone < 0 || place.zone > UTMUPS::MAXZONE) {
    return fail(Errc::kInvalidInput,
                "zone is " + std::to_string(place.zone) + ", not within 0 and 60");
  }
  if (!std::isfinite(place.easting) || !std::isfinite(place.northing)) {
    return fail(Errc::kInvalidInput, "easting or northing is not a finite number");
  }
  try {
    Geodetic geodetic;
    UTMUPS::Reverse(place.zone, place.north, place.easting, place.northing, geodetic.latitude,
                    geodetic.longitude);
    geodetic.altitude = place.altitude;
    auto ok = check_geodetic(geodetic);
    return ok ? Result<Geodetic>(geodetic) : tl::unexpected(std::move(ok.error()));
  } catch (const std::exception& e) {
    return fail(Errc::kInvalidInput, e.what());
  }
}

Result<GeodeticPose> geodetic_pose(const Transform& X_EB) {
  GeodeticPose seen;
  seen.place = geodetic_of(X_EB.pose.translation());
  constexpr double kDeepest = -1e5;
  if (!(seen.place.altitude >= kDeepest)) {
    return fail(Errc::kInvalidInput,
                "not in an earth frame: the position is " +
                    number_text(X_EB.pose.translation().norm()) +
                    " m from the origin, which would be the centre of the Earth");
  }
  auto utm = utm_of(seen.place);
  if (!utm) return tl::unexpected(std::move(utm.error()));
  seen.utm = *utm;
  Eigen::Vector3d p_E;
  const Eigen::Quaterniond R_EN = Eigen::Quaterniond(axes_at(seen.place, p_E)).normalized();
  seen.X_NB = {Pose::trusted(R_EN.conjugate() * X_EB.pose.rotation(), Eigen::Vector3d::Zero()),
               X_EB.covariance};
  return seen;
}

Result<Transform> position_fix(const Geodetic& place, const Eigen::Matrix3d& covariance_enu) {
  const auto X_EN = enu_pose(place);
  if (!X_EN) return tl::unexpected(X_EN.error());
  Matrix6d sigma = Matrix6d::Zero();
  sigma.topLeftCorner<3, 3>() = covariance_enu;
  sigma.bottomRightCorner<3, 3>().diagonal().setConstant(kMaxVariance);
  const auto checked = Covariance::from_matrix(sigma);
  if (!checked) return tl::unexpected(checked.error());
  return Transform{*X_EN, *checked};
}

}  // namespace tfdude
