#include "angles.hpp"

namespace tfdude::cli {

std::string angles_text(double x, double y, double z, const AngleUnit& unit, const char* suffix) {
  const auto one = [&](double angle) {
    return format("%.*f", unit.decimals, angle * unit.per_radian);
  };
  return one(x) + "  " + one(y) + "  " + one(z) + "  " + unit.name + suffix;
}

std::string angle_text(double angle, int digits, const AngleUnit& unit) {
  constexpr double kZero = 5e-4 / kDegrees;
  const double shown = angle < kZero ? 0 : angle * unit.per_radian;
  const std::string text = shown < 99.5 ? format("%.*g", digits, shown) : format("%.0f", shown);
  return text + (unit.per_radian == 1 ? " rad" : "°");
}

TransformSpec in_radians(TransformSpec spec, const AngleUnit& angles) {
  const double unit = angles.per_radian;
  if (spec.rpy) {
    for (double& angle : *spec.rpy) angle /= unit;
  }
  if (spec.stddev) {
    for (const std::size_t axis : {3U, 4U, 5U}) (*spec.stddev)[axis] /= unit;
  }
  if (!spec.cov) return spec;
  for (std::size_t row = 0; row < 6; ++row) {
    for (std::size_t column = row; column < 6; ++column) {
      if (column >= 3) (*spec.cov)[upper_index(row, column)] /= row >= 3 ? unit * unit : unit;
    }
  }
  return spec;
}

}  // namespace tfdude::cli
