#include "stamps.hpp"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdlib>

#include "tfdude/base/id.hpp"

#include "../rendering/text.hpp"

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
  return fail(Errc::kInvalidInput, quote(text) +
                                       " is not a stamp: decimal seconds since the epoch or, where "
                                       "negative, before now");
}

Result<std::optional<Time>> optional_stamp(Source source, const std::string& text) {
  if (text.empty()) return std::nullopt;
  const auto now = text[0] == '-' ? source.now() : Result<Time>();
  if (!now) return tl::unexpected(now.error());
  return parse_stamp(text, *now).map([](Time stamp) { return std::optional<Time>(stamp); });
}

Result<Time> beginning(Recording& recording, const std::string& at) {
  const Time start = recording.summary().start.value_or(Time{});
  return optional_stamp(Source(recording), at).map([&](const std::optional<Time>& stamp) {
    return stamp.value_or(start);
  });
}

std::optional<Time> present(Source source, const Common& common, const std::string& a,
                            const std::string& b) {
  const auto path = source.path(a, b);
  const bool same = path && std::all_of(path->begin(), path->end(), [&](const PathSegment& one) {
                      return !one.clock || *one.clock == common.options.clock;
                    });
  const auto now = same ? source.present() : fail(Errc::kInvalidInput, "the clocks differ");
  return now ? std::optional<Time>(*now) : std::nullopt;
}

std::optional<Time> present(Source source, const Common& common, const PartitionInfo& partition) {
  if (partition.clock && *partition.clock != common.options.clock) return std::nullopt;
  const auto now = source.present();
  return now ? std::optional<Time>(*now) : std::nullopt;
}

std::string stamp_line(Source source, const Common& common, const std::string& a,
                       const std::string& b, const std::optional<Time>& stamp) {
  if (!stamp || common.json) return "";
  if (!source.live()) return describe_recorded_stamp(*stamp, source.end_for(*stamp));
  return describe_stamp(*stamp, present(source, common, a, b));
}

}  // namespace tfdude::cli
