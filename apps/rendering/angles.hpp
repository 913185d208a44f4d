#pragma once

#include <string>

#include "tfdude/math/transform_spec.hpp"

#include "format.hpp"

namespace tfdude::cli {

/// The unit of angles, typed and printed: radians, or degrees with --deg.
struct AngleUnit {
  double per_radian = 1;
  const char* name = "rad";
  int decimals = 6;  ///< of printed angles: about a microradian
};
inline constexpr AngleUnit kRadian{};
inline constexpr AngleUnit kDegree{kDegrees, "deg", 4};

/// Three angles [rad] in their unit: "0.1000  0.2000  0.3000  deg".
/// @param suffix  of the unit, such as "/s"
[[nodiscard]] std::string angles_text(double x, double y, double z, const AngleUnit& unit,
                                      const char* suffix = "");

/// An angle [rad] in a picture, with so many significant digits and its unit: "0.57°", "0.01 rad".
/// Below half a thousandth of a degree it is zero.
[[nodiscard]] std::string angle_text(double angle, int digits, const AngleUnit& unit);

/// What was typed in this unit, in radians.
[[nodiscard]] TransformSpec in_radians(TransformSpec spec, const AngleUnit& angles);

}  // namespace tfdude::cli
