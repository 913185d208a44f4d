#include <algorithm>

#include "tfdude/base/id.hpp"

#include "base/saturating.hpp"
#include "base/stamp.hpp"
#include "tree/forest_impl.hpp"

// The effect of an update on the history of its edge.
namespace tfdude {

Result<void> check_timing(const EdgeTiming& timing) {
  if (timing.span <= std::chrono::nanoseconds(0)) {
    return fail(Errc::kInvalidInput, "history span must be positive, not " + readable(timing.span));
  }
  if (timing.max_ahead < std::chrono::nanoseconds(0)) {
    return fail(Errc::kInvalidInput,
                "history max_ahead must not be negative, as " + readable(timing.max_ahead) + " is");
  }
  constexpr std::size_t kMaxCount = 1U << 24U;
  if (timing.count < 2 || timing.count > kMaxCount) {
    return fail(Errc::kInvalidInput, "history count must be within 2 to " +
                                         std::to_string(kMaxCount) + ", not " +
                                         std::to_string(timing.count));
  }
  if (timing.believed < std::chrono::nanoseconds(0)) {
    return fail(Errc::kInvalidInput,
                "history believed must not be negative, as " + readable(timing.believed) + " is");
  }
  return {};
}

Forest::Impl::~Impl() {
  for (std::uint32_t slot = 0; slot < frames_.size(); ++slot) {
    if (!frames_.newest(slot).held()) continue;
    SampleHistory::destroy(frames_.newest_value(slot).samples);
    const InArena<EdgeCorrelation> correlation(frames_.newest_value(slot).correlation);
  }
}

void Forest::Impl::restart_history(const HeldVersion& newest, const GivenValue& value,
                                   std::int64_t stamp) {
  const HistoryRestart restart{std::string(newest.name->text), time_of(newest.stamp),
                               time_of(stamp)};
  begin_history(newest, value, stamp);
  newest.name->refused.end_row();
  if (restart_listener_) restart_listener_(restart);
}

void Forest::Impl::begin_history(const HeldVersion& newest, const GivenValue& value,
                                 std::int64_t stamp) {
  HeldVersion& fresh = push_held(newest.slot, value.X_PC);
  forget_history(fresh);
  end_revision(fresh);
  append_to(fresh, value, stamp);
}

Sample Forest::Impl::sample_at(const SampleHistory& samples, std::uint64_t place,
                               const GivenValue& value, std::int64_t stamp) {
  const Sample* before = place > samples.oldest() ? samples.sample(place - 1) : nullptr;
  Sample sample;
  sample.stamp = stamp;
  sample.commit = frames_.commit_being_made();
  sample.shared = reclaimer_.samples().share(value, samples.sample(place)->shared,
                                             before != nullptr ? before->shared : nullptr);
  sample.set(value);
  return sample;
}

// The newest sample stays unchanged, in a version that refers to the history with the new sample.
void Forest::Impl::insert_sample(const HeldVersion& newest, const GivenValue& value,
                                 std::int64_t stamp) {
  // One without a stamp may replace the newest while the clock is behind it.
  if (stamp != newest.stamp) newest.name->refused.end_row();
  const std::uint64_t place = newest.samples->place_of(stamp);
  const Sample* there = newest.samples->sample(place);
  if (there->stamp == stamp && there->commit != frames_.commit_being_made()) {
    return replace_sample(newest, value, stamp);
  }
  const Sample sample = sample_at(*newest.samples, place, value, stamp);
  if (there->stamp == stamp) {
    // Twice in one update: the later one counts, and no reader has seen the earlier.
    reclaimer_.samples().release(there->shared);
    newest.samples->rewrite(sample, place);
    // NOLINTNEXTLINE(*-const-cast): only readers see it as constant
    if (newest.stamp == stamp) const_cast<HeldVersion&>(newest).X_PC = value.X_PC;
    return;
  }
  SampleHistory* samples = newest.samples->with(sample, place, reclaimer_.samples()).release();
  samples->rewritten = sample.commit;
  reclaimer_.supersede(newest.samples);
  HeldVersion& fresh = push_held(newest.slot, newest.X_PC);
  fresh.samples = samples;
  fresh.number = samples->next() - 1;
  if (newest.samples->has_instants(place)) begin_again(fresh);
  drop_samples(fresh);
}

void Forest::Impl::give_back(SampleHistory* samples) {
  if (samples == nullptr) return;
  samples->drop_all(reclaimer_.samples());
  reclaimer_.supersede(samples);
}

void Forest::Impl::forget_history(HeldVersion& fresh) {
  fresh.history = fresh.commit;
  SampleHistory* before = fresh.samples;
  if (before == nullptr) return;
  fresh.samples = SampleHistory::create(*arena_, before->timing()).release();
  fresh.stamp = kAlways;
  bury(fresh.slot, *before, {before->oldest(), before->next()});
  give_back(before);
}

void Forest::Impl::clear_history(const HeldVersion& edge) {
  edge.name->refused.end_row();
  HeldVersion& fresh = push_held(edge.slot, edge.X_PC);
  forget_history(fresh);
  await_sample(fresh, kNoSample);
  end_revision(fresh);
}

void Forest::Impl::await_sample(HeldVersion& fresh, std::int64_t stamp) {
  if (fresh.samples == nullptr) {
    fresh.samples = SampleHistory::create(*arena_, default_timing_).release();
  }
  fresh.stamp = stamp;
  fresh.number = 0;
}

void Forest::Impl::resume_history(HeldVersion& fresh, const StoredTime& left,
                                  const std::optional<Pose>& given) {
  await_sample(fresh, left.cleared ? kNoSample : kUnsampled);
  if (left.cleared || !left.stamp) return;
  const bool revised = given && fresh.correlation != nullptr && fresh.correlation->revised();
  SampleRevision revision;
  if (revised) {
    const RowInfo row{true, false, 0, {}, nanoseconds(*left.stamp)};
    revision = {{*given, {}}, fresh.correlation->now(), row};
  }
  append_to(fresh, {fresh.X_PC, nullptr, revised ? &revision : nullptr}, nanoseconds(*left.stamp));
  if (revised) fresh.samples->set_observed(fresh.commit);
  fresh.samples->left_behind = true;
}

Result<void> Forest::clear_history(std::string_view id) {
  const Writing lock(impl_->mutex_);
  const auto slot = impl_->slot_to_change(id);
  if (!slot) return tl::unexpected(slot.error());
  const HeldVersion& edge = impl_->frames_.newest_value(*slot);
  if (!edge.moving() || edge.unsampled()) return {};
  impl_->clear_history(edge);
  impl_->commit();
  return {};
}

std::size_t Forest::clear_histories(Time from, std::optional<Time> jumped_from) {
  const Writing lock(impl_->mutex_);
  impl_->clock_.read_again();
  if (jumped_from) impl_->clock_.jumped_from(nanoseconds(*jumped_from));
  std::size_t cleared = 0;
  for (std::uint32_t slot = 0; slot < impl_->frames_.size(); ++slot) {
    if (!impl_->frames_.newest(slot).held()) continue;
    const HeldVersion& edge = impl_->frames_.newest_value(slot);
    if (!Impl::is_cleared(edge, nanoseconds(from))) continue;
    ++cleared;
    const auto frozen = impl_->frozen_.find(slot);
    if (frozen == impl_->frozen_.end()) {
      impl_->clear_history(edge);
      continue;
    }
    auto& later = frozen->second;
    later = std::min(later.value_or(INT64_MAX), nanoseconds(from));
  }
  if (cleared > 0) impl_->commit();
  return cleared;
}

Result<void> Forest::set_timing(std::string_view id, const EdgeTiming& timing) {
  if (auto ok = check_timing(timing); !ok) return fail_at("frame " + quote(id), ok.error());
  const Writing lock(impl_->mutex_);
  const auto slot = impl_->slot_to_change(id);
  if (!slot) return tl::unexpected(slot.error());
  const HeldVersion& newest = impl_->frames_.newest_value(*slot);
  const ChangedEdge kept = Impl::kept(newest);
  const StoredTime& left = kept.time;
  const bool resumes = newest.left_behind() || left.cleared;
  HeldVersion& fresh = impl_->push_held(*slot, newest.X_PC);
  impl_->forget_history(fresh);
  SampleHistory::destroy(fresh.samples);  // no reader has seen it
  fresh.samples = SampleHistory::create(*impl_->arena_, timing).release();
  if (resumes) {
    impl_->resume_history(fresh, left, kept.correlation.given);
  } else if (timing.moving) {
    impl_->await_sample(fresh);
  }
  impl_->remember(timing);
  if (impl_->past_ != nullptr) impl_->past_->forget_before(*slot);
  impl_->commit();
  return {};
}

Result<void> Forest::set_default_timing(const EdgeTiming& timing) {
  if (auto ok = check_timing(timing); !ok) return ok;
  const Writing lock(impl_->mutex_);
  impl_->default_timing_ = timing;
  impl_->remember(timing);
  if (impl_->past_ != nullptr) impl_->past_->keep_others(timing.believed.count() > 0);
  return {};
}

}  // namespace tfdude
