#include <algorithm>

#include "tfdude/math/interpolate.hpp"

#include "math/drift.hpp"
#include "math/finite.hpp"
#include "tree/forest_impl.hpp"
#include "tree/revised_sample.hpp"

// Applies values from another forest.
namespace tfdude {
namespace {

bool is_known(const Sample& sample, const GivenValue& told) {
  const SharedRevision* revision = sample.revision();
  const Correlation none;
  return same(sample.value(), told.X_PC) &&
         (revision != nullptr ? revision->correlation() : none) ==
             (told.revision != nullptr ? told.revision->correlation : none);
}

// Of the edge of the value at i, which begins a history: those that stay together.
std::vector<const PushedValue*> samples_from(const std::vector<PushedValue>& values,
                                             std::size_t i) {
  std::vector<const PushedValue*> samples;
  for (std::size_t j = i; j < values.size(); ++j) {
    const PushedValue& one = values[j];
    if (one.index != values[i].index) continue;
    const bool plain = one.stamp && !one.cleared && !one.unsampled;
    if (!plain || !check_common_errors(one.correlation.common_errors)) return {};
    samples.push_back(&one);
  }
  return samples;
}

}  // namespace

// How it was given is in no message: as uncertain as it is told to be, with all its errors.
SampleRevision Forest::Impl::told_revision(const HeldVersion& edge, const PushedValue& told) {
  const Correlation* said = edge.correlation != nullptr ? &edge.correlation->said() : nullptr;
  return {tfdude::whole(told.X, told.correlation, said), told.correlation, {}};
}

// The edge is static, until a sample follows.
void Forest::Impl::begin_told_history(std::uint32_t slot, const PushedValue& value) {
  HeldVersion& fresh = push_held(slot, value.X);
  forget_history(fresh);
  if (value.process_noise->upper() == Covariance::Upper{} && !value.drifts) return;
  EdgeTiming timing = default_timing_;
  timing.process_noise = *value.process_noise;
  timing.drifts = value.drifts;
  SampleHistory::destroy(fresh.samples);  // no reader has seen it
  fresh.samples = SampleHistory::create(*arena_, timing).release();
}

bool Forest::Impl::push_told_sample(const HeldVersion& edge, const PushedValue& told,
                                    bool replace) {
  const std::int64_t stamp = nanoseconds(*told.stamp);
  if (!is_of_sample(told)) return push_told_sample(edge, {told.X}, stamp, replace);
  const SampleRevision revision = told_revision(edge, told);
  return push_told_sample(edge, {told.X, nullptr, &revision}, stamp, replace);
}

// How a sample of an edge that drifts was given, from which follows how it has moved, is in no
// message. One that is corrected later was given as it was told first. A new one is as far from the
// one before as it was given, unless it was corrected alone.
std::optional<SampleRevision> Forest::Impl::told_of_drift(const HeldVersion& edge,
                                                          const GivenValue& value,
                                                          std::int64_t stamp) {
  const SampleHistory& samples = *edge.samples;
  const Correlation* said = edge.correlation != nullptr ? &edge.correlation->said() : nullptr;
  const bool corrected = value.revision != nullptr;
  SampleRevision fresh{{value.X_PC.pose, {}}, {}, {}};
  if (corrected) {
    fresh.correlation = value.revision->correlation;
  } else if (said != nullptr) {
    fresh.correlation = *said;
  }
  fresh.row.told = Told::kAsGiven;
  const bool first = !edge.moving() || edge.lacks_sample();
  const std::uint64_t place = first ? 0 : samples.place_of(stamp);
  const Sample* after = !first && place < samples.next() ? samples.sample(place) : nullptr;
  const Sample* before = !first && place > samples.oldest() ? samples.sample(place - 1) : nullptr;
  const Sample* other = before != nullptr ? before : after;
  if (other == nullptr) return corrected ? std::optional(fresh) : std::nullopt;
  if (after != nullptr && after->stamp == stamp) {
    const SharedRevision* revision = after->revision();
    if (!corrected && revision == nullptr && same(after->value(), value.X_PC)) return std::nullopt;
    fresh.given = given(*after);
    if (revision != nullptr) fresh.row.told = revision->row.told;
    return fresh;
  }
  fresh.given.pose = given(*other).pose * other->value_pose().inverse() * value.X_PC.pose;
  if (before == nullptr || follows(*before, said, value.X_PC, fresh.correlation)) {
    const bool as_given = !corrected && other->revision() == nullptr;
    return as_given ? std::nullopt : std::optional(fresh);
  }
  if (after == nullptr) {
    fresh.row.told = Told::kGuessed;
    return fresh;
  }
  // This sample is that of an observation between both.
  const double s = static_cast<double>(stamp - before->stamp) /
                   static_cast<double>(after->stamp - before->stamp);
  interpolate(given(*before).pose, given(*after).pose, s, fresh.given.pose);
  fresh.row.between = true;
  return fresh;
}

bool Forest::Impl::push_told_sample(const HeldVersion& edge, const GivenValue& value,
                                    std::int64_t stamp, bool replace) {
  if (stamp < 0) return false;
  const bool knows = value.revision != nullptr && value.revision->row.told != Told::kNot;
  if (drifts(edge) && !knows) {
    const auto revision = told_of_drift(edge, value, stamp);
    if (revision) {
      return push_told_sample(edge, {value.X_PC, nullptr, &*revision}, stamp, replace);
    }
  }
  const std::uint32_t slot = edge.slot;
  if (edge.moving() && stamp <= edge.stamp) {
    const std::uint64_t place = edge.samples->place_of(stamp);
    if (place < edge.samples->next() && edge.samples->stamp(place) == stamp) {
      if (!replace || is_known(*edge.samples->sample(place), value)) return false;
      replace_sample(edge, value, stamp);
      if (value.revision != nullptr) show_revision(slot);
      return true;
    }
    if (!check_sample(edge, stamp)) return false;
  }
  push_checked(edge, value, stamp);
  if (value.revision != nullptr) show_revision(slot);
  return true;
}

// A correlation of the newest sample alone stays.
void Forest::Impl::take_said(std::uint32_t slot, const Correlation& said) {
  HeldVersion& fresh = push_held(slot, frames_.newest_value(slot).X_PC);
  if (fresh.correlation != nullptr && fresh.correlation->revised()) {
    return correlate(fresh, said, fresh.correlation->now());
  }
  if (said.empty()) return set_correlation(fresh, nullptr);
  correlate(fresh, said);
}

bool Forest::Impl::push_told(const HeldVersion& edge, const PushedValue& value, bool replace) {
  if (!is_finite(value.X)) return false;
  const std::uint32_t slot = edge.slot;
  if (value.process_noise) begin_told_history(slot, value);
  if (value.cleared) {
    const HeldVersion& newest = frames_.newest_value(slot);
    if (!value.process_noise && (!newest.moving() || newest.lacks_sample())) return false;
    clear_history(newest);
    return true;
  }
  if (value.unsampled) {
    const HeldVersion& newest = frames_.newest_value(slot);
    // Within one history, an edge that had a sample has had one.
    if (!value.process_noise && (!newest.unsampled() || same(newest.X_PC, value.X))) return false;
    await_sample(push_held(slot, value.X));
    return true;
  }
  if (value.stamp) {
    const bool taken = push_told_sample(frames_.newest_value(slot), value, replace);
    const HeldVersion& newest = frames_.newest_value(slot);
    if (value.made_up && newest.moving() && newest.stamp == nanoseconds(*value.stamp)) {
      mark_made_up(slot);
    }
    return taken || value.process_noise;
  }
  if (value.process_noise) return true;
  // Within one history, a dynamic edge never becomes static again.
  if (edge.moving() || same(edge.X_PC, value.X)) return false;
  push_held(slot, value.X);
  return true;
}

void Forest::take(const std::vector<Handle>& edges, const std::vector<PushedValue>& values,
                  bool replace) {
  const Writing lock(impl_->mutex_);
  const auto edge_of = [&](const PushedValue& value) {
    const Version* edge =
        value.index < edges.size() ? impl_->frames_.newest_held(edges[value.index]) : nullptr;
    return static_cast<const HeldVersion*>(edge);
  };
  bool changed = false;
  std::vector<bool> rewritten(edges.size(), false);
  for (std::size_t i = 0; i < values.size(); ++i) {
    const PushedValue& value = values[i];
    const HeldVersion* edge = edge_of(value);
    if (edge == nullptr || rewritten[value.index]) continue;
    if (!check_common_errors(value.correlation.common_errors)) continue;
    if (value.kept_before && edge->moving()) {
      const auto samples = samples_from(values, i);
      rewritten[value.index] = !samples.empty();
      if (!samples.empty()) impl_->rewrite_told(*edge, samples);
    }
    if (rewritten[value.index] || impl_->push_told(*edge, value, replace)) changed = true;
  }
  std::vector<bool> correlated(edges.size(), false);
  for (auto value = values.rbegin(); value != values.rend(); ++value) {
    const HeldVersion* edge = edge_of(*value);
    if (!replace || edge == nullptr || correlated[value->index] || is_of_sample(*value)) continue;
    if (!check_common_errors(value->correlation.common_errors)) continue;
    correlated[value->index] = true;
    const Correlation before =
        edge->correlation != nullptr ? edge->correlation->said() : Correlation();
    if (before == value->correlation) continue;
    impl_->take_said(edge->slot, value->correlation);
    changed = true;
  }
  if (changed) impl_->commit();
}

void Forest::take(const std::vector<ToldSample>& samples) {
  const Writing lock(impl_->mutex_);
  const auto edge_of = [&](const ToldSample& sample) TFDUDE_UNCHECKED_LOCKS {
    return static_cast<const HeldVersion*>(impl_->frames_.newest_held(sample.frame));
  };
  bool changed = false;
  bool correlated = false;
  for (const ToldSample& sample : samples) {
    const HeldVersion* edge = edge_of(sample);
    if (edge == nullptr) continue;
    correlated = correlated || edge->correlation != nullptr;
    if (!is_finite(*sample.X_PC)) continue;
    changed = impl_->push_told_sample(*edge, {*sample.X_PC}, sample.stamp, true) || changed;
  }
  for (const ToldSample& sample : samples) {
    const HeldVersion* edge = correlated ? edge_of(sample) : nullptr;
    if (edge == nullptr || edge->correlation == nullptr) continue;
    if (edge->correlation->said().empty()) continue;
    impl_->take_said(edge->slot, {});
    changed = true;
  }
  if (changed) impl_->commit();
}

}  // namespace tfdude
