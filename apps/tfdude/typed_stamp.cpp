#include "typed_stamp.hpp"

#include <cctype>
#include <chrono>
#include <cmath>
#include <cstdlib>

#include "tfdude/base/id.hpp"

namespace tfdude::cli {

Time wall_clock() {
  return std::chrono::time_point_cast<Time::duration>(std::chrono::system_clock::now());
}

// The 64 bits of a long double's mantissa are enough for a stamp. A double would round a current
// one to a quarter of a microsecond.
Result<Time> parse_stamp(const std::string& text, Time now) {
  constexpr long double kLast = 9223372036854775807.0L;
  const bool before_now = !text.empty() && text[0] == '-';
  const char* digits = text.c_str() + (before_now ? 1 : 0);
  char* end = nullptr;
  const long double ns = std::strtold(digits, &end) * 1e9L;
  // Without words such as "inf", and hexadecimal numbers.
  const bool decimal = (*digits == '.' || std::isdigit(static_cast<unsigned char>(*digits)) != 0) &&
                       text.find_first_not_of("0123456789.eE+-") == std::string::npos;
  if (decimal && end == text.c_str() + text.size() && ns <= kLast) {
    const std::chrono::nanoseconds typed(std::llround(ns));
    const Time stamp = before_now ? now - typed : Time(typed);
    if (nanoseconds(stamp) >= 0) return stamp;
  }
  if (decimal && end == text.c_str() + text.size() && ns > kLast) {
    return fail(Errc::kInvalidInput, quote(text) + " is no stamp: the last is 9223372036 s");
  }
  return fail(Errc::kInvalidInput, quote(text) +
                                       " is not a stamp: decimal seconds since the epoch or, where "
                                       "negative, before now");
}

}  // namespace tfdude::cli
