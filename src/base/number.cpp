#include "tfdude/base/number.hpp"

#include <algorithm>
#include <array>
#include <charconv>

namespace tfdude {
namespace {

// More are never needed.
constexpr int kMostDigits = 40;

std::string written(double value, std::chars_format format, int digits) {
  std::array<char, 400> text{};  // the largest double has 309 digits before the point
  const auto end = std::to_chars(text.data(), text.data() + text.size(), value, format,
                                 std::clamp(digits, 0, kMostDigits));
  return {text.data(), end.ptr};
}

}  // namespace

std::string number_text(double value, int digits) {
  return written(value, std::chars_format::general, digits);
}

std::string fixed_text(double value, int decimals) {
  return written(value, std::chars_format::fixed, decimals);
}

}  // namespace tfdude
