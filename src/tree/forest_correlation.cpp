#include <algorithm>
#include <iterator>
#include <utility>

#include "tfdude/base/id.hpp"

#include "math/common_errors.hpp"
#include "math/instant_sources.hpp"
#include "tree/forest_impl.hpp"

// How the errors of edges are correlated.
namespace tfdude {
namespace {

// What observations have found stays: the edge's error is no more certain because less is said of
// its sources.
// @param now  of a value, instead of what was said before
Correlation said_instead(const Correlation& now, const Correlation& before,
                         const Correlation& said) {
  Correlation instead = said;
  instead.observed_with = now.observed_with;
  const auto is_said = [](const Correlation& by, const CommonError& one) {
    return of_same_source(by.common_errors, one) != nullptr;
  };
  std::copy_if(
      now.common_errors.begin(), now.common_errors.end(), std::back_inserter(instead.common_errors),
      [&](const CommonError& one) { return !is_said(before, one) && !is_said(said, one); });
  return instead;
}

}  // namespace

Belief belief_of(const Transform& X, const PathCorrelation& correlation) {
  return {X.pose, X.covariance.of_specified(), correlation.unknown, correlation.common_errors,
          !X.covariance.complete()};
}

StampedTransform collapsed(const Belief& X, Order order, std::optional<Time> stamp) {
  std::vector<CommonError> errors;
  if (has_instants(X.common_errors)) {
    Belief here = X;
    if (stamp && join_instant(here.common_errors, *stamp)) return collapsed(here, order, stamp);
    errors = std::move(here.common_errors);
  }
  const bool bounded = X.unknown || allow_any_relation(errors);
  StampedTransform found{collapse(X), stamp, {order, bounded, {}}};
  std::vector<std::string>& sources = found.basis.sources;
  for (const CommonError& one : X.common_errors) {
    if (!is_name_only(one)) sources.emplace_back(shown_source(one.source));
  }
  std::sort(sources.begin(), sources.end());
  sources.erase(std::unique(sources.begin(), sources.end()), sources.end());
  return found;
}

void Forest::Impl::set_correlation(HeldVersion& fresh, InArena<EdgeCorrelation> correlation) {
  reclaimer_.supersede(fresh.correlation);
  fresh.correlation = correlation.release();
}

void Forest::Impl::end_revision(HeldVersion& fresh, Ties ties) {
  if (fresh.correlation == nullptr || !fresh.correlation->revised()) return;
  // The next value of an edge that drifts has the same error.
  if (ties == Ties::kEnd && !drifts(fresh)) {
    unlink(fresh, fresh.correlation->now().observed_with);
  }
  const Correlation& said = fresh.correlation->said();
  if (said.empty()) return set_correlation(fresh, nullptr);
  correlate(fresh, said);
}

void Forest::Impl::unlink(const HeldVersion& edge, const std::vector<std::string>& partners) {
  const std::string_view id = edge.name->text;
  for (const std::string& other : partners) {
    const auto slot = frames_.held_slot(other);
    if (!slot || *slot == edge.slot) continue;
    const HeldVersion& partner = frames_.newest_value(*slot);
    if (partner.correlation == nullptr || !partner.correlation->revised()) continue;
    Correlation left = partner.correlation->now();
    auto& with = left.observed_with;
    const auto own = std::remove(with.begin(), with.end(), id);
    if (own == with.end()) continue;
    with.erase(own, with.end());
    HeldVersion& fresh = push_held(*slot, partner.X_PC);
    correlate(fresh, fresh.correlation->said(), std::move(left));
  }
}

Result<void> Forest::Impl::check_room(const HeldVersion& edge, const Correlation& said) {
  if (edge.correlation == nullptr || !edge.correlation->revised()) return {};
  const auto& before = edge.correlation->now().common_errors;
  const auto is_left = [&](const CommonError& one) {
    return of_same_source(edge.correlation->said().common_errors, one) == nullptr;
  };
  const auto observed =
      static_cast<std::size_t>(std::count_if(before.begin(), before.end(), is_left));
  if (said.common_errors.size() + observed <= kMaxCommonErrors) return {};
  return fail(Errc::kInvalidInput, std::to_string(said.common_errors.size()) + " sources and " +
                                       std::to_string(observed) +
                                       " errors left by observations, of at most " +
                                       std::to_string(kMaxCommonErrors) + " together");
}

void Forest::Impl::say_correlation(std::uint32_t slot, const Correlation& said) {
  HeldVersion& fresh = push_held(slot, frames_.newest_value(slot).X_PC);
  const Correlation before =
      fresh.correlation != nullptr ? fresh.correlation->said() : Correlation();
  if (fresh.correlation != nullptr && fresh.correlation->revised()) {
    correlate(fresh, said, said_instead(fresh.correlation->now(), before, said));
  } else if (said.empty()) {
    set_correlation(fresh, nullptr);
  } else {
    correlate(fresh, said);
  }
  if (fresh.moving() && !fresh.lacks_sample()) say_of_samples(slot, before, said);
}

// Later samples of an edge that drifts follow from these. All of them are told; of another edge,
// those that take part in all observations, which are recognised by their commit.
void Forest::Impl::say_of_samples(std::uint32_t slot, const Correlation& before,
                                  const Correlation& said) {
  bool any = false;
  std::uint64_t number = frames_.newest_value(slot).samples->oldest();
  while (number < frames_.newest_value(slot).samples->next()) {
    const HeldVersion& edge = frames_.newest_value(slot);
    const SampleHistory& samples = *edge.samples;
    const bool drifting = drifts(edge);
    const bool is_row = !drifting && samples.sample(number)->commit == samples.observed();
    const std::uint64_t first = number;
    std::vector<std::pair<Transform, SampleRevision>> values;
    for (; number < samples.next() && (drifting || values.empty()); ++number) {
      const Sample& sample = *samples.sample(number);
      const SharedRevision* revision = sample.revision();
      if (revision == nullptr) break;
      values.push_back(
          {sample.value(),
           {revision->given, said_instead(revision->correlation(), before, said), revision->row}});
    }
    if (values.empty()) {
      ++number;
      continue;
    }
    any = true;
    const bool tells = drifting || is_row;
    replace_revisions(edge, first, values, tells ? Telling::kNow : Telling::kLater);
    if (is_row) frames_.newest_value(slot).samples->set_observed(frames_.commit_being_made());
  }
  if (any) show_revision(slot);
}

Result<void> Forest::correlate(std::string_view id, const Correlation& correlation) {
  if (auto ok = check_common_errors(correlation.common_errors); !ok) {
    return fail_at("frame " + quote(id), ok.error());
  }
  const Writing lock(impl_->mutex_);
  const auto slot = impl_->slot_to_change(id);
  if (!slot) return tl::unexpected(slot.error());
  if (auto ok = impl_->check_room(impl_->frames_.newest_value(*slot), correlation); !ok) {
    return fail_at("frame " + quote(id), ok.error());
  }
  impl_->say_correlation(*slot, correlation);
  impl_->commit();
  return {};
}

Result<void> Forest::resume(std::string_view id, const StoredCorrelation& correlation,
                            const StoredTime& time) {
  auto ok = check_common_errors(correlation.said.common_errors);
  if (ok && correlation.observed) ok = check_common_errors(correlation.observed->common_errors);
  if (!ok) return fail_at("frame " + quote(id), ok.error());
  const Writing lock(impl_->mutex_);
  const auto slot = impl_->frames_.held_slot(id);
  if (!slot) return tl::unexpected(slot.error());
  HeldVersion& fresh = impl_->push_held(*slot, impl_->frames_.newest_value(*slot).X_PC);
  if (correlation.empty()) {
    impl_->set_correlation(fresh, nullptr);
  } else if (!correlation.observed) {
    impl_->correlate(fresh, correlation.said);
  } else {
    impl_->correlate(fresh, correlation.said, *correlation.observed);
  }
  if (time.cleared || time.stamp) impl_->resume_history(fresh, time, correlation.given);
  impl_->commit();
  return {};
}

ChangedEdge Forest::Impl::kept(const HeldVersion& edge) {
  ChangedEdge kept{
      std::string(edge.name->text), edge.X_PC, {}, {std::nullopt, edge.stamp == kNoSample}};
  if (edge.moving() && !edge.lacks_sample()) kept.time.stamp = tfdude::time_of(edge.stamp);
  if (edge.correlation != nullptr) {
    kept.correlation.said = edge.correlation->said();
    if (edge.correlation->revised()) kept.correlation.observed = edge.correlation->now();
  }
  if (!kept.time.stamp) return kept;
  const Sample* newest = edge.samples->sample(edge.number);
  if (newest == nullptr || newest->revision() == nullptr) return kept;
  // Also one that was corrected beside exact edges, and so has nothing in common with others.
  if (!kept.correlation.observed) kept.correlation.observed = kept.correlation.said;
  kept.correlation.given = newest->revision()->given.pose;
  return kept;
}

Result<ChangedEdge> Forest::kept(std::string_view id) const {
  const epoch::Guard guard;
  auto edge = impl_->frames_.held_value(id);
  if (!edge) return tl::unexpected(std::move(edge.error()));
  return Impl::kept(**edge);
}

}  // namespace tfdude
