#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>

#include "tfdude/base/export.hpp"
#include "tfdude/base/result.hpp"
#include "tfdude/math/transform.hpp"

namespace tfdude {

/// The covariance that people name by a word: "unspecified", or "exact" for zero.
/// @return kInvalidInput: another word.
[[nodiscard]] TFDUDE_EXPORT Result<StatedCovariance> covariance_named(std::string_view word);

/// A transform as people write it, in a configuration file or on the command line. Omitted parts
/// are identity.
struct TFDUDE_EXPORT TransformSpec {
  std::optional<std::array<double, 3>> xyz;   ///< translation [m]
  std::optional<std::array<double, 3>> rpy;   ///< fixed axes X, Y, Z as in URDF [rad]
  std::optional<std::array<double, 4>> quat;  ///< x, y, z, w
  /// The pose instead of the fields above: a homogeneous matrix row by row
  std::optional<std::array<double, 16>> matrix;
  /// Instead of a translation: latitude, longitude [deg] and altitude [m] in a parent whose origin
  /// is the centre of the Earth (earth.hpp). The rotation is that in the axes east, north and up.
  std::optional<std::array<double, 3>> geodetic;
  std::optional<std::array<double, 6>> stddev;  ///< three [m], three [rad]
  std::optional<Covariance::Upper> cov;         ///< upper triangle row by row
  std::optional<std::string> covariance;        ///< instead of both: see covariance_named()

  [[nodiscard]] bool gives_covariance() const { return stddev || cov || covariance; }
  [[nodiscard]] bool gives_translation() const { return xyz || matrix || geodetic; }
  [[nodiscard]] bool gives_rotation() const { return rpy || quat || matrix || geodetic; }
  [[nodiscard]] bool empty() const {
    return !gives_translation() && !gives_rotation() && !gives_covariance();
  }

  /// @param otherwise  the covariance if none is given
  /// @return kInvalidInput naming the field: both rpy and quat, matrix beside one of them or xyz,
  ///   geodetic beside xyz or matrix,
  ///   two of stddev, cov and covariance, or a field that Pose, Covariance or covariance_named()
  ///   rejects.
  [[nodiscard]] Result<Transform> build(const StatedCovariance& otherwise = {}) const;
};

}  // namespace tfdude
