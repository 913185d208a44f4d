#pragma once

#include <array>
#include <optional>

#include "tfdude/base/export.hpp"
#include "tfdude/base/result.hpp"
#include "tfdude/math/transform.hpp"

namespace tfdude {

/// A transform as people write it, in a configuration file or on the command line. Omitted parts
/// are identity or zero.
struct TFDUDE_EXPORT TransformSpec {
  std::optional<std::array<double, 3>> xyz;     ///< translation [m]
  std::optional<std::array<double, 3>> rpy;     ///< fixed axes X, Y, Z as in URDF [rad]
  std::optional<std::array<double, 4>> quat;    ///< x, y, z, w
  std::optional<std::array<double, 6>> stddev;  ///< three [m], three [rad]
  std::optional<Covariance::Upper> cov;         ///< upper triangle row by row

  [[nodiscard]] bool empty() const { return !xyz && !rpy && !quat && !stddev && !cov; }

  /// @return kInvalidInput naming the field: both rpy and quat, both stddev and cov, or a field
  ///   that Pose::create() or Covariance rejects.
  [[nodiscard]] Result<Transform> build() const;
};

}  // namespace tfdude
