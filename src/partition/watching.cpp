#include "tfdude/partition/watching.hpp"

#include <algorithm>
#include <utility>

#include "tfdude/base/id.hpp"

namespace tfdude {
namespace {

// FNV-1a with 64 bits; each text ends with a zero, which none contains.
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

// As an edge: what a segment has of its own counts as unknown, too, where a part of it is.
void tie(News& entry, const Ties& ties) {
  entry.correlation.shares = ties.shares;
  if (!ties.unknown) return;
  entry.correlation.unknown = true;
  entry.X.covariance = bound(entry.X.covariance, *ties.unknown);
}

std::vector<News> entries_of(const SegmentValues& found) {
  std::vector<News> entries;
  for (std::uint32_t i = 0; i < found.values.size(); ++i) {
    entries.push_back({i, found.stamp, found.values[i], {}});
    if (!found.ties.empty()) tie(entries.back(), found.ties[i]);
  }
  return entries;
}

bool same(const Transform& a, const Transform& b) {
  return a.pose.matrix() == b.pose.matrix() && a.covariance.upper() == b.covariance.upper();
}

}  // namespace

std::size_t tied_entries(const State& state) {
  return static_cast<std::size_t>(
      std::count_if(state.entries.begin(), state.entries.end(),
                    [](const News& entry) { return !entry.correlation.empty(); }));
}

std::uint64_t watch_group(std::string_view partition, const WatchRequest& request) {
  Fingerprint print;
  print.add(partition);
  print.add(static_cast<std::uint64_t>(request.period.count()));
  for (const std::string& edge : request.edges) print.add(edge);
  print.add(request.segments.size());
  for (const PathEnds& ends : request.segments) {
    print.add(ends.from);
    print.add(ends.to);
  }
  return print.value();
}

Result<State> WatchedGroup::snapshot(const Forest& forest) {
  if (!request_.segments.empty()) {
    auto found = forest.lookup_segments(request_.segments);
    if (!found) return tl::unexpected(std::move(found.error()));
    return State{id_, entries_of(*found)};
  }
  std::vector<EdgeCursor> cursors;
  for (const std::string& edge : request_.edges) {
    const auto frame = forest.find(edge);
    if (!frame || !forest.holds(edge)) {
      return fail(Errc::kNotOwner, "frame " + quote(edge) + " is not of this partition");
    }
    cursors.push_back({*frame, std::nullopt, 0});
  }
  // Frames that were removed and added again have other handles.
  const auto moved = [](const EdgeCursor& a, const EdgeCursor& b) {
    return a.frame.slot == b.frame.slot && a.frame.generation == b.frame.generation;
  };
  if (cursors_.size() != cursors.size() ||
      !std::equal(cursors.begin(), cursors.end(), cursors_.begin(), moved)) {
    cursors_ = cursors;
  }
  return State{id_, forest.news(cursors, true)};
}

State WatchedGroup::news(const Forest& forest) {
  if (!request_.segments.empty()) return composed_news(forest);
  const bool newest_only = request_.period > std::chrono::nanoseconds(0);
  return {id_, forest.news(cursors_, newest_only)};
}

State WatchedGroup::composed_news(const Forest& forest) {
  State state{id_, {}};
  const auto found = forest.lookup_segments(request_.segments);
  if (!found) return state;
  sent_.resize(found->values.size());
  for (News& entry : entries_of(*found)) {
    const auto& sent = sent_[entry.index];
    const bool again = sent && entry.stamp == sent->stamp &&
                       entry.correlation == sent->correlation &&
                       (entry.stamp || same(entry.X, sent->X));
    if (again) continue;
    sent_[entry.index] = entry;
    state.entries.push_back(std::move(entry));
  }
  return state;
}

}  // namespace tfdude
