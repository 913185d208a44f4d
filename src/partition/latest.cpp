#include "partition/latest.hpp"

#include <algorithm>
#include <functional>
#include <utility>

#include "base/saturating.hpp"

namespace tfdude {
namespace {

// The answer of the owner whose newest instant is the oldest; null if all is static.
const SegmentValues* slowest(const std::vector<SegmentValues>& answers) {
  const SegmentValues* found = nullptr;
  for (const SegmentValues& answer : answers) {
    if (!answer.stamp) continue;
    if (found == nullptr || *answer.stamp < *found->stamp) found = &answer;
  }
  return found;
}

bool all_of(const std::vector<SegmentValues>& answers, Time instant) {
  return std::all_of(answers.begin(), answers.end(), [&](const SegmentValues& answer) {
    return !answer.stamp || *answer.stamp == instant;
  });
}

// Whether each answer has values at the hint; if so, these become the answers.
bool take_hint(std::vector<SegmentValues>& answers, Time hint) {
  const bool all = std::all_of(answers.begin(), answers.end(), [&](const SegmentValues& answer) {
    return !answer.stamp || *answer.stamp == hint || !answer.at_hint.values.empty();
  });
  if (!all) return false;
  for (SegmentValues& answer : answers) {
    if (!answer.stamp || *answer.stamp == hint) continue;
    static_cast<ValuesAtInstant&>(answer) = std::move(answer.at_hint);
    answer.stamp = hint;
  }
  return true;
}

std::size_t hash_of(std::string_view a, std::string_view b) {
  const std::hash<std::string_view> hash;
  constexpr std::size_t kOdd = 0x9E3779B97F4A7C15U;
  return (hash(a) * kOdd) ^ hash(b);
}

}  // namespace

OneInstant one_instant(std::vector<SegmentValues> answers, std::optional<Time> hint) {
  const SegmentValues* last = slowest(answers);
  if (last == nullptr || all_of(answers, *last->stamp)) return {std::move(answers), std::nullopt};
  const Time newest = *last->stamp;
  std::chrono::nanoseconds longest{0};
  for (const SegmentValues& answer : answers) longest = std::max(longest, answer.period);
  const bool near = hint && *hint <= newest &&
                    *hint >= earlier_by(newest, 2 * std::min<std::chrono::nanoseconds>(
                                                        longest, kOldestGuess / 2));
  if (near && take_hint(answers, *hint)) return {std::move(answers), std::nullopt};
  return {{}, newest};
}

std::optional<Time> LatestHints::guess(std::string_view a, std::string_view b, Steady now) const {
  const std::size_t path = hash_of(a, b);
  const Entry& entry = entries_[path % kEntries];
  if (entry.path != path || !entry.certain) return std::nullopt;
  return std::max(later_by(*entry.certain, now - entry.seen), entry.latest);
}

void LatestHints::note(std::string_view a, std::string_view b, Steady planned, Steady now,
                       const std::vector<SegmentValues>& answers) {
  const SegmentValues* last = slowest(answers);
  const std::size_t path = hash_of(a, b);
  Entry& entry = entries_[path % kEntries];
  if (last == nullptr) return;
  const bool known = entry.path == path;
  const bool same = all_of(answers, *last->stamp);
  const int together = same ? (known ? entry.together + 1 : kStreak) : 0;
  const bool overlaps = known && planned < entry.seen;
  const Time latest = overlaps ? std::max(entry.latest, *last->stamp) : *last->stamp;
  entry = {path, last->stamp, latest, now, std::min(together, kStreak)};
  if (together >= kStreak) {
    entry.certain.reset();
    return;
  }
  for (const SegmentValues& answer : answers) {
    if (answer.stamp)
      entry.certain = std::min(*entry.certain, earlier_by(*answer.stamp, answer.period));
  }
}

}  // namespace tfdude
