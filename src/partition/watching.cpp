#include "partition/watching.hpp"

#include <algorithm>
#include <iterator>
#include <map>
#include <utility>

#include "tfdude/base/id.hpp"

namespace tfdude {
namespace {

// FNV-1a with 64 bits. Each text ends with a zero, which none contains.
class Fingerprint {
 public:
  void add(std::string_view text) {
    for (const char c : text) octet(static_cast<std::uint8_t>(c));
    octet(0);
  }
  void add(std::uint64_t number) {
    for (int i = 0; i < 8; ++i) octet(static_cast<std::uint8_t>(number >> (8 * i)));
  }
  [[nodiscard]] std::uint64_t value() const { return value_; }

 private:
  void octet(std::uint8_t value) { value_ = (value_ ^ value) * 1099511628211U; }
  std::uint64_t value_ = 14695981039346656037U;
};

// As for an edge: if a part of a segment is of unknown correlation, its own part counts as unknown,
// too.
void set_correlation(PushedValue& entry, const PathCorrelation& correlation) {
  entry.correlation.common_errors = correlation.common_errors;
  if (!correlation.unknown) return;
  entry.correlation.unknown = true;
  const bool complete = entry.X.covariance.complete();
  entry.X.covariance = bound(entry.X.covariance.of_specified(), *correlation.unknown);
  entry.X.covariance.set_complete(complete);
}

// What a segment has of its edges' errors differs from pose to pose: it is that of a sample alone.
std::vector<PushedValue> entries_of(const SegmentValues& found,
                                    const std::vector<PathEnds>& segments) {
  std::vector<PushedValue> entries;
  for (std::uint32_t i = 0; i < found.values.size(); ++i) {
    entries.push_back({i, found.stamp, found.values[i], {}, found.history, {}});
    PushedValue& entry = entries.back();
    entry.cleared = found.cleared;
    entry.unsampled = found.unsampled;
    // As for an edge: if one edge of a segment is unspecified, the segment is.
    if (!entry.X.covariance.complete()) entry.X.covariance = StatedCovariance::unspecified();
    if (!found.correlations.empty()) set_correlation(entry, found.correlations[i]);
    if (!found.stamp || entry.correlation.empty()) continue;
    entry.correlation.observed_with = {segments[i].to};
  }
  return entries;
}

std::size_t size_of(const std::vector<PushedValue>& entries) {
  std::size_t size = entries.size();
  for (const PushedValue& entry : entries) {
    size += entry.correlation.common_errors.size() + entry.correlation.observed_with.size();
  }
  return size;
}

}  // namespace

std::size_t correlated_entries(const PushedValues& pushed) {
  return static_cast<std::size_t>(
      std::count_if(pushed.entries.begin(), pushed.entries.end(),
                    [](const PushedValue& entry) { return !entry.correlation.empty(); }));
}

std::uint64_t watch_group(std::string_view partition, std::uint64_t incarnation,
                          const WatchRequest& request) {
  Fingerprint print;
  print.add(partition);
  print.add(incarnation);
  print.add(static_cast<std::uint64_t>(request.period.count()));
  print.add(static_cast<std::uint64_t>(request.of_samples ? 2 : request.composed ? 1 : 0));
  for (const PathEnds& ends : request.segments) {
    print.add(ends.from);
    print.add(ends.to);
  }
  return print.value();
}

Result<void> check_watch(const WatchRequest& request) {
  if (request.segments.empty()) return fail(Errc::kInvalidInput, "a watch of no edges");
  constexpr std::chrono::nanoseconds kLongest = kMaxWatchPeriod;
  if (request.period >= std::chrono::nanoseconds(0) && request.period <= kLongest) return {};
  return fail(Errc::kInvalidInput, "the period of a watch must be within 0 and " +
                                       readable(kLongest) + ", not " + readable(request.period));
}

void CovarianceNumbers::push(PushedValue& value) {
  if (!value.X.covariance.complete()) return;
  Told& told = told_[value.index];
  const Covariance::Upper& covariance = value.X.covariance.of_specified().upper();
  value.covariance_known = told.number != 0 && told.covariance == covariance;
  if (!value.covariance_known) told = {std::max(told.number + 1, 1U), covariance};
  value.covariance_number = told.number;
}

void CovarianceNumbers::label(PushedValue& value) const {
  if (!value.X.covariance.complete()) return;
  const Told& told = told_[value.index];
  if (told.covariance == value.X.covariance.of_specified().upper()) {
    value.covariance_number = told.number;
  }
}

bool KnownCovariances::fill_in(std::vector<PushedValue>& values) {
  std::size_t known = 0;
  for (PushedValue& value : values) {
    if (!fill_in(value)) continue;
    if (&values[known] != &value) values[known] = std::move(value);
    ++known;
  }
  const bool all = known == values.size();
  values.resize(known);
  return all;
}

bool KnownCovariances::fill_in(PushedValue& value) {
  if (value.covariance_number == 0 || value.index >= known_.size()) return !value.covariance_known;
  Known& known = known_[value.index];
  if (!value.covariance_known) {
    known = {value.covariance_number, value.X.covariance.of_specified()};
    return true;
  }
  if (known.number != value.covariance_number) return false;
  value.X.covariance = known.covariance;
  value.covariance_known = false;
  return true;
}

WatchedGroup::WatchedGroup(std::uint64_t id, WatchRequest request)
    : id_(id),
      request_(std::move(request)),
      sent_(request_.segments.size()),
      numbers_(request_.segments.size()) {
  if (!request_.composed) cursors_ = fresh_cursors();
}

std::vector<EdgeCursor> WatchedGroup::fresh_cursors() const {
  std::vector<EdgeCursor> cursors;
  cursors.reserve(request_.segments.size());
  for (const PathEnds& edge : request_.segments) cursors.push_back({edge.to, edge.from});
  return cursors;
}

void WatchedGroup::begin(const PushedValues& told) {
  for (EdgeCursor& edge : cursors_) edge.commit = told.commit;
  const auto newest = told.entries.empty() ? std::nullopt : told.entries.back().stamp;
  begun_ = {told.commit, newest.value_or(Time::min()), false};
}

Result<PushedValues> WatchedGroup::snapshot(const Forest& forest, std::optional<Time> from,
                                            bool is_answer) const {
  auto values = all(forest, from);
  if (!values) return values;
  leave_out_pending(*values, is_answer);
  for (PushedValue& value : values->entries) numbers_.label(value);
  return values;
}

PushedValues WatchedGroup::next_push(const Forest& forest) {
  PushedValues pushed = changed(forest);
  for (PushedValue& value : pushed.entries) numbers_.push(value);
  return pushed;
}

Result<PushedValues> WatchedGroup::all(const Forest& forest, std::optional<Time> from) const {
  if (request_.composed) return composed(forest, from);
  auto cursors = fresh_cursors();
  PushedQuery query{!from, from};
  query.of_samples = request_.of_samples;
  auto found = forest.values_since(cursors, query);
  for (const EdgeCursor& edge : cursors) {
    if (edge.history != 0) continue;
    return fail(Errc::kNotOwner, "frame " + quote(edge.id) + " is not of this partition, or not " +
                                     "below " + quote(edge.parent));
  }
  PushedValues pushed{id_, std::move(found.values), 0, found.commit};
  const auto ask_again = [&](const PushedQuery& less) {
    cursors = fresh_cursors();
    found = forest.values_since(cursors, less);
    pushed.entries = std::move(found.values);
    pushed.commit = found.commit;
  };
  if (pushed.entries.size() > kMaxItems) ask_again({true, {}, false, query.of_samples});
  // One message has no room for more.
  if (correlated_entries(pushed) > kMaxCorrelated) ask_again({true, {}});
  return pushed;
}

// The watchers have the history before one that a push is about to tell, perhaps as what goes on
// from that. Whatever comes first would only tell them that theirs is over. What is left may be
// half of a commit, so it does not follow on anything that a watcher lacks. An edge without samples
// has no past that could be lost.
void WatchedGroup::leave_out_pending(PushedValues& pushed, bool on_its_way) const {
  if (request_.period > std::chrono::nanoseconds(0)) return;
  auto& entries = pushed.entries;
  const auto pending =
      std::remove_if(entries.begin(), entries.end(), [&](const PushedValue& entry) {
        if (request_.composed || !(entry.stamp || entry.cleared)) return false;
        const std::uint64_t history = cursors_[entry.index].history;
        const bool is_rewritten =
            std::find(rewritten_.begin(), rewritten_.end(), entry.index) != rewritten_.end();
        return (on_its_way && is_rewritten) || (history != 0 && history != entry.history);
      });
  if (pending == entries.end()) return;
  entries.erase(pending, entries.end());
  pushed.after = pushed.commit;
}

void WatchedGroup::note_rewritten(const std::vector<PushedValue>& values) {
  std::map<std::uint32_t, std::uint64_t> begun;  // histories by edge
  for (const PushedValue& value : values) {
    if (!value.process_noise) continue;
    const auto [before, is_first] = begun.emplace(value.index, value.history);
    if (!is_first && before->second < value.history) rewritten_.push_back(value.index);
  }
}

PushedValues WatchedGroup::changed(const Forest& forest) {
  if (request_.composed) return next_composed_push(forest);
  const bool newest_only = request_.period > std::chrono::nanoseconds(0);
  auto found = forest.values_since(cursors_, {newest_only, {}, true, request_.of_samples});
  note_rewritten(found.values);
  PushedValues pushed{id_, std::move(found.values), told_, found.commit};
  if (!pushed.entries.empty()) told_ = pushed.commit;
  return pushed;
}

Result<PushedValues> WatchedGroup::composed(const Forest& forest, std::optional<Time> from) const {
  // As if all others were known.
  const SeenSegments seen{UINT64_MAX, from.value_or(Time::max()), !from};
  const std::size_t most = kMaxItems / request_.segments.size();
  // Besides the values at `from` and the newest ones.
  const auto all =
      forest.segments_since(request_.segments, seen, std::max<std::size_t>(most, 2) - 2);
  if (!all) return tl::unexpected(all.error());
  const SegmentValues& newest = all->back();
  if (forest.have_noise(request_.segments)) {
    const PathEnds& first = request_.segments.front();
    return fail(Errc::kInvalidInput,
                "the path from " + quote(first.from) + " to " + quote(first.to) +
                    " cannot be sent as one transform: an edge of it has process noise");
  }
  PushedValues pushed{id_, {}, 0, newest.commit};
  const auto add = [&](const SegmentValues& values) {
    for (PushedValue& entry : entries_of(values, request_.segments))
      pushed.entries.push_back(std::move(entry));
  };
  if (from && newest.stamp && *from < *newest.stamp && most >= 2) {
    Query query;
    query.at = from;
    // If that is not available, what came later must do.
    const auto then = forest.lookup_segments(request_.segments, query);
    if (then && then->history == newest.history) add(*then);
  }
  for (const SegmentValues& values : *all) add(values);
  for (std::size_t i = 0; i < request_.segments.size(); ++i) {
    pushed.entries[i].process_noise = Covariance();
  }
  return pushed;
}

bool WatchedGroup::begins(const PushedValue& entry) const {
  const auto& sent = sent_[entry.index];
  return !sent || entry.history != sent->history;
}

bool WatchedGroup::is_new(const PushedValue& entry) const {
  const auto& sent = sent_[entry.index];
  return begins(entry) || entry.stamp != sent->stamp || entry.cleared != sent->cleared ||
         entry.unsampled != sent->unsampled || !(entry.correlation == sent->correlation) ||
         !same(entry.X, sent->X);
}

PushedValues WatchedGroup::next_composed_push(const Forest& forest) {
  PushedValues pushed{id_, {}, told_, told_};
  const auto& before = sent_.front();
  const bool newest_only = request_.period > std::chrono::nanoseconds(0);
  SeenSegments seen = begun_;
  if (before) seen = {told_, before->stamp.value_or(Time::min()), false};
  seen.newest_only = seen.newest_only || newest_only;
  seen.said = said_;
  const std::size_t most = kMaxItems / request_.segments.size();
  auto all = forest.segments_since(request_.segments, seen, most);
  // Of another history, the watchers have nothing.
  const bool again = all && before && all->back().history != before->history;
  if (again) {
    seen = {0, Time::min(), seen.newest_only};
    all = forest.segments_since(request_.segments, seen, most);
  }
  if (!all) return pushed;
  const SegmentValues& newest = all->back();
  pushed.commit = newest.commit;
  said_ = newest.said;
  std::vector<bool> begun(sent_.size(), false);
  const auto push = [&](PushedValue&& entry) {
    if (begins(entry) && !begun[entry.index]) entry.process_noise = Covariance();
    begun[entry.index] = true;
    pushed.entries.push_back(std::move(entry));
  };
  for (auto earlier = all->begin(); earlier + 1 != all->end(); ++earlier) {
    for (PushedValue& entry : entries_of(*earlier, request_.segments)) {
      if (again || !before || !begins(entry)) push(std::move(entry));
    }
  }
  for (PushedValue& entry : entries_of(newest, request_.segments)) {
    if (!is_new(entry)) continue;
    push(PushedValue(entry));
    sent_[entry.index] = std::move(entry);
  }
  if (!pushed.entries.empty()) told_ = pushed.commit;
  return pushed;
}

std::vector<const PushedValue*> first_samples(const PushedValues& values, std::size_t edges) {
  std::vector<const PushedValue*> first;
  std::vector<bool> seen(edges, false);
  for (const PushedValue& entry : values.entries) {
    if (entry.index >= edges || seen[entry.index] || !entry.stamp) continue;
    seen[entry.index] = true;
    first.push_back(&entry);
  }
  return first;
}

std::vector<PushedValues> pieces_of(PushedValues&& pushed) {
  const std::size_t most = correlated_entries(pushed) > kMaxCorrelated ? kMaxCorrelated : kMaxItems;
  const std::size_t count = std::max<std::size_t>((pushed.entries.size() + most - 1) / most, 1);
  std::vector<PushedValues> pieces;
  if (count == 1) {
    pieces.push_back(std::move(pushed));
    return pieces;
  }
  for (std::size_t i = 0; i < count; ++i) {
    const auto begin = pushed.entries.begin() + static_cast<std::ptrdiff_t>(i * most);
    const auto length = std::min(most, pushed.entries.size() - i * most);
    const auto end = begin + static_cast<std::ptrdiff_t>(length);
    pieces.push_back({pushed.group,
                      {std::make_move_iterator(begin), std::make_move_iterator(end)},
                      pushed.after,
                      pushed.commit,
                      static_cast<std::uint32_t>(i),
                      static_cast<std::uint32_t>(count)});
  }
  return pieces;
}

std::optional<PushedValues> PushedPieces::add(const PushedValues& piece) {
  // A reply may come between pushed pieces.
  if (piece.pieces <= 1) return piece;
  const bool goes_on =
      next_ == piece.piece && piece.commit == whole_.commit && piece.pieces == whole_.pieces;
  if (piece.piece == 0 || !goes_on) drop();
  if (piece.piece != 0 && !goes_on) return std::nullopt;
  size_ += size_of(piece.entries);
  if (size_ > kMost) {
    drop();
    return std::nullopt;
  }
  if (piece.piece == 0) {
    whole_ = piece;
  } else {
    whole_.entries.insert(whole_.entries.end(), piece.entries.begin(), piece.entries.end());
  }
  if (++next_ < piece.pieces) return std::nullopt;
  PushedValues whole = std::move(whole_);
  drop();
  whole.piece = 0;
  whole.pieces = 1;
  return whole;
}

void PushedPieces::drop() {
  whole_ = {};
  next_ = 0;
  size_ = 0;
}

ReceivedGroup::Place ReceivedGroup::place(PushedValues& whole) {
  const bool knows_all = covariances_.fill_in(whole.entries);
  join_histories(whole.entries);
  const Place place{whole.commit <= commit_, knows_all && whole.after <= commit_};
  skip(whole);
  if (place.follows_on) commit_ = std::max(commit_, whole.commit);
  return place;
}

void ReceivedGroup::skip(const PushedValues& whole) { heard_ = std::max(heard_, whole.commit); }

}  // namespace tfdude
