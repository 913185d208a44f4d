#include "tfdude/base/time.hpp"

#include <array>
#include <cmath>
#include <cstdio>
#include <ctime>

#include "tfdude/base/number.hpp"

namespace tfdude {

const char* to_string(ClockKind kind) {
  return kind == ClockKind::kExternal ? "external" : "system";
}

std::string in_milliseconds(std::chrono::nanoseconds duration) {
  const double ms = static_cast<double>(duration.count()) * 1e-6;
  return fixed_text(ms, std::abs(ms) < 0.1 ? 6 : 3) + " ms";
}

std::string to_string(Time time) {
  const auto milliseconds = std::chrono::floor<Milliseconds>(time.time_since_epoch());
  const auto seconds = std::chrono::floor<std::chrono::seconds>(milliseconds);
  const auto since_epoch = static_cast<std::time_t>(seconds.count());
  std::tm parts{};
  gmtime_r(&since_epoch, &parts);
  std::array<char, 64> date{};
  const std::size_t length = std::strftime(date.data(), date.size(), "%Y-%m-%d %H:%M:%S", &parts);
  std::array<char, 16> fraction{};
  std::snprintf(fraction.data(), fraction.size(), ".%03d UTC",
                static_cast<int>((milliseconds - seconds).count()));
  return std::string(date.data(), length) + fraction.data();
}

std::string readable(std::chrono::nanoseconds duration) {
  const double seconds = std::chrono::duration<double>(duration).count();
  const double size = std::abs(seconds);
  if (size < 1) return in_milliseconds(duration);
  if (size < 10) return fixed_text(seconds, 3) + " s";
  if (size < 120) return fixed_text(seconds, 1) + " s";
  if (size < 7200) return fixed_text(seconds / 60, 1) + " min";
  if (size < 172'800) return fixed_text(seconds / 3600, 1) + " h";
  return fixed_text(seconds / 86'400, 1) + " days";
}

std::string readable(Time stamp) {
  constexpr std::int64_t kYear2000 = 946'684'800'000'000'000;
  if (nanoseconds(stamp) >= kYear2000) return to_string(stamp);
  return fixed_text(static_cast<double>(nanoseconds(stamp)) * 1e-9, 3) + " s";
}

}  // namespace tfdude
