#pragma once

#include <array>
#include <cstdio>
#include <string>
#include <tuple>

namespace tfdude::cli {

inline constexpr double kDegrees = 57.29577951308232;  // degrees per radian

/// The conversions of a pattern of printf(), one after the other: what is printed as zero loses its
/// sign. Otherwise rounding errors would make "-0.000" of some zeros.
class Conversions {
 public:
  explicit Conversions(const char* pattern) : at_(pattern) {}

  [[nodiscard]] double shown(double value);
  [[nodiscard]] int shown(int value);
  template <class T>
  [[nodiscard]] T shown(T value) {
    (void)next_part();
    return value;
  }

 private:
  char next_part();

  const char* at_;
  bool inside_ = false;  // a conversion, one of whose arguments was a '*'
  bool after_point_ = false;
  int precision_ = 0;
};

/// As printf(), cut after 255 bytes. No zero has a sign.
template <class... Values>
[[nodiscard]] std::string format(const char* pattern, Values... values) {
  std::array<char, 256> text{};
  Conversions conversions(pattern);
  // In braces, so that the arguments come in their order.
  const std::tuple<Values...> shown{conversions.shown(values)...};
  std::apply([&](auto... all) { std::snprintf(text.data(), text.size(), pattern, all...); }, shown);
  return text.data();
}

}  // namespace tfdude::cli
