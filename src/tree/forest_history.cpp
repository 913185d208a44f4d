#include <algorithm>

#include "tfdude/base/id.hpp"

#include "base/saturating.hpp"
#include "base/stamp.hpp"
#include "tree/forest_impl.hpp"

// The effect of an update on the history of its edge.
namespace tfdude {
namespace {

Result<void> check_timing(const EdgeTiming& timing) {
  if (timing.span <= std::chrono::nanoseconds(0)) {
    return fail(Errc::kInvalidInput,
                "history span must be positive, not " + in_milliseconds(timing.span));
  }
  if (timing.max_ahead < std::chrono::nanoseconds(0)) {
    return fail(Errc::kInvalidInput, "history max_ahead must not be negative, as " +
                                         in_milliseconds(timing.max_ahead) + " is");
  }
  constexpr std::size_t kMaxCount = 1U << 24U;
  if (timing.count < 2 || timing.count > kMaxCount) {
    return fail(Errc::kInvalidInput, "history count must be within 2 to " +
                                         std::to_string(kMaxCount) + ", not " +
                                         std::to_string(timing.count));
  }
  return {};
}

tl::unexpected<Error> no_time(const HeldVersion& edge) {
  return fail(Errc::kNotYet, "frame " + quote(edge.name->text) +
                                 ": the owner's clock is external, and has no time yet");
}

}  // namespace

Forest::Impl::~Impl() {
  for (std::uint32_t slot = 0; slot < frames_.size(); ++slot) {
    if (!frames_.newest(slot).held()) continue;
    delete frames_.newest_value(slot).samples;
    delete frames_.newest_value(slot).correlation;
  }
}

Result<std::int64_t> Forest::Impl::stamp_for(const std::uint32_t* slots, std::size_t count,
                                             std::optional<Time> given) {
  if (given) {
    if (auto ok = check_stamp(given); !ok) return tl::unexpected(std::move(ok.error()));
    const std::int64_t stamp = nanoseconds(*given);
    for (std::size_t i = 0; i < count; ++i) {
      auto ok = check_ahead(frames_.newest_value(slots[i]), stamp);
      if (!ok) return tl::unexpected(std::move(ok.error()));
    }
    return stamp;
  }
  bool moving = false;
  std::int64_t newest = kAlways;
  for (std::size_t i = 0; i < count; ++i) {
    const HeldVersion& edge = frames_.newest_value(slots[i]);
    moving = moving || edge.moving() || timing_of(edge).moving;
    newest = std::max(newest, edge.stamp);
  }
  if (!moving) return kAlways;
  if (!clock_.is_there()) {
    return fail(Errc::kInvalidInput, "frame " + quote(frames_.newest_value(slots[0]).name->text) +
                                         " is dynamic: its update needs a stamp");
  }
  const auto now = clock_.now();
  if (!now) return no_time(frames_.newest_value(slots[0]));
  // If the clock was set back, time advances as little as possible.
  return newest == kAlways ? *now : std::max(*now, saturating_add(newest, 1));
}

Result<void> Forest::Impl::check_ahead(const HeldVersion& edge, std::int64_t stamp) {
  const std::int64_t limit = timing_of(edge).max_ahead.count();
  if (!clock_.is_there() || limit == std::chrono::nanoseconds::max().count()) return {};
  if (clock_.surely_admits(stamp, limit)) return {};
  const auto now = clock_.read();
  if (!now) return no_time(edge);
  const std::int64_t ahead = saturating_subtract(stamp, *now);
  if (ahead <= limit) return {};
  edge.name->refused.ahead.fetch_add(1, std::memory_order_relaxed);
  return fail(Errc::kInvalidInput,
              "frame " + quote(edge.name->text) + ": the stamp, " + to_string(time_of(stamp)) +
                  ", is " + in_milliseconds(std::chrono::nanoseconds(ahead)) +
                  " ahead of the owner's clock, " + to_string(time_of(*now)) + ", more than the " +
                  in_milliseconds(timing_of(edge).max_ahead) + " allowed");
}

void Forest::Impl::push_value(std::uint32_t slot, const GivenValue& value, std::int64_t stamp) {
  const HeldVersion& old = frames_.newest_value(slot);
  if (stamp == kAlways) {
    end_revision(push_held(slot, value.X_PC));
  } else if (!old.moving() || stamp > old.stamp) {
    append_sample(old, value, stamp);
  } else if (stamp < old.stamp - old.samples->timing().span.count()) {
    restart_history(old, value, stamp);
  } else {
    insert_sample(old, value, stamp);
  }
}

void Forest::Impl::append_sample(const HeldVersion& newest, const GivenValue& value,
                                 std::int64_t stamp) {
  SampleHistory* samples = newest.samples;
  if (samples == nullptr) {
    samples = new SampleHistory(default_timing_);
  } else {
    // First, so that the ring buffer need not grow for it. At least two samples are kept, so this
    // is not the newest.
    if (samples->count() >= samples->timing().count) samples->drop_oldest(reclaimer_.samples());
    if (samples->full()) {
      samples = samples->grown().release();
      reclaimer_.supersede(newest.samples);
    }
  }
  HeldVersion& fresh = push_held(newest.slot, value.X_PC);
  fresh.samples = samples;
  append_to(fresh, value, stamp);
  drop_samples(*samples, stamp);
}

void Forest::Impl::append_to(HeldVersion& fresh, const GivenValue& value, std::int64_t stamp) {
  fresh.stamp = stamp;
  fresh.number = fresh.samples->next();
  fresh.samples->append(stamp, fresh.commit, value, reclaimer_.samples());
}

void Forest::Impl::restart_history(const HeldVersion& newest, const GivenValue& value,
                                   std::int64_t stamp) {
  const HistoryRestart restart{newest.name->text, time_of(newest.stamp), time_of(stamp)};
  HeldVersion& fresh = push_held(newest.slot, value.X_PC);
  forget_history(fresh);
  append_to(fresh, value, stamp);
  newest.name->refused.behind = {};
  if (restart_listener_) restart_listener_(restart);
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
  newest.name->refused.behind = {};
  const std::uint64_t place = newest.samples->place_of(stamp);
  const Sample* there = newest.samples->sample(place);
  const Sample sample = sample_at(*newest.samples, place, value, stamp);
  if (there->stamp == stamp) {
    // Twice in one update: the later one counts, and no reader has seen the earlier.
    reclaimer_.samples().release(there->shared);
    newest.samples->rewrite(sample, place);
    if (newest.stamp == stamp) const_cast<HeldVersion&>(newest).X_PC = value.X_PC;
    return;
  }
  SampleHistory* samples = newest.samples->with(sample, place, reclaimer_.samples()).release();
  samples->rewritten = sample.commit;
  reclaimer_.supersede(newest.samples);
  HeldVersion& fresh = push_held(newest.slot, newest.X_PC);
  fresh.samples = samples;
  fresh.number = samples->next() - 1;
  if (newest.samples->has_instants(place)) fresh.history = fresh.commit;
  drop_samples(*samples, newest.stamp);
}

void Forest::Impl::drop_samples(SampleHistory& samples, std::int64_t newest) {
  const std::int64_t limit = newest - samples.timing().span.count();
  const std::size_t most = samples.timing().count;
  while (samples.count() > most || samples.first_stamp() < limit) {
    samples.drop_oldest(reclaimer_.samples());
  }
  keep_to_limit();
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
  fresh.samples = new SampleHistory(before->timing());
  fresh.stamp = kAlways;
  give_back(before);
}

void Forest::Impl::clear_history(const HeldVersion& edge) {
  edge.name->refused.behind = {};
  HeldVersion& fresh = push_held(edge.slot, edge.X_PC);
  forget_history(fresh);
  if (fresh.samples == nullptr) fresh.samples = new SampleHistory(default_timing_);
  fresh.stamp = kNoSample;
  fresh.number = 0;
  end_revision(fresh);
}

Result<void> Forest::clear_history(std::string_view id) {
  const Writing lock(impl_->mutex_);
  const auto slot = impl_->frames_.held_slot(id);
  if (!slot) return tl::unexpected(slot.error());
  const HeldVersion& edge = impl_->frames_.newest_value(*slot);
  if (!edge.moving()) return {};
  impl_->clear_history(edge);
  impl_->commit();
  return {};
}

std::size_t Forest::clear_histories(Time from) {
  const Writing lock(impl_->mutex_);
  impl_->clock_.read_again();
  std::size_t cleared = 0;
  for (std::uint32_t slot = 0; slot < impl_->frames_.size(); ++slot) {
    if (!impl_->frames_.newest(slot).held()) continue;
    const HeldVersion& edge = impl_->frames_.newest_value(slot);
    if (!edge.moving() || edge.lacks_sample() || edge.stamp < nanoseconds(from)) continue;
    impl_->clear_history(edge);
    ++cleared;
  }
  if (cleared > 0) impl_->commit();
  return cleared;
}

Result<void> Forest::set_timing(std::string_view id, const EdgeTiming& timing) {
  if (auto ok = check_timing(timing); !ok) return fail_at("frame " + quote(id), ok.error());
  const Writing lock(impl_->mutex_);
  const auto slot = impl_->frames_.held_slot(id);
  if (!slot) return tl::unexpected(slot.error());
  HeldVersion& fresh = impl_->push_held(*slot, impl_->frames_.newest_value(*slot).X_PC);
  impl_->forget_history(fresh);
  delete fresh.samples;  // no reader has seen it
  fresh.samples = new SampleHistory(timing);
  impl_->commit();
  return {};
}

Result<void> Forest::set_default_timing(const EdgeTiming& timing) {
  if (auto ok = check_timing(timing); !ok) return ok;
  const Writing lock(impl_->mutex_);
  impl_->default_timing_ = timing;
  return {};
}

}  // namespace tfdude
