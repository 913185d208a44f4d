#pragma once

#include <array>

#include "tfdude/base/result.hpp"
#include "tfdude/math/transform.hpp"

namespace tfdude {

/// A transform as it is sent and stored: x, y, z, w of the unit quaternion; x, y, z [m]; upper triangle of the
/// covariance row by row.
using Flat = std::array<double, 28>;

[[nodiscard]] Flat to_flat(const Transform& X);

/// A transform that was valid or computed from such when it was made flat: of any size, and semi-definite to its
/// rounding, so that it is not for the rules of what users give.
/// @return kInvalidInput: not finite, or no rotation.
[[nodiscard]] Result<Transform> computed_from(const Flat& flat);

}  // namespace tfdude
