#pragma once

#include <string>

#include <Eigen/Core>

#include "tfdude/base/export.hpp"
#include "tfdude/base/result.hpp"
#include "tfdude/math/transform.hpp"

// Places on the Earth, on the ellipsoid of WGS84. A frame whose coordinates are earth-centred and
// earth-fixed (ECEF) is called "earth" in ROS's REP 105.
namespace tfdude {

/// A place by its angles. In degrees, as everybody writes them.
struct Geodetic {
  double latitude = 0;   ///< [deg], north is positive
  double longitude = 0;  ///< [deg], east is positive
  double altitude = 0;   ///< above the ellipsoid [m]; not above the sea
};

/// A place on a map of universal transverse Mercator; near the poles, of universal polar
/// stereographic.
struct Utm {
  int zone = 0;  ///< 1 to 60; 0: polar
  bool north = true;
  double easting = 0;      ///< [m], with false easting
  double northing = 0;     ///< [m], in the south with false northing
  double altitude = 0;     ///< as of Geodetic
  double convergence = 0;  ///< how far the map's north is turned to the east of true north [rad]
  double scale = 1;        ///< the length on the map of a metre
};

/// "32N"; polar: "N" or "S".
[[nodiscard]] TFDUDE_EXPORT std::string zone_text(const Utm& place);

/// @return kInvalidInput naming the field: not a number, a latitude beyond ±90, a longitude beyond
///   ±540, an altitude beyond the bounds of Pose.
[[nodiscard]] TFDUDE_EXPORT Result<void> check_geodetic(const Geodetic& place);

/// X_EN, the pose in the earth frame of the axes east, north and up at a place: what gives a frame
/// a geodetic origin. @return as check_geodetic()
[[nodiscard]] TFDUDE_EXPORT Result<Pose> enu_pose(const Geodetic& place);

/// The place of a point of the earth frame [m].
[[nodiscard]] TFDUDE_EXPORT Geodetic geodetic_of(const Eigen::Vector3d& p_E);

/// @return as check_geodetic()
[[nodiscard]] TFDUDE_EXPORT Result<Utm> utm_of(const Geodetic& place);
/// The place on the map; convergence and scale are not used.
/// @return kInvalidInput naming the field: a zone beyond 0 to 60; a place that is not on the map
[[nodiscard]] TFDUDE_EXPORT Result<Geodetic> geodetic_of(const Utm& place);

/// A frame B, seen where it is.
struct GeodeticPose {
  Geodetic place;  ///< of the origin of B
  Utm utm;         ///< the same
  /// The pose of B in the axes east, north and up at the place: a rotation only. With the
  /// covariance of X_EB, which is that of B's own axes; stddev_in_parent() gives the deviations to
  /// the east, to the north and up.
  Transform X_NB;
};

/// @param X_EB  the pose of B in the earth frame
/// @return kInvalidInput: the origin of B is deeper than 100 km, so the frame is no earth frame.
[[nodiscard]] TFDUDE_EXPORT Result<GeodeticPose> geodetic_pose(const Transform& X_EB);

/// A position that a receiver of satellites has measured: X_EN with the covariance of its
/// coordinates to the east, to the north and up [m²], as of NavSatFix. Nothing is known of the
/// rotation: its variance is the largest that there is.
/// @return kInvalidInput: as check_geodetic(), Covariance::from_matrix()
[[nodiscard]] TFDUDE_EXPORT Result<Transform> position_fix(const Geodetic& place,
                                                           const Eigen::Matrix3d& covariance_enu);

}  // namespace tfdude
