#include <algorithm>
#include <deque>
#include <limits>

#include "tfdude/base/id.hpp"

#include "base/compared.hpp"
#include "base/saturating.hpp"
#include "base/stamp.hpp"
#include "math/finite.hpp"
#include "tree/forest_impl.hpp"

// Replaces samples of the past.
namespace tfdude {
namespace {

constexpr std::int64_t kEnd = std::numeric_limits<std::int64_t>::max();

std::string sample_of(std::string_view id, std::size_t i) {
  return "frame " + quote(id) + ": sample " + std::to_string(i);
}

Result<void> check_interval(std::string_view id, const TimeInterval& interval) {
  if (interval.from <= interval.to) return {};
  return fail(Errc::kInvalidInput, "frame " + quote(id) + ": the interval ends, at " +
                                       readable(interval.to) + ", before it begins, at " +
                                       readable(interval.from));
}

Result<void> check_samples(std::string_view id, const TimeInterval& interval,
                           const std::vector<EdgeSample>& samples) {
  if (samples.empty()) {
    return fail(Errc::kInvalidInput, "frame " + quote(id) + ": there are no samples to write");
  }
  if (auto ok = check_stamp(interval.from); !ok) {
    return fail_at("frame " + quote(id) + ": the interval", ok.error());
  }
  const auto invalid = [&](std::size_t i, const std::string& why) {
    return fail(Errc::kInvalidInput,
                sample_of(id, i) + ", of " + readable(samples[i].stamp) + ", " + why);
  };
  // First the order: an interval from the first to the last of them may have none.
  for (std::size_t i = 1; i < samples.size(); ++i) {
    if (samples[i].stamp > samples[i - 1].stamp) continue;
    return invalid(i, "is not later than the one before");
  }
  if (auto ok = check_interval(id, interval); !ok) return ok;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const EdgeSample& sample = samples[i];
    if (sample.stamp < interval.from || sample.stamp > interval.to) {
      return invalid(i, "is outside of the interval from " + readable(interval.from) + " to " +
                            readable(interval.to));
    }
    if (is_finite(sample.X_PC)) continue;
    return fail_at(sample_of(id, i), check_value(id, sample.X_PC).error());
  }
  return {};
}

}  // namespace

Result<void> Forest::Impl::check_rewrite(const HeldVersion& edge, const TimeInterval& interval,
                                         std::size_t count) {
  const std::string who = "frame " + quote(edge.name->text);
  if (auto ok = check_interval(edge.name->text, interval); !ok) return ok;
  if (!edge.moving()) {
    return fail(Errc::kInvalidInput, who + " is static: it has no samples to rewrite");
  }
  const SampleHistory& samples = *edge.samples;
  if (samples.timing().drifts) {
    return fail(Errc::kInvalidInput,
                who +
                    " drifts: its samples tell how it moves from one to the next, and cannot be "
                    "rewritten; observe it instead");
  }
  const std::int64_t to = nanoseconds(interval.to);
  const bool none = edge.lacks_sample() || edge.left_behind();
  const std::size_t after =
      none || to >= edge.stamp ? 0 : samples.next() - samples.place_of(to + 1);
  const std::size_t most = std::min(samples.timing().count, kMaxRewritten);
  if (count <= most && after <= most - count) return {};
  return fail(Errc::kTooMuch, who + ": " + std::to_string(count) + " samples, and " +
                                  std::to_string(after) + " after them, are more than the " +
                                  std::to_string(most) +
                                  (most < kMaxRewritten ? " that are kept" : " of one rewrite"));
}

void Forest::Impl::replace_samples(const HeldVersion& newest, std::int64_t from, std::int64_t to,
                                   const std::vector<TimedValue>& samples) {
  newest.name->refused.end_row();
  SampleHistory& before = *newest.samples;
  const bool none = newest.lacks_sample() || newest.left_behind();
  const SampleHistory::Range replaced{none ? before.oldest() : before.place_of(from),
                                      none || to == kEnd ? before.next() : before.place_of(to + 1)};
  const bool keeps_newest = replaced.end < before.next();
  // Watchers of joints were also sent values between the samples before the interval and in it.
  if (before.has_instants(replaced.first)) {
    from = std::min(from, before.stamp(replaced.first - 1) + 1);
  }
  const std::size_t later = before.next() - replaced.end;
  bury(newest.slot, before, replaced);
  SampleStore& store = reclaimer_.samples();
  SampleHistory* fresh = before.without(replaced, samples.size() + later, store).release();
  HeldVersion& edge = push_held(newest.slot, keeps_newest ? newest.X_PC : *samples.back().X_PC);
  for (const TimedValue& sample : samples) {
    fresh->append(sample.stamp, edge.commit, {*sample.X_PC, nullptr, sample.revision}, store);
  }
  for (std::uint64_t number = replaced.end; number < before.next(); ++number) {
    fresh->append(*before.sample(number), store);
  }
  fresh->continue_from(before, replaced, newest.history, from);
  if (none) fresh->forget_earlier();
  fresh->rewritten = edge.commit;
  // As of replace_sample(); and one that was too long ago to take part may come nearer.
  const bool ends = !keeps_newest && samples.back().revision == nullptr;
  if (ends || samples.size() < replaced.end - replaced.first) fresh->set_observed(edge.commit);
  edge.samples = fresh;
  edge.number = fresh->next() - 1;
  edge.history = edge.commit;
  if (!keeps_newest) {
    edge.stamp = samples.back().stamp;
    end_revision(edge, samples.back().revision != nullptr ? Ties::kStay : Ties::kEnd);
  }
  reclaimer_.supersede(&before);
  drop_samples(edge);
}

// Of those that come, only the ones that stay are added.
void Forest::Impl::rewrite_told(const HeldVersion& edge,
                                const std::vector<const PushedValue*>& values) {
  const std::uint32_t slot = edge.slot;
  const EdgeTiming& timing = timing_of(edge);
  const std::int64_t newest = nanoseconds(*values.back()->stamp);
  const std::int64_t oldest = saturating_subtract(newest, timing.span.count());
  const std::int64_t from = std::max<std::int64_t>(nanoseconds(*values.front()->kept_before), 0);
  const std::size_t skipped = values.size() - std::min(values.size(), timing.count);
  std::deque<SampleRevision> revisions;  // which the samples refer to
  std::vector<TimedValue> samples;
  samples.reserve(values.size() - skipped);
  std::size_t made_up = 0;  // samples up to the last whose stamp is
  for (std::size_t i = skipped; i < values.size(); ++i) {
    const PushedValue& told = *values[i];
    const std::int64_t stamp = nanoseconds(*told.stamp);
    const bool follows = samples.empty() ? stamp >= from : stamp > samples.back().stamp;
    if (stamp < oldest || !follows || !is_finite(told.X)) continue;
    samples.push_back({stamp, &told.X, nullptr});
    if (told.made_up) made_up = samples.size();
    if (is_of_sample(told)) {
      samples.back().revision = &revisions.emplace_back(told_revision(edge, told));
    }
  }
  if (samples.empty()) return;
  replace_samples(edge, from, kEnd, samples);
  const HeldVersion& fresh = frames_.newest_value(slot);
  if (made_up > 0) fresh.samples->set_made_up(fresh.number - (samples.size() - made_up));
  if (samples.back().revision != nullptr) show_revision(slot);
}

Result<void> Forest::check_rewrite(std::string_view id, const TimeInterval& interval,
                                   std::size_t count) const {
  const Writing lock(impl_->mutex_);
  const auto slot = impl_->slot_to_change(id);
  if (!slot) return tl::unexpected(slot.error());
  return impl_->check_rewrite(impl_->frames_.newest_value(*slot), interval, count);
}

Result<void> Forest::rewrite(std::string_view id, const TimeInterval& interval,
                             const std::vector<EdgeSample>& samples) {
  if (auto ok = check_samples(id, interval, samples); !ok) return ok;
  std::vector<Impl::TimedValue> values;
  values.reserve(samples.size());
  for (const EdgeSample& sample : samples) {
    values.push_back({nanoseconds(sample.stamp), &sample.X_PC, nullptr});
  }
  const std::int64_t from = nanoseconds(interval.from);
  const std::int64_t to = nanoseconds(interval.to);
  const Writing lock(impl_->mutex_);
  const auto slot = impl_->slot_to_change(id);
  if (!slot) return tl::unexpected(slot.error());
  const HeldVersion& edge = impl_->frames_.newest_value(*slot);
  if (auto ok = impl_->check_rewrite(edge, interval, samples.size()); !ok) return ok;
  if (auto ok = impl_->check_ahead(edge, values.back().stamp); !ok) return ok;
  const bool follows = edge.lacks_sample() || edge.left_behind() || edge.stamp <= to;
  const std::int64_t newest = follows ? values.back().stamp : edge.stamp;
  const auto span = impl_->timing_of(edge).span;
  if (values.front().stamp < saturating_subtract(newest, span.count())) {
    const auto [by, most] = compared(std::chrono::nanoseconds(newest - values.front().stamp), span);
    return fail(Errc::kTooOld, "frame " + quote(id) + ": the first sample is " + by +
                                   " older than the newest, more than the " + most +
                                   " that are kept");
  }
  impl_->replace_samples(edge, from, to, values);
  impl_->commit();
  return {};
}

}  // namespace tfdude
