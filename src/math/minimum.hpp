#pragma once

#include <cmath>

#include "tfdude/math/pose.hpp"

namespace tfdude {

/// One over the mean variance of each unit's axes, zero if that is zero. Scaled by it, metres and
/// radians can be added.
[[nodiscard]] inline Twist units_of(const Twist& variances) {
  Twist units = Twist::Zero();
  if (variances.head<3>().sum() > 0) units.head<3>().setConstant(3.0 / variances.head<3>().sum());
  if (variances.tail<3>().sum() > 0) units.tail<3>().setConstant(3.0 / variances.tail<3>().sum());
  return units;
}

/// The argument within (0, 1) at which a unimodal function has its minimum, to a hundredth, by
/// golden section.
template <class Function>
[[nodiscard]] double minimum_within_unit(Function f) {
  constexpr double kGolden = 0.6180339887498949;
  constexpr double kEnough = 0.01;
  double low = 1e-3;
  double high = 1.0 - 1e-3;
  double a = high - kGolden * (high - low);
  double b = low + kGolden * (high - low);
  double f_a = f(a);
  double f_b = f(b);
  while (high - low > kEnough) {
    if (f_a < f_b) {
      high = b;
      b = a;
      f_b = f_a;
      a = high - kGolden * (high - low);
      f_a = f(a);
    } else {
      low = a;
      a = b;
      f_a = f_b;
      b = low + kGolden * (high - low);
      f_b = f(b);
    }
  }
  return 0.5 * (low + high);
}

}  // namespace tfdude
