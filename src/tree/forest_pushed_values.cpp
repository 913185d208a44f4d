#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>

#include "tree/forest_impl.hpp"

// Recent values of edges, for watchers and for statistics.
namespace tfdude {
namespace {

HistoryInfo history_of(const HeldVersion& edge) {
  HistoryInfo info;
  info.id = edge.name->text;
  if (const Refused* refused = edge.name->refused.counts()) {
    info.refused_old = refused->old.load(std::memory_order_relaxed);
    info.refused_equal = refused->equal.load(std::memory_order_relaxed);
    info.refused_ahead = refused->ahead.load(std::memory_order_relaxed);
  }
  // Settings alone, of which some are for samples that may come, make no edge dynamic.
  if (edge.samples == nullptr || !edge.moving()) return info;
  const SampleHistory& samples = *edge.samples;
  info.span_limit = samples.timing().span;
  info.count_limit = samples.timing().count;
  info.bytes = samples.bytes();
  if (edge.lacks_sample()) return info;
  info.bytes += samples.bytes_until(edge.number);
  double sum = 0;
  double squares = 0;
  std::int64_t before = kAlways;
  for (std::uint64_t number = samples.oldest(); number <= edge.number; ++number) {
    const std::int64_t stamp = samples.stamp(number);
    if (stamp == kAlways) continue;  // dropped meanwhile
    ++info.samples;
    if (before == kAlways) {
      info.oldest = time_of(stamp);
    } else {
      const std::int64_t gap = stamp - before;
      sum += static_cast<double>(gap);
      squares += static_cast<double>(gap) * static_cast<double>(gap);
      info.max_gap = std::max(info.max_gap, std::chrono::nanoseconds(gap));
    }
    before = stamp;
  }
  info.newest = time_of(edge.stamp);
  if (info.samples < 2) return info;
  const auto gaps = static_cast<double>(info.samples - 1);
  const double mean = sum / gaps;
  info.mean_gap = std::chrono::nanoseconds(std::llround(mean));
  info.jitter = std::chrono::nanoseconds(
      std::llround(std::sqrt(std::max(squares / gaps - mean * mean, 0.0))));
  return info;
}

Correlation correlation_of(const HeldVersion& edge) {
  if (edge.correlation == nullptr) return {};
  return edge.moving() ? edge.correlation->said() : edge.correlation->now();
}

Transform newest_of(const HeldVersion& edge) {
  const EdgeCorrelation* correlation = edge.correlation;
  if (!edge.moving() || correlation == nullptr || !correlation->revised()) return edge.X_PC;
  return whole(edge.X_PC, correlation->now(), &correlation->said());
}

Transform value_of(const HeldVersion& edge, const Sample& sample) {
  return whole(sample, edge.correlation != nullptr ? &edge.correlation->said() : nullptr);
}

// The number of the first sample to report, up to the edge's newest.
std::uint64_t first_to_tell(const HeldVersion& edge, const EdgeCursor& cursor, std::uint64_t seen,
                            const PushedQuery& query) {
  const SampleHistory& samples = *edge.samples;
  std::uint64_t first = edge.number;
  if (cursor.history == 0 && cursor.commit == 0) {
    const std::int64_t from = query.from ? nanoseconds(*query.from) : edge.stamp;
    while (first > samples.oldest() && samples.stamp(first) > from) --first;
    return first;
  }
  // Late samples may be anywhere.
  if (samples.rewritten > seen) return samples.oldest();
  const auto is_new = [&](std::uint64_t number) {
    const Sample* sample = samples.sample(number);
    return sample != nullptr && sample->commit > seen;
  };
  while (first > samples.oldest() && is_new(first - 1)) --first;
  return first;
}

// Usually there is nothing to sort, and a stable sort allocates.
void sort_by_stamp(std::vector<PushedValue>::iterator begin,
                   std::vector<PushedValue>::iterator end) {
  const auto earlier = [](const PushedValue& a, const PushedValue& b) { return a.stamp < b.stamp; };
  if (!std::is_sorted(begin, end, earlier)) std::stable_sort(begin, end, earlier);
}

// Adds values of one edge. Between positions of a joint that are far apart, it adds values, since
// the watcher only has the poses.
class Telling {
 public:
  Telling(const HeldVersion& edge, std::uint32_t index, bool of_samples,
          std::vector<PushedValue>& values)
      : edge_(edge),
        index_(index),
        of_samples_(of_samples),
        values_(values),
        begin_(values.size()) {}

  void tell(const std::optional<Time>& stamp, const Transform& X) {
    values_.push_back({index_, stamp, X, {}, edge_.history, {}});
  }

  /// The samples from `first` on whose commits are after `seen`; 0: nothing was seen.
  void tell_samples(std::uint64_t first, std::uint64_t seen);
  void tell_newest(std::uint64_t seen);
  void tell_newest_if_none() {
    if (values_.size() == begin_) tell_newest(0);
  }
  void tell_no_sample(std::uint64_t seen);
  void tell_between(const Sample& before, const Sample& after);

  void finish(bool begins);

 private:
  void tell(const Sample& sample);
  void tell_row(std::int64_t stamp, const Transform& X, const Correlation& row);
  void tell_newest();

  const HeldVersion& edge_;
  std::uint32_t index_;
  bool of_samples_;
  std::vector<PushedValue>& values_;
  std::size_t begin_;
};

void Telling::tell_between(const Sample& before, const Sample& after) {
  for (const std::int64_t t : instants_between(before, after)) {
    tell(time_of(t), edge_.samples->value_between(before, after, t));
  }
}

void Telling::tell(const Sample& sample) {
  if (!of_samples_ || !is_correlated(sample)) {
    return tell(time_of(sample.stamp), value_of(edge_, sample));
  }
  tell_row(sample.stamp, sample.value(), sample.revision()->correlation());
}

void Telling::tell_row(std::int64_t stamp, const Transform& X, const Correlation& row) {
  tell(time_of(stamp), X);
  Correlation& told = values_.back().correlation = row;
  if (told.observed_with.empty()) told.observed_with.emplace_back(edge_.name->text);
}

// The edge's version may be newer than the sample that it shows.
void Telling::tell_newest() {
  const EdgeCorrelation* correlation = edge_.correlation;
  if (!of_samples_ || correlation == nullptr || !correlation->revised()) {
    return tell(time_of(edge_.stamp), newest_of(edge_));
  }
  tell_row(edge_.stamp, edge_.X_PC, correlation->now());
}

void Telling::tell_newest(std::uint64_t seen) {
  const SampleHistory& samples = *edge_.samples;
  const Sample* newest = samples.sample(edge_.number);
  if (newest != nullptr && newest->commit <= seen) return;
  tell_newest();
  values_.back().made_up = samples.made_up(edge_.number);
  if (seen == 0 || newest == nullptr) return;
  const Sample* before = newest;
  for (std::uint64_t number = edge_.number; before != nullptr && before->commit > seen; --number) {
    before = number > samples.oldest() ? samples.sample(number - 1) : nullptr;
  }
  if (before != nullptr) tell_between(*before, *newest);
}

void Telling::tell_samples(std::uint64_t first, std::uint64_t seen) {
  const SampleHistory& samples = *edge_.samples;
  const auto is_new = [seen](const Sample& sample) { return sample.commit > seen; };
  const bool follows = seen != 0 && first > samples.oldest();
  const Sample* before = follows ? samples.sample(first - 1) : nullptr;
  for (std::uint64_t number = first; number <= edge_.number; ++number) {
    const Sample* sample = samples.sample(number);
    if (sample == nullptr) continue;
    if (before != nullptr && (is_new(*sample) || is_new(*before))) tell_between(*before, *sample);
    if (is_new(*sample)) {
      if (number == edge_.number) {
        tell_newest();
      } else {
        tell(*sample);
      }
      values_.back().made_up = samples.made_up(number);
    }
    before = sample;
  }
  if (samples.sample(edge_.number) == nullptr) tell_newest();
}

void Telling::tell_no_sample(std::uint64_t seen) {
  if (edge_.commit <= seen) return;
  tell(std::nullopt, edge_.X_PC);
  values_.back().unsampled = edge_.unsampled();
  values_.back().cleared = !edge_.unsampled();
}

void Telling::finish(bool begins) {
  if (values_.size() == begin_) return;
  const auto begin = values_.begin() + static_cast<std::ptrdiff_t>(begin_);
  sort_by_stamp(begin, values_.end());
  const auto end = std::make_reverse_iterator(begin);
  const auto last = std::find_if_not(values_.rbegin(), end, is_of_sample);
  if (last != end) last->correlation = correlation_of(edge_);
  if (!begins) return;
  const EdgeTiming timing = edge_.samples != nullptr ? edge_.samples->timing() : EdgeTiming();
  begin->process_noise = timing.process_noise;
  begin->drifts = timing.drifts;
}

// The instant up to which a watcher has this history already, as that before it; kAlways: it has
// nothing of it. Late samples of that one may not have been told.
std::int64_t kept_before(const HeldVersion& edge, const EdgeCursor& cursor) {
  if (!edge.moving() || edge.lacks_sample()) return kAlways;
  const SampleHistory& samples = *edge.samples;
  const std::int64_t kept = samples.kept_before(cursor.history);
  if (kept == kAlways) return kAlways;
  for (std::uint64_t number = samples.oldest(); number <= edge.number; ++number) {
    const Sample* sample = samples.sample(number);
    if (sample == nullptr) continue;
    if (sample->stamp >= kept) break;
    if (sample->commit > cursor.commit) return sample->stamp;
  }
  return kept;
}

// What has changed of a history since a rewrite, as two histories (join_histories()).
void add_rewritten(const HeldVersion& edge, std::uint32_t index, const PushedQuery& query,
                   std::int64_t from, const EdgeCursor& cursor, std::vector<PushedValue>& values) {
  const std::size_t place = values.size();
  const SampleHistory& samples = *edge.samples;
  std::uint64_t first = edge.number;
  while (first > samples.oldest() && samples.stamp(first - 1) >= from) --first;
  // To a late position of a joint there is a way, which was not told, either.
  const Sample* before = first > samples.oldest() ? samples.sample(first - 1) : nullptr;
  const Sample* there = samples.sample(first);
  const bool on_the_way =
      before != nullptr && there != nullptr && !instants_between(*before, *there).empty();
  if (on_the_way) from = std::min(from, before->stamp + 1);
  values.push_back({index, time_of(from), {}, {}, cursor.history, {}});
  Telling telling(edge, index, query.of_samples, values);
  if (on_the_way) telling.tell_between(*before, *there);
  telling.tell_samples(first, 0);
  telling.finish(true);
  values[place].X = values[place + 1].X;
  values[place].process_noise = values[place + 1].process_noise;
}

void add_values(const HeldVersion& edge, std::uint32_t index, const PushedQuery& query,
                std::uint64_t commit, EdgeCursor& cursor, std::vector<PushedValue>& values) {
  const bool begins = edge.history != cursor.history;
  const std::uint64_t seen = begins ? 0 : cursor.commit;
  const bool goes_on = begins && !query.newest_only;
  if (const std::int64_t kept = goes_on ? kept_before(edge, cursor) : kAlways; kept != kAlways) {
    add_rewritten(edge, index, query, kept, cursor, values);
    cursor.commit = commit;
    cursor.history = edge.history;
    return;
  }
  Telling telling(edge, index, query.of_samples, values);
  if (edge.lacks_sample()) {
    telling.tell_no_sample(seen);
  } else if (edge.moving() && query.newest_only) {
    telling.tell_newest(seen);
  } else if (edge.moving()) {
    // What was told before the first push, unless it was of another history.
    const bool is_told = cursor.history == 0 && edge.history <= cursor.commit;
    const std::uint64_t told = is_told ? cursor.commit : seen;
    telling.tell_samples(first_to_tell(edge, cursor, told, query), told);
    if (begins) telling.tell_newest_if_none();
  } else if (edge.commit > seen) {
    telling.tell(std::nullopt, edge.X_PC);
  }
  cursor.commit = commit;
  cursor.history = edge.history;
  telling.finish(begins);
}

}  // namespace

void join_histories(std::vector<PushedValue>& values) {
  std::map<std::uint32_t, std::size_t> begun;  // the last such entry, by edge
  std::vector<std::size_t> ends;
  for (std::size_t i = 0; i < values.size(); ++i) {
    PushedValue& value = values[i];
    if (!value.process_noise) continue;
    const auto before = begun.find(value.index);
    if (before != begun.end() && values[before->second].history < value.history) {
      value.kept_before = values[before->second].stamp;
      value.continues = values[before->second].history;
      ends.push_back(before->second);
    }
    if (value.stamp) begun[value.index] = i;
  }
  std::sort(ends.begin(), ends.end());
  for (auto end = ends.rbegin(); end != ends.rend(); ++end) {
    values.erase(values.begin() + static_cast<std::ptrdiff_t>(*end));
  }
}

PushedCommit Forest::values_since(std::vector<EdgeCursor>& cursors,
                                  const PushedQuery& query) const {
  const epoch::Guard guard;
  const std::uint64_t commit = impl_->frames_.snapshot();
  PushedCommit all{{}, commit};
  // Null if it is not held, or has another parent: that is another history.
  const auto followed = [&](const EdgeCursor& cursor) -> const HeldVersion* {
    const Version* version = impl_->frames_.of(cursor.frame, commit);
    if (version == nullptr) version = impl_->frames_.present(cursor.id, commit);
    if (version == nullptr || !version->held()) return nullptr;
    const auto& edge = static_cast<const HeldVersion&>(*version);
    const bool same = edge.history == cursor.history;
    return same || impl_->frames_.info_of(edge, commit).parent == cursor.parent ? &edge : nullptr;
  };
  std::vector<const HeldVersion*> edges(cursors.size());
  std::transform(cursors.begin(), cursors.end(), edges.begin(), followed);
  if (query.whole && std::count(edges.begin(), edges.end(), nullptr) > 0) return all;
  for (std::uint32_t index = 0; index < cursors.size(); ++index) {
    const HeldVersion* edge = edges[index];
    if (edge == nullptr) continue;
    EdgeCursor& cursor = cursors[index];
    cursor.frame = {edge->slot, edge->generation};
    if (edge->commit > cursor.commit && all.values.empty()) all.values.reserve(cursors.size());
    add_values(*edge, index, query, commit, cursor, all.values);
  }
  sort_by_stamp(all.values.begin(), all.values.end());
  return all;
}

std::vector<HistoryInfo> Forest::histories(std::string_view id) const {
  const epoch::Guard guard;
  const std::uint64_t commit = impl_->frames_.snapshot();
  std::vector<HistoryInfo> all;
  const auto add = [&all](const Version* version) {
    if (version == nullptr || !version->held()) return;
    const auto& edge = static_cast<const HeldVersion&>(*version);
    const Refused* refused = edge.name->refused.counts();
    const bool ahead = refused != nullptr && refused->ahead.load(std::memory_order_relaxed) > 0;
    if (edge.moving() || ahead) all.push_back(history_of(edge));
  };
  if (!id.empty()) {
    add(impl_->frames_.present(id, commit));
    return all;
  }
  for (std::uint32_t slot = 0; slot < impl_->frames_.size(); ++slot)
    add(impl_->frames_.at(slot, commit));
  return all;
}

void Forest::on_commit(std::function<void()> listener, const void* whose) {
  const Writing lock(impl_->mutex_);
  auto& all = impl_->commit_listeners_;
  all.erase(std::remove_if(all.begin(), all.end(),
                           [whose](const auto& one) { return one.first == whose; }),
            all.end());
  if (listener) all.emplace_back(whose, std::move(listener));
}

void Forest::on_restart(std::function<void(const HistoryRestart&)> listener) {
  const Writing lock(impl_->mutex_);
  impl_->restart_listener_ = std::move(listener);
}

}  // namespace tfdude
