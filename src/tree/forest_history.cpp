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
      if (ok) ok = check_room(frames_.newest_value(slots[i]));
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
  for (std::size_t i = 0; i < count; ++i) {
    auto ok = check_room(frames_.newest_value(slots[i]));
    if (!ok) return tl::unexpected(std::move(ok.error()));
  }
  if (!clock_.is_there()) {
    return fail(Errc::kInvalidInput, "frame " + quote(frames_.newest_value(slots[0]).name->text) +
                                         " is dynamic: its update needs a stamp");
  }
  const auto now = clock_.now();
  if (!now) return no_time(frames_.newest_value(slots[0]));
  // If the clock was set back, time advances as little as possible.
  return newest == kAlways ? *now : std::max(*now, saturating_add(newest, 1));
}

Result<void> Forest::Impl::check_room(const HeldVersion& edge) {
  const bool replaces = edge.samples != nullptr && edge.samples->count() >= 2;
  if (kept_samples_ < max_samples_ || replaces) return {};
  refused_samples_.fetch_add(1, std::memory_order_relaxed);
  return fail(Errc::kTooMuch, "frame " + quote(edge.name->text) +
                                  ": there is no room for its history. All histories have " +
                                  std::to_string(kept_samples_) + " samples, the limit");
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

void Forest::Impl::push_value(std::uint32_t slot, const Transform& X_PC, std::int64_t stamp) {
  const HeldVersion& old = frames_.newest_value(slot);
  if (stamp == kAlways) {
    end_revision(push_held(slot, X_PC));
  } else if (!old.moving() || stamp > old.stamp) {
    append_sample(old, X_PC, stamp);
  } else if (stamp < old.stamp - old.samples->timing().span.count()) {
    restart_history(old, X_PC, stamp);
  } else {
    insert_sample(old, X_PC, stamp);
  }
}

void Forest::Impl::append_sample(const HeldVersion& newest, const Transform& X_PC,
                                 std::int64_t stamp) {
  SampleHistory* samples = newest.samples;
  if (samples == nullptr) {
    samples = new SampleHistory(default_timing_);
  } else {
    // First, so that a ring buffer with as many slots as samples suffices. At least two samples are
    // kept, so this is not the newest.
    if (samples->count() >= samples->timing().count) drop_oldest(*samples);
    if (samples->full()) {
      samples = samples->grown().release();
      reclaimer_.supersede(newest.samples);
    }
  }
  HeldVersion& fresh = push_held(newest.slot, X_PC);
  fresh.samples = samples;
  fresh.stamp = stamp;
  fresh.number = samples->next();
  fresh.kept = true;
  samples->append(&fresh, stamp);
  ++kept_samples_;
  drop_samples(*samples);
}

void Forest::Impl::restart_history(const HeldVersion& newest, const Transform& X_PC,
                                   std::int64_t stamp) {
  const HistoryRestart restart{newest.name->text, time_of(newest.stamp), time_of(stamp)};
  HeldVersion& fresh = push_held(newest.slot, X_PC);
  forget_history(fresh);
  fresh.stamp = stamp;
  fresh.number = fresh.samples->next();
  fresh.kept = true;
  fresh.samples->append(&fresh, stamp);
  ++kept_samples_;
  newest.name->refused.behind = {};
  if (restart_listener_) restart_listener_(restart);
}

// The newest sample stays unchanged, in a version that refers to the history with the new sample.
void Forest::Impl::insert_sample(const HeldVersion& newest, const Transform& X_PC,
                                 std::int64_t stamp) {
  newest.name->refused.behind = {};
  const std::uint64_t place = newest.samples->place_of(stamp);
  if (place < newest.samples->next() && newest.samples->stamp(place) == stamp) {
    // Twice in one update: the later one counts, and no reader has seen the earlier.
    newest.samples->sample(place)->X_PC = X_PC;
    if (newest.stamp == stamp) const_cast<HeldVersion&>(newest).X_PC = X_PC;
    return;
  }
  HeldVersion* sample = reclaimer_.take<HeldVersion>();
  *sample = HeldVersion{};
  sample->commit = frames_.commit_being_made();
  sample->depth = 0;  // so that it counts as held
  sample->X_PC = X_PC;
  sample->stamp = stamp;
  sample->kept = true;
  SampleHistory* samples = newest.samples->with(sample, stamp, place).release();
  samples->rewritten = sample->commit;
  reclaimer_.supersede(newest.samples);
  HeldVersion& fresh = push_held(newest.slot, newest.X_PC);
  fresh.samples = samples;
  fresh.number = samples->next() - 1;
  ++kept_samples_;
  drop_samples(*samples);
}

void Forest::Impl::drop_oldest(SampleHistory& samples) {
  HeldVersion* dropped = samples.drop_oldest();
  dropped->kept = false;
  --kept_samples_;
  reclaimer_.supersede(dropped);
}

void Forest::Impl::drop_samples(SampleHistory& samples) {
  const std::int64_t limit = samples.stamp(samples.next() - 1) - samples.timing().span.count();
  const auto beyond = [&]() TFDUDE_REQUIRES(mutex_) {
    return samples.count() > samples.timing().count || samples.stamp(samples.oldest()) < limit ||
           (kept_samples_ > max_samples_ && samples.count() > 2);
  };
  while (beyond()) {
    drop_oldest(samples);
  }
}

void Forest::Impl::give_back(SampleHistory* samples, std::uint32_t slot) {
  if (samples == nullptr) return;
  const Version* head = &frames_.newest(slot);
  kept_samples_ -= static_cast<std::int64_t>(samples->count());
  for (std::uint64_t number = samples->oldest(); number < samples->next(); ++number) {
    HeldVersion* sample = samples->sample(number);
    sample->kept = false;
    if (sample != head) reclaimer_.supersede(sample);
  }
  reclaimer_.supersede(samples);
}

void Forest::Impl::forget_history(HeldVersion& fresh) {
  fresh.history = fresh.commit;
  SampleHistory* before = fresh.samples;
  if (before == nullptr) return;
  fresh.samples = new SampleHistory(before->timing());
  fresh.stamp = kAlways;
  give_back(before, fresh.slot);
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

void Forest::limit_history(std::size_t bytes) {
  constexpr std::size_t kSampleBytes = sizeof(HeldVersion) + 2 * sizeof(std::int64_t);
  const Writing lock(impl_->mutex_);
  impl_->max_samples_ = static_cast<std::int64_t>(bytes / kSampleBytes);
}

std::uint64_t Forest::refused_samples() const {
  return impl_->refused_samples_.load(std::memory_order_relaxed);
}

Result<void> Forest::set_default_timing(const EdgeTiming& timing) {
  if (auto ok = check_timing(timing); !ok) return ok;
  const Writing lock(impl_->mutex_);
  impl_->default_timing_ = timing;
  return {};
}

}  // namespace tfdude
