#pragma once

#include <array>
#include <cstdio>
#include <string>

namespace tfdude::cli {

inline constexpr double kDegrees = 57.29577951308232;  // degrees per radian

/// As printf(), cut after 255 bytes.
template <class... Values>
[[nodiscard]] std::string format(const char* pattern, Values... values) {
  std::array<char, 256> text{};
  std::snprintf(text.data(), text.size(), pattern, values...);
  return text.data();
}

/// An angle [°] in a picture, with so many significant digits; from 99.5 on, a whole number. Below
/// half a thousandth it is zero.
[[nodiscard]] inline std::string angle_text(double degrees, int digits) {
  if (degrees < 5e-4) return "0";
  return degrees < 99.5 ? format("%.*g", digits, degrees) : format("%.0f", degrees);
}

}  // namespace tfdude::cli
