#include <algorithm>
#include <utility>

#include "tree/epoch.hpp"
#include "tree/forest_impl.hpp"

// Lookups of segments that another participant asks for.
namespace tfdude {
namespace {

Result<std::vector<Ends>> all_ends(const Frames& frames, const std::vector<PathEnds>& segments) {
  const std::uint64_t commit = frames.snapshot();
  std::vector<Ends> all;
  all.reserve(segments.size());
  for (const PathEnds& segment : segments) {
    const Version* start = frames.named(segment.from, commit);
    if (start == nullptr) return unknown_start(segment.from);
    const Version* end = frames.named(segment.to, commit);
    if (end == nullptr) return unknown_end(segment.to);
    all.push_back({start, end, commit});
  }
  return all;
}

Result<std::vector<Reached>> values_at(const std::vector<Ends>& segments, std::int64_t t,
                                       const Query& query, PathLookup::Met& met) {
  std::vector<Reached> values;
  values.reserve(segments.size());
  for (const Ends& ends : segments) {
    PathLookup::Met of_this;
    auto X = PathLookup::reach_at(ends, PathLookup::Absent::kMayPass, t, query, of_this);
    if (!X) return tl::unexpected(X.error());
    values.push_back(*std::move(X));
    met.moving = met.moving || of_this.moving;
  }
  return values;
}

// The newest value of each segment. If several have dynamic edges, the common instant is that of
// the oldest.
Result<std::vector<Reached>> newest_values(const std::vector<Ends>& segments, Order order,
                                           PathLookup::Met& met) {
  std::vector<Reached> values;
  values.reserve(segments.size());
  bool mixed = false;
  for (const Ends& ends : segments) {
    PathLookup::Met of_this;
    auto X = PathLookup::reach_newest(ends, PathLookup::Absent::kMayPass, order, of_this);
    if (!X) return tl::unexpected(X.error());
    values.push_back(*std::move(X));
    const HeldVersion* limiting = of_this.limiting;
    if (limiting == nullptr) continue;
    if (met.limiting == nullptr) met.limiting = limiting;
    mixed = mixed || limiting->stamp != met.limiting->stamp;
    if (limiting->stamp < met.limiting->stamp) met.limiting = limiting;
  }
  if (!mixed) return values;
  Query query;
  query.order = order;
  return values_at(segments, met.limiting->stamp, query, met);
}

// The newest history among the edges of these segments.
std::uint64_t newest_history(const std::vector<Ends>& segments) {
  std::uint64_t newest = 0;
  for (const Ends& ends : segments) {
    const Version* a = ends.a;
    const Version* b = ends.b;
    while (a != b) {
      const Version*& here = a->depth >= b->depth ? a : b;
      if (here->above == nullptr) break;
      if (here->held()) newest = std::max(newest, static_cast<const HeldVersion*>(here)->history);
      here = Frames::at(*here->above, ends.commit);
    }
  }
  return newest;
}

// Correlations are reported if any segment has some.
void tell(std::vector<Reached>&& from, std::vector<Transform>& values,
          std::vector<PathCorrelation>& correlations) {
  values.clear();
  for (const auto& one : from) values.push_back(one.X);
  const auto none = [](const auto& one) { return one.correlation.empty(); };
  if (std::all_of(from.begin(), from.end(), none)) return;
  for (auto& one : from) correlations.push_back(std::move(one.correlation));
}

// Adds the edges that each single edge was observed with.
void tell_observed_with(const std::vector<Ends>& edges, SegmentValues& found) {
  const auto edge_of = [](const Ends& ends) -> const HeldVersion* {
    const Version* child = ends.a->depth > ends.b->depth ? ends.a : ends.b;
    return child->held() ? static_cast<const HeldVersion*>(child) : nullptr;
  };
  found.correlations.resize(edges.size());
  for (std::size_t i = 0; i < edges.size(); ++i) {
    const HeldVersion* edge = edge_of(edges[i]);
    if (edge == nullptr || edge->correlation == nullptr) continue;
    found.correlations[i].observed_with = edge->correlation->now.observed_with;
  }
}

}  // namespace

Result<SegmentValues> Forest::lookup_segments(const std::vector<PathEnds>& segments,
                                              const Query& query, std::optional<Time> hint,
                                              bool edges) const {
  const epoch::Guard guard;
  const auto ends = all_ends(impl_->frames_, segments);
  if (!ends) return tl::unexpected(ends.error());
  SegmentValues found;
  if (!ends->empty()) found.commit = ends->front().commit;
  found.history = newest_history(*ends);
  PathLookup::Met met;
  auto t = query.at;
  if (!t) {
    auto newest = newest_values(*ends, query.order, met);
    if (!newest) return tl::unexpected(std::move(newest.error()));
    tell(*std::move(newest), found.values, found.correlations);
    if (const HeldVersion* limiting = met.limiting) {
      found.stamp = time_of(limiting->stamp);
      const std::int64_t before =
          limiting->number > 0 ? limiting->samples->stamp(limiting->number - 1) : kAlways;
      if (before != kAlways) found.period = std::chrono::nanoseconds(limiting->stamp - before);
      if (query.age_noise_until) t = found.stamp;
    }
  }
  if (t) {
    auto values = values_at(*ends, nanoseconds(*t), query, met);
    if (!values) return tl::unexpected(std::move(values.error()));
    found.correlations.clear();
    tell(*std::move(values), found.values, found.correlations);
    if (met.moving) found.stamp = t;
  }
  if (edges) tell_observed_with(*ends, found);
  if (hint && found.stamp && hint != found.stamp) {
    auto values = values_at(*ends, nanoseconds(*hint), query, met);
    if (values) tell(*std::move(values), found.at_hint, found.correlations_at_hint);
  }
  return found;
}

}  // namespace tfdude
