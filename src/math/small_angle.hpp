#pragma once

#include <array>

namespace tfdude {

/// Jr(s ξ) Jr⁻¹(ξ) = 1 + Σ_k c_k ad(ξ)^k, k = 1 to 4, for angles up to 0.1 rad and s from 0 to 1:
/// accurate to 1e-9. interpolate.cpp covers the other cases.
[[nodiscard]] inline std::array<double, 4> small_angle_coefficients(double s) {
  const double rest = 1.0 - s;
  return {0.5 * rest, rest * (1.0 - 2.0 * s) / 12.0, -s * rest * rest / 24.0,
          -1.0 / 720.0 + s * s * (1.0 / 72.0 - s / 48.0 + s * s / 120.0)};
}

}  // namespace tfdude
