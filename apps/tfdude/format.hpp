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

}  // namespace tfdude::cli
