#include "tree/sample_rules.hpp"

#include <chrono>

#include "tfdude/base/id.hpp"
#include "tfdude/base/time.hpp"

#include "base/compared.hpp"
#include "tree/revised_sample.hpp"
#include "tree/sample_history.hpp"

namespace tfdude {
namespace {

// Both are stamps, and so not negative.
std::chrono::nanoseconds apart(std::int64_t earlier, std::int64_t later) {
  return std::chrono::nanoseconds(later - earlier);
}

// Whether a sample continues the row of samples older than the kept history. Samples are checked
// before they are applied, together with others that may be rejected. So a sample with the same
// stamp belongs to the same row.
bool goes_on(const Refused::Behind& row, std::int64_t newest, std::int64_t stamp) {
  return row.count > 0 && row.newest == newest && row.last <= stamp;
}

// Whether the history restarts with this sample, which is older than the span; counts it.
bool starts_again(const HeldVersion& newest, std::int64_t stamp) {
  const std::size_t needed = newest.samples->timing().restart_after;
  Refused::Behind& row = newest.name->refused.more().behind;
  if (!goes_on(row, newest.stamp, stamp)) {
    row = {1, newest.stamp, stamp};
  } else if (stamp > row.last) {
    row = {row.count + 1, newest.stamp, stamp};
  }
  return needed > 0 && row.count >= needed;
}

}  // namespace

bool history_restarts(const HeldVersion& newest, std::int64_t stamp) {
  if (!newest.limits() || newest.left_behind()) return false;
  return stamp < newest.stamp - newest.samples->timing().span.count() &&
         starts_again(newest, stamp);
}

Result<void> check_late_sample(const HeldVersion& newest, std::int64_t stamp) {
  if (newest.left_behind()) return {};  // it begins another history
  const SampleHistory& samples = *newest.samples;
  const std::uint64_t place = samples.place_of(stamp);
  if (place < samples.next() && samples.stamp(place) == stamp) {
    // An edge that drifts takes it for the way since the sample before (push_of_drift()).
    if (samples.timing().drifts && is_between(*samples.sample(place))) return {};
    newest.name->refused.more().equal.fetch_add(1, std::memory_order_relaxed);
    return fail(Errc::kStampTaken, "frame " + quote(newest.name->text) +
                                       " has a sample of that stamp, " + to_string(time_of(stamp)));
  }
  const bool full = samples.count() >= samples.timing().count;
  const std::int64_t limit = newest.stamp - samples.timing().span.count();
  if (stamp >= limit && (!full || place > samples.oldest())) return {};
  if (stamp < limit && starts_again(newest, stamp)) return {};
  newest.name->refused.more().old.fetch_add(1, std::memory_order_relaxed);
  const std::string what = "frame " + quote(newest.name->text) + ": the sample is ";
  if (stamp < limit) {
    const auto [by, most] = compared(apart(stamp, newest.stamp), samples.timing().span);
    return fail(Errc::kTooOld,
                what + by + " older than the newest, more than the " + most + " that are kept");
  }
  return fail(Errc::kTooOld, what + readable(apart(stamp, samples.stamp(samples.oldest()))) +
                                 " older than the oldest of the " +
                                 std::to_string(samples.timing().count) + " that are kept");
}

}  // namespace tfdude
