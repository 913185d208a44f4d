#include <algorithm>

#include "tfdude/base/id.hpp"

#include "base/compared.hpp"
#include "base/saturating.hpp"
#include "base/stamp.hpp"
#include "math/finite.hpp"
#include "tree/forest_impl.hpp"

// Updates of the values of edges. What an update of one edge needs is in this file or in a header,
// so that the compiler makes one function of it.
namespace tfdude {
namespace {

tl::unexpected<Error> no_time(const HeldVersion& edge) {
  return fail(Errc::kNotYet, "frame " + quote(edge.name->text) +
                                 ": the owner's clock is external, and has no time yet");
}

const Correlation* correlation_of(const EdgeUpdate&) { return nullptr; }
const Correlation* correlation_of(const HandleUpdate&) { return nullptr; }
const Correlation* correlation_of(const CorrelatedUpdate& update) { return update.correlation; }

const JointState* state_of(const EdgeUpdate&) { return nullptr; }
const JointState* state_of(const HandleUpdate&) { return nullptr; }
const JointState* state_of(const CorrelatedUpdate& update) {
  return update.state.joint != nullptr ? &update.state : nullptr;
}

// How many versions ahead of the one that is written. Enough to hide the time until a line that
// a reader has is taken from the cache of its processor.
constexpr std::size_t kPrefetched = 8;

template <class Update>
Result<void> check_said(const Update& update) {
  const Correlation* said = correlation_of(update);
  return said != nullptr ? check_common_errors(said->common_errors) : Result<void>();
}

}  // namespace

Result<std::int64_t> Forest::Impl::stamp_for(const HeldVersion* const* edges, std::size_t count,
                                             const std::optional<Time>& given) {
  if (given) {
    if (auto ok = check_stamp(given); !ok) return tl::unexpected(std::move(ok.error()));
    const std::int64_t stamp = nanoseconds(*given);
    for (std::size_t i = 0; i < count; ++i) {
      auto ok = check_ahead(*edges[i], stamp);
      if (!ok) return tl::unexpected(std::move(ok.error()));
    }
    return stamp;
  }
  const HeldVersion* moving = nullptr;
  std::int64_t newest = kAlways;
  for (std::size_t i = 0; i < count; ++i) {
    const HeldVersion& edge = *edges[i];
    if (!is_timed(edge)) continue;
    if (moving == nullptr) moving = &edge;
    // A clock may have restarted with the process.
    if (!edge.left_behind()) newest = std::max(newest, edge.stamp);
  }
  if (moving == nullptr) return kAlways;
  if (!clock_.is_there()) {
    return fail(Errc::kInvalidInput,
                "frame " + quote(moving->name->text) + " is dynamic: its update needs a stamp");
  }
  const auto now = clock_.now();
  if (!now) return no_time(*moving);
  // If the clock stands still or was set back, the newest samples are replaced: stamps that are
  // made up must not tell a velocity.
  return newest <= *now ? *now : std::max(*now, newest_that_stays(edges, count, *now));
}

std::int64_t Forest::Impl::newest_that_stays(const HeldVersion* const* edges, std::size_t count,
                                             std::int64_t now) {
  std::int64_t newest = kAlways;
  for (std::size_t i = 0; i < count; ++i) {
    const HeldVersion& edge = *edges[i];
    if (edge.left_behind() || history_restarts(edge, now)) continue;
    newest = std::max(newest, edge.stamp);
  }
  return newest;
}

Result<void> Forest::Impl::check_ahead(const HeldVersion& edge, std::int64_t stamp) {
  const std::int64_t limit = timing_of(edge).max_ahead.count();
  const bool limited = limit != std::chrono::nanoseconds::max().count();
  if (!clock_.is_there() || (!limited && !clock_.has_jumped())) return {};
  if (clock_.surely_admits(stamp, limit)) return {};
  const auto now = clock_.read();
  if (!now) return no_time(edge);
  const std::int64_t ahead = saturating_subtract(stamp, *now);
  const bool of_before = clock_.is_of_before(stamp, *now);
  if (ahead <= limit && !of_before) return {};
  edge.name->refused.more().ahead.fetch_add(1, std::memory_order_relaxed);
  const std::string what =
      "frame " + quote(edge.name->text) + ": the stamp, " + readable(time_of(stamp)) + ", is ";
  const std::string clock = "the owner's clock";
  if (of_before) {
    return fail(Errc::kInvalidInput, what + "of the time before " + clock + " jumped back from " +
                                         readable(time_of(clock_.before_jump())) + "; now it is " +
                                         readable(time_of(*now)));
  }
  const auto [by, most] = compared(std::chrono::nanoseconds(ahead), timing_of(edge).max_ahead);
  return fail(Errc::kInvalidInput, what + by + " ahead of " + clock + ", " +
                                       readable(time_of(*now)) + ", more than the " + most +
                                       " allowed");
}

void Forest::Impl::push_value(std::uint32_t slot, const GivenValue& value, std::int64_t stamp) {
  const HeldVersion& old = frames_.newest_value(slot);
  if (drifts(old) && stamp != kAlways) return push_of_drift(old, value, stamp);
  push_checked(old, value, stamp);
}

void Forest::Impl::push_checked(const HeldVersion& old, const GivenValue& value,
                                std::int64_t stamp) {
  if (stamp == kAlways) {
    end_revision(push_held(old.slot, value.X_PC));
  } else if (!old.moving() || stamp > old.stamp) {
    append_sample(old, value, stamp);
  } else if (old.left_behind()) {
    begin_history(old, value, stamp);
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
    samples = SampleHistory::create(*arena_, default_timing_).release();
  } else if (samples->left_behind) {
    return begin_history(newest, value, stamp);
  } else {
    // First, so that the ring buffer need not grow for it. At least two samples are kept, so this
    // is not the newest.
    if (samples->count() >= samples->timing().count) drop_oldest(newest.slot, *samples);
    if (samples->full()) {
      samples = samples->grown().release();
      reclaimer_.supersede(newest.samples);
    }
  }
  HeldVersion& fresh = push_held(newest.slot, value.X_PC);
  // With its beginning, watchers are told that the edge drifts.
  if (!newest.moving() && drifts(newest)) fresh.history = fresh.commit;
  fresh.samples = samples;
  const bool goes_on = newest.moving() && !newest.lacks_sample();
  end_revision(fresh, goes_on || value.revision != nullptr ? Ties::kStay : Ties::kEnd);
  append_to(fresh, value, stamp);
  drop_samples(fresh);
}

void Forest::Impl::append_to(HeldVersion& fresh, const GivenValue& value, std::int64_t stamp) {
  fresh.stamp = stamp;
  fresh.number = fresh.samples->next();
  fresh.samples->append(stamp, fresh.commit, value, reclaimer_.samples());
}

void Forest::Impl::drop_samples(const HeldVersion& edge) {
  SampleHistory& samples = *edge.samples;
  const std::int64_t limit = edge.stamp - samples.timing().span.count();
  const std::size_t most = samples.timing().count;
  while (samples.count() > most || samples.first_stamp() < limit) drop_oldest(edge.slot, samples);
  keep_to_limit();
}

Result<void> Forest::Impl::update_one(const HeldVersion& edge, const Transform& X_PC,
                                      const std::optional<Time>& stamp) {
  if (stamp || may_be_moving(edge)) {
    const HeldVersion* only = &edge;
    const auto at = stamp_for(&only, 1, stamp);
    if (!at) return tl::unexpected(at.error());
    if (stamp) {
      if (auto ok = check_sample(edge, *at); !ok) return ok;
    }
    const std::uint32_t slot = edge.slot;
    push_value(slot, {X_PC}, *at);
    if (!stamp && *at != kAlways) mark_made_up(slot);
  } else {
    end_revision(push_held(edge.slot, X_PC));
  }
  commit();
  return {};
}

// Flat: otherwise the calls take a sixth of the time. Stamps are passed by reference up to here: a
// copy of an optional reads eight bytes where its flag was stored as one, and so waits until all
// stores before are done, which takes 5 ns.
template <class Frame>
[[gnu::flatten]] Result<void> Forest::Impl::update_one(Frame frame, const Transform& X_PC,
                                                       const std::optional<Time>& stamp) {
  // Before the lock: its locked instruction waits for the stores of the update before, and the
  // processor adds the numbers up meanwhile.
  if (!is_finite(X_PC)) return not_finite(frame, X_PC);
  const Writing lock(mutex_);
  const HeldVersion* edge = frames_.newest_held(frame);
  if (edge == nullptr) return tl::unexpected(frames_.held_slot(frame).error());
  if (auto ok = check_not_frozen(edge->slot); !ok) return ok;
  return update_one(*edge, X_PC, stamp);
}

template <class Frame>
Result<void> Forest::Impl::not_finite(Frame frame, const Transform& X_PC) {
  const Writing lock(mutex_);
  const HeldVersion* edge = frames_.newest_held(frame);
  if (edge == nullptr) return tl::unexpected(frames_.held_slot(frame).error());
  return check_value(edge->name->text, X_PC);
}

Result<void> Forest::update(std::string_view id, const Transform& X_PC,
                            const std::optional<Time>& stamp) {
  return impl_->update_one(id, X_PC, stamp);
}

Result<void> Forest::update(Handle frame, const Transform& X_PC, const std::optional<Time>& stamp) {
  return impl_->update_one(frame, X_PC, stamp);
}

template <class Update, class Frame>
Result<void> Forest::Impl::update_all(const std::vector<Update>& edges, Frame frame,
                                      const std::optional<Time>& stamp) {
  to_update_.clear();
  for (const Update& update : edges) {
    const HeldVersion* edge = frames_.newest_held(update.*frame);
    if (edge == nullptr) return tl::unexpected(frames_.held_slot(update.*frame).error());
    if (auto ok = check_not_frozen(edge->slot); !ok) return ok;
    if (!is_finite(update.X_PC)) return check_value(edge->name->text, update.X_PC);
    auto ok = check_said(update);
    // Other edges lose with a new value what observations have left.
    const Correlation* said = correlation_of(update);
    if (ok && said != nullptr && drifts(*edge)) ok = check_room(*edge, *said);
    if (!ok) return fail_at("frame " + quote(edge->name->text), ok.error());
    to_update_.push_back(edge);
  }
  const auto at = stamp_for(to_update_.data(), to_update_.size(), stamp);
  if (!at) return tl::unexpected(at.error());
  // Checks all of them, as each counts what it rejects.
  Result<void> fits;
  for (const HeldVersion* edge : to_update_) {
    if (!stamp) break;
    auto ok = check_sample(*edge, *at);
    if (!ok && fits) fits = std::move(ok);
  }
  if (!fits) return fits;
  for (std::size_t i = 0; i < edges.size(); ++i) {
    reclaimer_.prefetch_held(kPrefetched);
    const std::uint32_t slot = to_update_[i]->slot;
    // Without a stamp, a static edge stays static beside others.
    const bool timed = stamp || is_timed(*to_update_[i]);
    push_value(slot, {edges[i].X_PC, state_of(edges[i])}, timed ? *at : kAlways);
    if (!stamp && timed) mark_made_up(slot);
    if (const Correlation* said = correlation_of(edges[i])) say_correlation(slot, *said);
  }
  commit();
  return {};
}

Result<void> Forest::update(const std::vector<EdgeUpdate>& edges,
                            const std::optional<Time>& stamp) {
  const Writing lock(impl_->mutex_);
  return impl_->update_all(edges, &EdgeUpdate::id, stamp);
}

Result<void> Forest::update(const std::vector<HandleUpdate>& edges,
                            const std::optional<Time>& stamp) {
  const Writing lock(impl_->mutex_);
  return impl_->update_all(edges, &HandleUpdate::frame, stamp);
}

Result<void> Forest::update_partial(const std::vector<PartialUpdate>& edges,
                                    std::optional<Time> stamp) {
  const Writing lock(impl_->mutex_);
  const auto whole = impl_->completed(edges);
  if (!whole) return tl::unexpected(whole.error());
  return impl_->update_all(*whole, &EdgeUpdate::id, stamp);
}

Result<void> Forest::update_correlated(const std::vector<CorrelatedUpdate>& edges,
                                       std::optional<Time> stamp) {
  const Writing lock(impl_->mutex_);
  return impl_->update_all(edges, &CorrelatedUpdate::frame, stamp);
}

}  // namespace tfdude
