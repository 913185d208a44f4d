#include "tree/sample_rows.hpp"

#include <algorithm>
#include <functional>
#include <iterator>
#include <string_view>
#include <utility>

#include "tfdude/math/observation.hpp"

#include "math/common_errors.hpp"
#include "math/semidefinite.hpp"
#include "math/square_root.hpp"
#include "tree/row_ways.hpp"

namespace tfdude {
namespace {

const Correlation* said_of(const HeldVersion& edge) {
  return edge.correlation != nullptr ? &edge.correlation->said() : nullptr;
}

// The edges that its newest value is still tied to; the rows list also those that have got another
// value since.
std::vector<std::string> partners_of(const HeldVersion& edge, const Sample& row) {
  const EdgeCorrelation* newest = edge.correlation;
  return newest != nullptr && newest->revised() ? newest->now().observed_with
                                                : row.revision()->correlation().observed_with;
}

// Null: there is none with that stamp any more.
const Sample* sample_at(const HeldVersion& edge, std::int64_t t) {
  if (t == edge.stamp) return edge.samples->sample(edge.number);
  if (t == kAlways || t > edge.stamp) return nullptr;
  std::uint64_t back = 0;
  const Sample* found = edge.samples->around(t, edge.number, back).before;
  return found != nullptr && found->stamp == t ? found : nullptr;
}

// The latest first.
std::vector<const Sample*> rows_of(const HeldVersion& edge) {
  std::vector<const Sample*> rows;
  const Sample* row = last_observed(edge);
  while (row != nullptr && rows.size() < kMostRows) {
    rows.push_back(row);
    row = sample_at(edge, row->revision()->row.before);
    if (row != nullptr && row->revision() == nullptr) break;
  }
  return rows;
}

// How many samples are looked through for one that was observed.
constexpr std::uint64_t kMany = 256;

// Whether so many samples follow that to correct them all would take long. Then the newest one is
// the next that is observed.
bool is_long_ago(const HeldVersion& edge, const Sample& row) {
  const Sample* after = edge.number < kMany ? nullptr : edge.samples->sample(edge.number - kMany);
  return after != nullptr && after->stamp > row.stamp;
}

// How many rows are kept, besides one that an observation adds. They leave room for all edges that
// it was observed with, each of which may have as many.
std::size_t kept_rows(const HeldVersion& edge, const std::vector<const Sample*>& rows) {
  const std::size_t together = partners_of(edge, *rows.front()).size() + 1;
  const std::size_t room = kMaxObservedTogether / 2 / together;
  const std::size_t most = std::min({rows.size(), kFewestRows, room});
  std::size_t recent = 0;
  while (recent < most && !is_long_ago(edge, *rows[recent])) ++recent;
  const std::size_t lasts = rows.front()->revision()->row.lasts;
  return std::max(recent, (lasts + kRowLasts - 1) / kRowLasts);
}

std::string own_prefix() { return std::string(kObservedPrefix) + '@'; }

// Its own part becomes an error that others may have in common with it. Its name is one that no
// other sample, and no other value of this one, has anywhere.
// @param commit  of the last observation that has changed it
void share_own(const HeldVersion& edge, std::uint64_t commit, RowOfSample& row) {
  Loading root = root_of(row.X_PC.covariance.of_specified().matrix());
  if (root.cols() == 0) return;
  const auto text = [](auto number) { return std::to_string(number); };
  row.correlation.common_errors.push_back(
      {own_prefix() + text(std::hash<std::string_view>()(edge.name->text)) + "." + text(commit) +
           "." + text(nanoseconds(row.stamp)),
       false, std::move(root)});
  row.X_PC.covariance = Covariance();
}

void set_value(const Tied& tied, std::size_t i, SegmentValues& found) {
  found.values[i] = {tied.X_PC, Covariance::trusted(tied.own)};
  auto& without = found.unspecified;
  without.erase(std::remove_if(without.begin(), without.end(),
                               [&](const UnspecifiedEdge& edge) { return edge.segment == i; }),
                without.end());
  PathCorrelation& correlation = found.correlations[i];
  correlation.common_errors = tied.common_errors;
  correlation.unknown.reset();
  if (!tied.unknown) return;
  correlation.unknown = Covariance::trusted(tied.own);
  found.values[i].covariance = Covariance();
}

// What observations have tied to others is of unknown correlation.
void untie(std::size_t i, SegmentValues& found) {
  auto& errors = found.correlations[i].common_errors;
  const auto tied = std::stable_partition(errors.begin(), errors.end(),
                                          [](const CommonError& one) { return !is_observed(one); });
  Belief rest = belief_of(found.values[i], found.correlations[i]);
  rest.common_errors.assign(tied, errors.end());
  errors.erase(tied, errors.end());
  found.correlations[i].unknown = collapse(rest).covariance.of_specified();
  found.values[i].covariance = Covariance();
  found.values[i].covariance.set_complete(!rest.unspecified);
}

void add(const std::vector<std::string>& ids, std::vector<std::string>& all) {
  std::copy_if(ids.begin(), ids.end(), std::back_inserter(all),
               [&](const std::string& id) { return std::count(all.begin(), all.end(), id) == 0; });
}

// From which the value at an instant was computed.
SampleHistory::Bracket samples_at(const HeldVersion& edge, std::int64_t t) {
  SampleHistory::Bracket found{edge.samples->sample(edge.number), nullptr};
  std::uint64_t back = 0;
  if (t < edge.stamp) found = edge.samples->around(t, edge.number, back);
  if (found.before != nullptr && found.before->stamp == t) found.after = nullptr;
  if (edge.samples->timing().drifts) found.after = nullptr;
  return found;
}

// The edges that a value was observed with.
std::vector<std::string> observed_with(const SampleHistory::Bracket& samples) {
  std::vector<std::string> all;
  for (const Sample* sample : {samples.before, samples.after}) {
    if (sample == nullptr || !is_correlated(*sample)) continue;
    add(sample->revision()->correlation().observed_with, all);
  }
  return all;
}

// Whether the sample of an edge that does not drift was part of all that its partners were observed
// in since.
bool is_row(const HeldVersion& edge, const Sample& sample) {
  return is_correlated(sample) && sample.commit == edge.samples->observed() &&
         !sample.revision()->correlation().unknown && sample.complete() &&
         !is_long_ago(edge, sample);
}

// Whether the sample is tied to others, which may have been observed without it since.
bool is_left_out(const HeldVersion& edge, const Sample* sample) {
  if (sample == nullptr || !is_correlated(*sample) || is_row(edge, *sample)) return false;
  const auto& errors = sample->revision()->correlation().common_errors;
  return std::any_of(errors.begin(), errors.end(), is_observed);
}

// Whether an observation of a path on which the value is corrects it.
bool is_corrected(std::size_t i, const SegmentValues& found) {
  const Belief X = belief_of(found.values[i], found.correlations[i]);
  const auto counts = [](const CommonError& one) { return !one.loading.isZero(0); };
  return X.unspecified ||
         (!X.unknown && (!X.own.matrix().isZero(0) ||
                         std::any_of(X.common_errors.begin(), X.common_errors.end(), counts)));
}

// What the value between two samples has of the later one's own part becomes an error that both
// have in common.
void share_later(const HeldVersion& edge, std::int64_t t, const Sample& later, RowOfSample& row,
                 SegmentValues& found) {
  std::uint64_t back = 0;
  const auto [before, after] = edge.samples->around(t, edge.number, back);
  if (before == nullptr || after != &later || before->stamp == t) return;
  if (row.X_PC.covariance.of_specified().matrix().isZero(0)) return;
  const double s =
      static_cast<double>(t - before->stamp) / static_cast<double>(after->stamp - before->stamp);
  const Matrix6d share = share_of_after(*before, *after, s);
  StatedCovariance& own = found.values[row.segment].covariance;
  const Matrix6d rest = own.of_specified().matrix() -
                        share * row.X_PC.covariance.of_specified().matrix() * share.transpose();
  const bool complete = own.complete();
  own = Covariance::trusted(nearest_semidefinite(rest));
  own.set_complete(complete);
  share_own(edge, later.commit, row);
  auto& errors = found.correlations[row.segment].common_errors;
  add_errors(times(share, {row.correlation.common_errors.back()}), errors);
}

// The samples of an edge that does not drift err independently, until an observation ties them to
// others. The last of these is part of all observations of its partners, and of earlier instants,
// until a later one is observed without it.
std::vector<std::string> tell_last_row(const HeldVersion& edge, std::size_t segment, std::int64_t t,
                                       Rows asked, SegmentValues& found) {
  const SampleHistory::Bracket here = samples_at(edge, t);
  std::vector<std::string> with = observed_with(here);
  const bool left_out = is_left_out(edge, here.before) || is_left_out(edge, here.after);
  if (left_out) untie(segment, found);
  const Sample* last = last_row(edge);
  if (last == nullptr) return with;
  const bool of_path = asked == Rows::kOfPath;
  const bool stands_for_it = last->stamp < t && is_corrected(segment, found);
  if (of_path && (last->stamp == t || stands_for_it)) return with;
  RowOfSample row = as_stored(*last, segment, said_of(edge));
  add(row.correlation.observed_with, with);
  if (of_path && !left_out) share_later(edge, t, *last, row, found);
  found.rows.push_back(std::move(row));
  return with;
}

}  // namespace

const Sample* last_observed(const HeldVersion& edge) {
  const Sample* newest = edge.samples->sample(edge.number);
  if (newest == nullptr || newest->revision() == nullptr) return nullptr;
  const Sample* row = sample_at(edge, newest->revision()->row.follows);
  return row != nullptr && row->revision() != nullptr ? row : nullptr;
}

const Sample* last_row(const HeldVersion& edge) {
  for (std::uint64_t number = edge.number + 1; number-- > edge.samples->oldest();) {
    const Sample* sample = edge.samples->sample(number);
    if (sample == nullptr || edge.number - number > kMany) break;
    if (is_row(edge, *sample)) return sample;
  }
  return nullptr;
}

std::size_t observed_since(const HeldVersion& edge, std::int64_t t) {
  std::size_t count = 0;
  for (std::uint64_t number = edge.number + 1; number-- > edge.samples->oldest();) {
    const Sample* sample = edge.samples->sample(number);
    if (sample == nullptr || sample->stamp <= t || count == kMostRows) break;
    if (sample->revision() != nullptr && sample->revision()->row.observed) ++count;
  }
  return count;
}

std::vector<std::string> tell_rows(const HeldVersion& edge, std::size_t segment, std::int64_t t,
                                   Rows asked, SegmentValues& found) {
  const auto alone = [&] { return observed_with(samples_at(edge, t)); };
  if (asked == Rows::kNone) return alone();
  if (!edge.samples->timing().drifts) return tell_last_row(edge, segment, t, asked, found);
  if (t > edge.stamp) return alone();
  const std::vector<const Sample*> rows = rows_of(edge);
  if (rows.empty()) return alone();
  const Sample& last = *rows.front();
  const bool later = t > last.stamp;
  const std::size_t kept = kept_rows(edge, rows);
  const bool only = later && kept == 0;
  if (only && (asked == Rows::kOfPath || is_long_ago(edge, last))) return alone();
  const Correlation* said = said_of(edge);
  const Correlation& correlation = last.revision()->correlation();
  if (correlation.unknown || !last.complete()) {
    if (asked == Rows::kOfPath && later) return alone();
    if (asked == Rows::kOfPath && t < last.stamp) untie(segment, found);
    return partners_of(edge, last);
  }
  std::vector<RowOfSample> told;
  for (const Sample* row : rows) told.push_back(as_stored(*row, segment, said));
  const auto there =
      std::find_if(rows.begin(), rows.end(), [&](const Sample* row) { return row->stamp <= t; });
  const auto k = static_cast<std::size_t>(there - rows.begin());
  const bool at_row = k < rows.size() && rows[k]->stamp == t;
  // After an observation there is one more than are kept, until the next.
  const std::size_t more = asked == Rows::kAll || at_row ? 1 : 0;
  const std::size_t most = std::max(kept + more, later ? 1 : k + 1);
  if (told.size() > most) told.resize(most);
  if (asked == Rows::kOfPath && at_row) {
    told.erase(told.begin() + static_cast<std::ptrdiff_t>(k));
  } else if (asked == Rows::kOfPath) {
    if (k < rows.size()) share_own(edge, last.commit, told[k]);
    if (k > 0) share_own(edge, last.commit, told[k - 1]);
    const auto way_to = [&] { return way_between(edge, rows[k]->stamp, t); };
    const auto way_from = [&] { return way_between(edge, t, rows[k - 1]->stamp); };
    const Tied tied = k == 0             ? after_row(told[0], way_to())
                      : k == rows.size() ? before_row(way_from(), told[k - 1])
                                         : between_rows(told[k], way_to(), way_from(), told[k - 1]);
    set_value(tied, segment, found);
  }
  found.rows.insert(found.rows.end(), std::make_move_iterator(told.begin()),
                    std::make_move_iterator(told.end()));
  return partners_of(edge, last);
}

}  // namespace tfdude
