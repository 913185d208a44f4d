#include "stamps.hpp"

#include <algorithm>

#include "../rendering/text.hpp"

namespace tfdude::cli {

Result<std::optional<Time>> optional_stamp(Source source, const std::string& text) {
  if (text.empty()) return std::nullopt;
  const auto now = text[0] == '-' ? source.now() : Result<Time>();
  if (!now) return tl::unexpected(now.error());
  return parse_stamp(text, *now).map([](Time stamp) { return std::optional<Time>(stamp); });
}

Result<Time> beginning(Recording& recording, const std::string& at) {
  const Time start = recording.summary().start.value_or(Time{});
  return optional_stamp(Source(recording), at).map([&](const std::optional<Time>& stamp) {
    return std::max(stamp.value_or(start), start);
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
