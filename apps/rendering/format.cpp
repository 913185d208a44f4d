#include "format.hpp"

#include <cmath>
#include <cstdlib>
#include <cstring>

namespace tfdude::cli {

// Goes on to the next '*', or to the letter that ends a conversion: each takes one argument.
char Conversions::next_part() {
  if (!inside_) {
    at_ = std::strchr(at_, '%');
    while (at_ != nullptr && at_[1] == '%') at_ = std::strchr(at_ + 2, '%');
    if (at_ == nullptr) at_ = "";
    inside_ = true;
    after_point_ = false;
    precision_ = 6;  // that of printf()
  }
  for (; *at_ != '\0'; ++at_) {
    if (*at_ == '*') return *at_++;
    if (*at_ == '.') {
      after_point_ = true;
      precision_ = static_cast<int>(std::strtol(at_ + 1, nullptr, 10));
    }
    if (std::strchr("diouxXeEfFgGaAcsp", *at_) != nullptr) break;
  }
  inside_ = false;
  return *at_;
}

int Conversions::shown(int value) {
  if (next_part() == '*' && after_point_) precision_ = value;
  return value;
}

double Conversions::shown(double value) {
  const char letter = next_part();
  if (!std::signbit(value)) return value;
  std::array<char, 32> digits{};
  if (letter == 'f') std::snprintf(digits.data(), digits.size(), "%.*f", precision_, -value);
  const bool rounded = letter == 'f' && std::strpbrk(digits.data(), "123456789in") == nullptr;
  return value == 0 || rounded ? 0.0 : value;
}

}  // namespace tfdude::cli
