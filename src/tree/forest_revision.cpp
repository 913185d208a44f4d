#include <algorithm>
#include <cmath>
#include <functional>
#include <string_view>

#include "tfdude/base/id.hpp"
#include "tfdude/math/interpolate.hpp"

#include "base/saturating.hpp"
#include "math/common_errors.hpp"
#include "math/finite.hpp"
#include "tree/forest_impl.hpp"
#include "tree/row_ways.hpp"
#include "tree/sample_rows.hpp"

// What observations make of the values and samples of edges.
namespace tfdude {
namespace {

// Of the sample that a revision is of. @param at  the instant that was observed
std::int64_t stamp_of(const Revision& revision, std::int64_t at) {
  return revision.stamp ? nanoseconds(*revision.stamp) : at;
}

// All revisions of the edge of the first one, by their stamps. One of an instant that comes twice
// is taken once.
std::vector<const Revision*> samples_of(const std::vector<Revision>& edges, std::size_t first,
                                        std::int64_t stamp) {
  std::vector<const Revision*> all;
  for (std::size_t i = first; i < edges.size(); ++i) {
    if (edges[i].id == edges[first].id) all.push_back(&edges[i]);
  }
  std::stable_sort(all.begin(), all.end(), [&](const Revision* one, const Revision* other) {
    return stamp_of(*one, stamp) < stamp_of(*other, stamp);
  });
  const auto same = [&](const Revision* one, const Revision* other) {
    return stamp_of(*one, stamp) == stamp_of(*other, stamp);
  };
  all.erase(std::unique(all.begin(), all.end(), same), all.end());
  return all;
}

// Whether an observation has merged the sources of these and of what they were observed with. One
// of unknown correlation takes nothing else along.
bool merges(const std::vector<const Revision*>& revisions) {
  return std::any_of(revisions.begin(), revisions.end(),
                     [](const Revision* one) { return !one->correlation.unknown; });
}

bool shares_observation(const Correlation& one, const Correlation& other) {
  const auto has = [&](const std::string& source) {
    return std::any_of(other.common_errors.begin(), other.common_errors.end(),
                       [&](const CommonError& error) { return error.source == source; });
  };
  return std::any_of(
      one.common_errors.begin(), one.common_errors.end(),
      [&](const CommonError& error) { return is_observed(error) && has(error.source); });
}

// Of the value of an edge at an instant, or before it.
const Correlation* correlation_before(const HeldVersion& edge, std::int64_t at) {
  const Correlation* said = edge.correlation != nullptr ? &edge.correlation->said() : nullptr;
  if (edge.samples == nullptr || edge.samples->count() == 0) return said;
  const std::uint64_t place = edge.samples->place_of(at);
  const bool there = place < edge.samples->next() && edge.samples->stamp(place) == at;
  if (!there && place == edge.samples->oldest()) return said;
  return correlation_at(*edge.samples->sample(there ? place : place - 1), said);
}

// Values of an edge that drifts have errors of the same names only if the same observations have
// corrected them. One that has left no error of its own gets a name for an error of zero.
Correlation with_name(const HeldVersion& edge, Correlation corrected, std::int64_t at,
                      std::uint64_t commit) {
  const Correlation* before = correlation_before(edge, at);
  const auto is_left_by_it = [&](const CommonError& one) {
    return is_observed(one) &&
           (before == nullptr || of_same_source(before->common_errors, one) == nullptr);
  };
  auto& errors = corrected.common_errors;
  const bool has_name = std::any_of(errors.begin(), errors.end(), is_left_by_it);
  if (has_name || errors.size() >= kMaxCommonErrors) return corrected;
  const auto of_edge = std::hash<std::string_view>()(edge.name->text);
  // Commits are counted anew after a restart.
  const std::string name = std::to_string(of_edge) + '.' + std::to_string(commit) + '.';
  errors.push_back(
      {std::string(kObservedPrefix) + '!' + name + std::to_string(at), false, Loading::Zero(6, 1)});
  return corrected;
}

}  // namespace

Result<void> Forest::Impl::check_revision(const HeldVersion& edge, const Revision& revision,
                                          std::optional<Time> stamp, std::uint64_t seen) {
  const std::string who = "frame " + quote(revision.id);
  if (!is_finite(revision.X_PC)) return check_value(revision.id, revision.X_PC);
  if (auto ok = check_common_errors(revision.correlation.common_errors); !ok)
    return fail_at(who, ok.error());
  if (!edge.moving() || (edge.unsampled() && !stamp)) {
    if (edge.commit <= seen) return {};
    return fail(Errc::kChangedMeanwhile, who + " was written while it was observed");
  }
  if (!stamp) return fail(Errc::kChangedMeanwhile, who + " became dynamic since it was observed");
  // Samples from which the value was computed may be gone.
  if (edge.history > seen) {
    return fail(Errc::kChangedMeanwhile, who + " has another history since it was observed");
  }
  const std::int64_t at = nanoseconds(*stamp);
  if (auto ok = check_ahead(edge, at); !ok) return ok;
  const std::uint64_t place = edge.samples->place_of(at);
  const bool there = place < edge.samples->next() && edge.samples->stamp(place) == at;
  // The samples that the value at the instant was computed from.
  for (const std::uint64_t number : {there ? place : place - 1, place}) {
    if (number < edge.samples->oldest() || number >= edge.samples->next()) continue;
    if (edge.samples->sample(number)->commit <= seen) continue;
    return fail(Errc::kChangedMeanwhile, who + " was written while it was observed");
  }
  // Values at all instants are computed from the last one that was observed.
  const Sample* last = drifts(edge) ? last_observed(edge) : nullptr;
  if (last != nullptr && last->commit > seen) {
    return fail(Errc::kChangedMeanwhile, who + " was observed at another instant meanwhile");
  }
  if (there) return {};
  if (!revision.stamp) return check_sample(edge, at);
  return fail(Errc::kChangedMeanwhile, who + " has lost a sample since it was observed");
}

void Forest::Impl::revise_sample(const HeldVersion& newest, const Revision& revision,
                                 std::int64_t stamp, const RowInfo& row, Telling telling) {
  SampleRevision fresh{revision.X_PC, revision.correlation, row};
  if (drifts(newest)) {
    fresh.correlation =
        with_name(newest, std::move(fresh.correlation), stamp, frames_.commit_being_made());
  }
  if (newest.samples != nullptr && newest.samples->count() > 0) {
    const SampleHistory& samples = *newest.samples;
    const std::uint64_t place = samples.place_of(stamp);
    const Sample* after = place < samples.next() ? samples.sample(place) : nullptr;
    const Sample* before = place > samples.oldest() ? samples.sample(place - 1) : nullptr;
    if (after != nullptr && after->stamp == stamp) {
      fresh.given = given(*after);
      fresh.row.between = is_between(*after);
    } else if (after != nullptr && before != nullptr) {
      const double s = static_cast<double>(stamp - before->stamp) /
                       static_cast<double>(after->stamp - before->stamp);
      interpolate(given(*before), given(*after), s, fresh.given);
      fresh.row.between = true;
    }
  }
  const std::uint32_t slot = newest.slot;
  const bool carries_on = drifts(newest);
  replace_sample(newest, {revision.X_PC, nullptr, &fresh}, stamp, telling);
  if (carries_on) carry_on(slot, frames_.newest_value(slot).samples->place_of(stamp), telling);
  if (carries_on || frames_.newest_value(slot).stamp == stamp) show_revision(slot);
}

// Samples between two rows follow from both. After the last one, each follows from the one before.
void Forest::Impl::carry_on(std::uint32_t slot, std::uint64_t row, Telling telling) {
  const HeldVersion& edge = frames_.newest_value(slot);
  const SampleHistory& samples = *edge.samples;
  const Sample& first = *samples.sample(row);
  std::uint64_t end = row + 1;
  const auto is_row = [](const Sample& sample) {
    return sample.revision() != nullptr && sample.revision()->row.observed;
  };
  while (end < samples.next() && !is_row(*samples.sample(end))) ++end;
  if (end == row + 1) return;
  const Sample* second = end < samples.next() ? samples.sample(end) : nullptr;
  const auto is_sound = [](const Sample& sample) {
    return sample.complete() && !sample.revision()->correlation().unknown;
  };
  const bool tied = second != nullptr && second->revision()->row.before == first.stamp &&
                    is_sound(first) && is_sound(*second);
  std::vector<CorrelatedValue> values;
  if (tied) values = values_between(edge, row, end);
  Transform X = first.value();
  const Correlation* correlation = &first.revision()->correlation();
  for (std::uint64_t number = row + 1; !tied && number < end; ++number) {
    const Sample& before = *samples.sample(number - 1);
    const Sample& here = *samples.sample(number);
    const Walk walk{samples.timing().process_noise,
                    static_cast<double>(here.stamp - before.stamp) * 1e-9};
    const Pose increment = given(before).pose.inverse() * given(here).pose;
    values.push_back(drifted(X, correlation, increment, walk));
    X = values.back().X_PC;
    correlation = &values.back().correlation;
  }
  replace_followers(edge, row + 1, first.stamp, values, telling);
}

void Forest::Impl::replace_followers(const HeldVersion& edge, std::uint64_t first,
                                     std::int64_t follows,
                                     const std::vector<CorrelatedValue>& values, Telling telling) {
  std::vector<std::pair<Transform, SampleRevision>> moved;
  for (const CorrelatedValue& value : values) {
    const Sample& before = *edge.samples->sample(first + moved.size());
    const RowInfo row{false, is_between(before), 0, {}, follows};
    moved.push_back({value.X_PC, {{given(before).pose, {}}, value.correlation, row}});
  }
  replace_revisions(edge, first, moved, telling);
}

void Forest::Impl::replace_revisions(
    const HeldVersion& edge, std::uint64_t first,
    const std::vector<std::pair<Transform, SampleRevision>>& values, Telling telling) {
  SampleHistory* superseded = edge.samples;
  const std::uint64_t end = first + values.size();
  const bool to_newest = end == superseded->next();
  HeldVersion& fresh = push_held(edge.slot, to_newest ? values.back().first : edge.X_PC);
  if (to_newest) end_revision(fresh, Ties::kStay);
  bury(edge.slot, *superseded, {first, end});
  std::vector<Sample> samples;
  bool begins = superseded->has_instants(end);
  for (std::uint64_t number = first; number < end; ++number) {
    const Sample& before = *superseded->sample(number);
    const auto& [X_PC, revision] = values[number - first];
    begins = begins || superseded->has_instants(number);
    samples.push_back(sample_at(*superseded, number, {X_PC, nullptr, &revision}, before.stamp));
    if (telling == Telling::kLater) samples.back().commit = before.commit;
    reclaimer_.samples().release(before.shared);
  }
  fresh.samples = superseded->replaced(samples, first, reclaimer_.samples()).release();
  fresh.samples->rewritten = fresh.commit;
  if (begins) begin_again(fresh);
  reclaimer_.supersede(superseded);
}

// What an observation has made of the samples from one instant until another is an error of their
// own. Later ones have a part of it in common with them that no source tells.
void Forest::Impl::untie_samples(std::uint32_t slot, std::int64_t from, std::int64_t until) {
  std::uint64_t number = frames_.newest_value(slot).samples->place_of(from);
  for (;; ++number) {
    const HeldVersion& edge = frames_.newest_value(slot);
    if (number >= edge.samples->next() || edge.samples->stamp(number) >= until) return;
    const Sample& sample = *edge.samples->sample(number);
    if (!is_correlated(sample)) continue;
    const std::int64_t at = sample.stamp;
    const Correlation* said = edge.correlation != nullptr ? &edge.correlation->said() : nullptr;
    const Transform X = tfdude::whole(sample, said);
    const SampleRevision alone{given(sample), said != nullptr ? *said : Correlation(),
                               sample.revision()->row};
    replace_sample(edge, {X, nullptr, &alone}, at);
  }
}

// What the last row of an edge that does not drift was observed with goes on without the edge, if
// the revisions leave that row out.
void Forest::Impl::leave_out(std::uint32_t slot, const std::vector<const Revision*>& revisions,
                             std::int64_t stamp) {
  const HeldVersion& edge = frames_.newest_value(slot);
  const Sample* row = drifts(edge) || edge.lacks_sample() ? nullptr : last_row(edge);
  if (row == nullptr || !merges(revisions)) return;
  const bool takes_part = std::any_of(revisions.begin(), revisions.end(), [&](const Revision* one) {
    return stamp_of(*one, stamp) == row->stamp;
  });
  if (!takes_part) unlink(edge, row->revision()->correlation().observed_with);
}

// Rows that the revisions leave out are over: what ties the others to them is lost.
void Forest::Impl::revise_samples(std::uint32_t slot, const std::vector<const Revision*>& revisions,
                                  std::int64_t stamp) {
  const HeldVersion& edge = frames_.newest_value(slot);
  const Sample* last = drifts(edge) && edge.samples->count() > 0 ? last_observed(edge) : nullptr;
  const std::int64_t until = last != nullptr ? last->stamp : kAlways;
  std::uint8_t lasts = last != nullptr ? last->revision()->row.lasts : std::uint8_t{0};
  const bool on_path = std::any_of(revisions.begin(), revisions.end(),
                                   [](const Revision* one) { return !one->stamp; });
  if (stamp_of(*revisions.back(), stamp) > until) {
    if (lasts > 0) --lasts;
  } else if (on_path && stamp < until) {
    lasts = std::max(lasts, lasting(1 + observed_since(edge, stamp)));
  }
  const auto is_tied = [](const Revision& one) {
    const auto& errors = one.correlation.common_errors;
    return !one.correlation.unknown && std::any_of(errors.begin(), errors.end(), is_observed);
  };
  if (stamp_of(*revisions.front(), stamp) > until && last != nullptr &&
      shares_observation(last->revision()->correlation(), revisions.front()->correlation)) {
    untie_samples(slot, until, stamp_of(*revisions.front(), stamp));
  }
  const bool tells_all = lasts > 0 || !drifts(edge);
  // The latest first: the samples after each row are carried on up to the next one.
  for (std::size_t i = revisions.size(); i-- > 0;) {
    const std::int64_t at = stamp_of(*revisions[i], stamp);
    const bool follows = i > 0 && is_tied(*revisions[i - 1]);
    const std::int64_t before = follows ? stamp_of(*revisions[i - 1], stamp) : kAlways;
    const bool is_last = i + 1 == revisions.size();
    const RowInfo row{true, false, lasts, {}, at, before};
    revise_sample(frames_.newest_value(slot), *revisions[i], at, row,
                  is_last || tells_all ? Telling::kNow : Telling::kLater);
  }
  if (merges(revisions)) {
    frames_.newest_value(slot).samples->set_observed(frames_.commit_being_made());
  }
}

void Forest::Impl::show_revision(std::uint32_t slot) {
  const HeldVersion& newest = frames_.newest_value(slot);
  const Correlation said =
      newest.correlation != nullptr ? newest.correlation->said() : Correlation();
  const SharedRevision* revision = newest.samples->sample(newest.number)->revision();
  const bool correlated = revision != nullptr && !(revision->correlation().empty() && said.empty());
  if (!correlated && (newest.correlation == nullptr || !newest.correlation->revised())) return;
  HeldVersion& shown = push_held(slot, newest.X_PC);
  if (!correlated) return set_correlation(shown, nullptr);
  correlate(shown, said, revision->correlation());
}

// The first value of a history says where the edge begins, with the covariance that is known of it.
// An edge whose owner has restarted goes on from its stored sample.
void Forest::Impl::push_of_drift(const HeldVersion& newest, const GivenValue& value,
                                 std::int64_t stamp) {
  const std::int64_t span = newest.left_behind() ? 0 : newest.samples->timing().span.count();
  const bool goes_on = newest.moving() && !newest.lacks_sample();
  if (!goes_on || stamp < saturating_subtract(newest.stamp, span)) {
    Transform X_PC = value.X_PC;
    if (!X_PC.covariance.complete()) X_PC.covariance = newest.X_PC.covariance;
    return push_checked(newest, {X_PC}, stamp);
  }
  const std::uint64_t place = newest.samples->place_of(stamp);
  const bool there = place < newest.samples->next() && newest.samples->stamp(place) == stamp;
  if (there && is_between(*newest.samples->sample(place))) {
    return give_between(newest, *newest.samples->sample(place), value.X_PC.pose);
  }
  // As if a late value had come in time: what was observed later tells nothing of it. One before
  // all others leads to the first of them.
  const bool follows = !there && place > newest.samples->oldest();
  const Sample& other = *newest.samples->sample(follows ? place - 1 : place);
  const Correlation* said = newest.correlation != nullptr ? &newest.correlation->said() : nullptr;
  const double seconds = std::abs(static_cast<double>(stamp - other.stamp)) * 1e-9;
  const Pose& G_PC = value.X_PC.pose;
  const EdgeTiming& timing = newest.samples->timing();
  CorrelatedValue next = drifted(other, said, G_PC, {timing.process_noise, seconds});
  // Nothing has been observed, so the pose is as it was given.
  const bool in_order = follows && place == newest.samples->next();
  const bool plain = newest.correlation == nullptr && other.revision() == nullptr;
  if (in_order && plain && newest.samples->has_noise()) {
    return push_checked(newest, {next.X_PC}, stamp);
  }
  // Partners that have got another value since are not linked any more.
  if (newest.correlation != nullptr && newest.correlation->revised()) {
    next.correlation.observed_with = newest.correlation->now().observed_with;
  }
  RowInfo row;
  if (follows && other.revision() != nullptr) row.follows = other.revision()->row.follows;
  const SampleRevision revision{{G_PC, {}}, next.correlation, row};
  const std::uint32_t slot = newest.slot;
  push_checked(newest, {next.X_PC, nullptr, &revision}, stamp);
  show_revision(slot);
}

// What was seen at the stamp stays, and so do the later samples. The way to it and from it is now
// known.
void Forest::Impl::give_between(const HeldVersion& newest, const Sample& there, const Pose& G_PC) {
  const Transform X = there.value();
  const SharedRevision& before = *there.revision();
  RowInfo row = before.row;
  row.between = false;
  const SampleRevision revision{{G_PC, {}}, before.correlation(), row};
  const std::uint32_t slot = newest.slot;
  replace_sample(newest, {X, nullptr, &revision}, there.stamp);
  show_revision(slot);
}

void Forest::Impl::replace_sample(const HeldVersion& newest, const GivenValue& value,
                                  std::int64_t stamp, Telling telling) {
  const std::uint64_t place = newest.samples->place_of(stamp);
  if (place == newest.samples->next() || newest.samples->stamp(place) != stamp) {
    push_checked(newest, value, stamp);
    return;
  }
  SampleHistory* superseded = newest.samples;
  const Sample* before = superseded->sample(place);
  Sample sample = sample_at(*superseded, place, value, stamp);
  if (telling == Telling::kLater) sample.commit = before->commit;
  bury(newest.slot, *superseded, {place, place + 1});
  reclaimer_.samples().release(before->shared);
  const bool is_newest = newest.stamp == stamp;
  HeldVersion& fresh = push_held(newest.slot, is_newest ? value.X_PC : newest.X_PC);
  if (is_newest) end_revision(fresh, value.revision != nullptr ? Ties::kStay : Ties::kEnd);
  fresh.samples = superseded->replaced({sample}, place, reclaimer_.samples()).release();
  fresh.samples->rewritten = fresh.commit;
  // Its partners do not know the edge any more, so that no other sample is tied to them for sure.
  if (is_newest && value.revision == nullptr) fresh.samples->set_observed(fresh.commit);
  fresh.number = fresh.samples->next() - 1;
  if (superseded->has_instants(place) || superseded->has_instants(place + 1)) begin_again(fresh);
  reclaimer_.supersede(superseded);
}

Result<void> Forest::revise(const std::vector<Revision>& edges, std::optional<Time> stamp,
                            std::uint64_t seen) {
  const Writing lock(impl_->mutex_);
  std::vector<std::uint32_t> slots;
  for (const Revision& edge : edges) {
    const auto slot = impl_->slot_to_change(std::string_view(edge.id));
    if (!slot) return tl::unexpected(slot.error());
    auto ok = impl_->check_revision(impl_->frames_.newest_value(*slot), edge,
                                    edge.stamp ? edge.stamp : stamp, seen);
    if (!ok) return ok;
    slots.push_back(*slot);
  }
  const std::int64_t at = stamp ? nanoseconds(*stamp) : kAlways;
  const auto is_first = [&](std::size_t i) {
    return std::count(slots.begin(), slots.begin() + static_cast<std::ptrdiff_t>(i), slots[i]) == 0;
  };
  const auto is_sampled = [&](std::size_t i) {
    return impl_->frames_.newest_value(slots[i]).moving() && (stamp || edges[i].stamp);
  };
  // This comes first, as the revisions list each other.
  for (std::size_t i = 0; i < edges.size(); ++i) {
    if (is_first(i) && is_sampled(i)) impl_->leave_out(slots[i], samples_of(edges, i, at), at);
  }
  for (std::size_t i = 0; i < edges.size(); ++i) {
    if (!is_first(i)) continue;
    if (is_sampled(i)) {
      impl_->revise_samples(slots[i], samples_of(edges, i, at), at);
      continue;
    }
    const HeldVersion& newest = impl_->frames_.newest_value(slots[i]);
    const Correlation said =
        newest.correlation != nullptr ? newest.correlation->said() : Correlation();
    HeldVersion& fresh = impl_->push_held(slots[i], edges[i].X_PC);
    impl_->correlate(fresh, said, edges[i].correlation);
  }
  impl_->commit();
  return {};
}

}  // namespace tfdude
