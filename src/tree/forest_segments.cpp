#include <algorithm>
#include <functional>
#include <utility>
#include <vector>

#include "tfdude/base/id.hpp"
#include "tfdude/math/interpolate.hpp"

#include "math/finite.hpp"
#include "tree/changed_instants.hpp"
#include "tree/edge_marks.hpp"
#include "tree/epoch.hpp"
#include "tree/forest_impl.hpp"
#include "tree/held_edges.hpp"
#include "tree/no_data.hpp"
#include "tree/path_walk.hpp"
#include "tree/read_intact.hpp"
#include "tree/remote_edges.hpp"
#include "tree/unspecified_edges.hpp"

// Lookups of segments that another participant asks for.
namespace tfdude {
namespace {

// The segments of an honest request are parts of one path. Few of them need no check: a path has at
// most as many edges as there are frames.
Result<void> check_edges(const std::vector<Ends>& segments) {
  constexpr std::size_t kFew = 16;
  constexpr std::size_t kMostEdges = 65'536;
  if (segments.size() <= kFew) return {};
  std::size_t edges = 0;
  for (const Ends& ends : segments) {
    const Version* a = ends.a;
    const Version* b = ends.b;
    for (; a != b && edges <= kMostEdges; ++edges) {
      const Version*& lower = a->depth >= b->depth ? a : b;
      if (lower->above == nullptr) break;
      lower = Frames::at(*lower->above, ends.commit);
    }
  }
  if (edges <= kMostEdges) return {};
  return fail(Errc::kTooMuch, "the " + std::to_string(segments.size()) +
                                  " segments have more than " + std::to_string(kMostEdges) +
                                  " edges");
}

// Each segment is to be one edge. To tell the rows of one that drifts may take a walk over its
// samples, so that is done once.
Result<void> check_single_edges(const std::vector<Ends>& segments, Rows rows) {
  std::vector<const Version*> children;
  for (const Ends& ends : segments) {
    const auto is_below = [&](const Version* child, const Version* parent) {
      return child->above != nullptr && Frames::at(*child->above, ends.commit) == parent;
    };
    const bool down = is_below(ends.b, ends.a);
    if (!down && !is_below(ends.a, ends.b)) {
      return fail(Errc::kNotOwner, "there is no edge between " + quote(ends.a->name->text) +
                                       " and " + quote(ends.b->name->text));
    }
    children.push_back(down ? ends.b : ends.a);
  }
  if (rows != Rows::kOfPath) return {};
  std::sort(children.begin(), children.end(), std::less<>());
  const auto twice = std::adjacent_find(children.begin(), children.end());
  if (twice == children.end()) return {};
  return fail(Errc::kInvalidInput,
              "the edge of frame " + quote((*twice)->name->text) + " is asked for twice");
}

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
  if (auto ok = check_edges(all); !ok) return tl::unexpected(std::move(ok.error()));
  return all;
}

// The value of a segment, with its correlation if there is any.
struct Reached {
  Transform X;
  PathCorrelation correlation;

  [[nodiscard]] Output output() { return {X, correlation}; }
};

// As of PathLookup, and over edges that others hold.
struct Own {
  static constexpr auto kAbsent = PathLookup::Absent::kMayPass;

  static Result<void> reach_newest(const Ends& ends, Order order, PathLookup::Met& met,
                                   Output output) {
    return PathLookup::reach_newest(ends, kAbsent, order, met, output);
  }
  static Result<void> reach_at(const Ends& ends, const PathLookup::Instant& at, const Query& query,
                               PathLookup::Met& met, Output output) {
    return PathLookup::reach_at(ends, kAbsent, at, query, met, output);
  }
  static std::vector<std::string> unspecified(const Ends& ends, std::int64_t t) {
    return unspecified_edges(ends, t);
  }
};
struct Others {
  RemoteReading& reading;

  Result<void> reach_newest(const Ends& ends, Order order, PathLookup::Met& met,
                            Output output) const {
    return tfdude::reach_newest(ends, Own::kAbsent, order, reading, met, output);
  }
  Result<void> reach_at(const Ends& ends, const PathLookup::Instant& at, const Query& query,
                        PathLookup::Met& met, Output output) const {
    return tfdude::reach_at(ends, Own::kAbsent, at, query, reading, met, output);
  }
  std::vector<std::string> unspecified(const Ends& ends, std::int64_t t) const {
    return unspecified_edges(ends, t, reading);
  }
};

template <class From>
Result<std::vector<Reached>> values_at(const From& from, const std::vector<Ends>& segments,
                                       const PathLookup::Instant& at, const Query& query,
                                       PathLookup::Met& met) {
  std::vector<Reached> values;
  values.reserve(segments.size());
  for (const Ends& ends : segments) {
    PathLookup::Met of_this;
    auto ok = from.reach_at(ends, at, query, of_this, values.emplace_back().output());
    if (!ok) return tl::unexpected(std::move(ok.error()));
    met.moving = met.moving || of_this.moving;
  }
  return values;
}

// The newest value of each segment. If several have dynamic edges, the common instant is that of
// the oldest.
template <class From>
Result<std::vector<Reached>> newest_values(const From& from, const std::vector<Ends>& segments,
                                           Order order, PathLookup::Met& met) {
  std::vector<Reached> values;
  values.reserve(segments.size());
  bool mixed = false;
  for (const Ends& ends : segments) {
    PathLookup::Met of_this;
    auto ok = from.reach_newest(ends, order, of_this, values.emplace_back().output());
    if (!ok) return tl::unexpected(std::move(ok.error()));
    const HeldVersion* limiting = of_this.limiting;
    if (limiting == nullptr) continue;
    if (met.limiting == nullptr) met.limiting = limiting;
    mixed = mixed || limiting->stamp != met.limiting->stamp;
    if (limiting->stamp < met.limiting->stamp) met.limiting = limiting;
  }
  if (!mixed) return values;
  Query query;
  query.order = order;
  return values_at(from, segments, {met.limiting->stamp, true}, query, met);
}

// The newest history among the edges of these segments.
std::uint64_t newest_history(const std::vector<Ends>& segments) {
  std::uint64_t newest = 0;
  for_each_held(segments,
                [&](const HeldVersion& edge) { newest = std::max(newest, edge.history); });
  return newest;
}

void describe(const std::vector<Ends>& segments, SegmentValues& found) {
  if (!segments.empty()) found.commit = segments.front().commit;
  found.history = newest_history(segments);
}

// What was reached on the segments, at an instant. Correlations are reported if any segment has
// some.
template <class From>
SegmentValues values_of(const From& from, const std::vector<Ends>& segments,
                        std::vector<Reached>&& reached, std::int64_t t) {
  SegmentValues found;
  for (std::size_t i = 0; i < reached.size(); ++i) {
    found.values.push_back(reached[i].X);
    if (reached[i].X.covariance.complete()) continue;
    for (std::string& id : from.unspecified(segments[i], t)) {
      found.unspecified.push_back({i, std::move(id)});
    }
  }
  const auto none = [](const auto& one) { return one.correlation.empty(); };
  if (std::all_of(reached.begin(), reached.end(), none)) return found;
  for (auto& one : reached) {
    fold_samples(one.correlation);
    found.correlations.push_back(std::move(one.correlation));
  }
  return found;
}

template <class From>
Result<SegmentValues> segments_at(const From& from, const std::vector<Ends>& segments,
                                  const PathLookup::Instant& at, const Query& query) {
  PathLookup::Met met;
  auto values = values_at(from, segments, at, query, met);
  if (!values) return tl::unexpected(std::move(values.error()));
  SegmentValues found = values_of(from, segments, *std::move(values), at.t);
  if (met.moving) found.stamp = time_of(at.t);
  return found;
}

template <class From>
Result<SegmentValues> newest_segments(const From& from, const std::vector<Ends>& segments,
                                      const Query& query) {
  PathLookup::Met met;
  auto values = newest_values(from, segments, query.order, met);
  if (!values) return tl::unexpected(std::move(values.error()));
  const HeldVersion* limiting = met.limiting;
  SegmentValues found = values_of(from, segments, *std::move(values),
                                  limiting != nullptr ? limiting->stamp : kAlways);
  if (limiting == nullptr) return found;
  found.stamp = time_of(limiting->stamp);
  // Others are asked for their newest instant at no cost, so none is guessed.
  if constexpr (!std::is_same_v<From, Own>) return found;
  const std::int64_t before =
      limiting->number > 0 ? limiting->samples->stamp(limiting->number - 1) : kAlways;
  if (before != kAlways) found.period = std::chrono::nanoseconds(limiting->stamp - before);
  return found;
}

// The newest values, or that an edge has lost its samples. If one had none yet, they are those of
// no instant.
Result<SegmentValues> newest_or_cleared(const std::vector<Ends>& segments) {
  auto newest = newest_segments(Own(), segments, {});
  if (newest) {
    for_each_held(segments, [&](const HeldVersion& edge) {
      newest->unsampled = newest->unsampled || edge.unsampled();
    });
    if (newest->unsampled) newest->stamp.reset();
  }
  if (newest || newest.error().code != Errc::kNotYet) return newest;
  SegmentValues none;
  none.values.resize(segments.size());
  none.cleared = true;
  return none;
}

// Those that a request asks for.
template <class From>
Result<SegmentValues> asked_segments(const From& from, const std::vector<Ends>& segments,
                                     const Query& query, std::optional<Time> hint) {
  const bool common = hint == query.at;
  Result<SegmentValues> found =
      query.at ? segments_at(from, segments, {nanoseconds(*query.at), common}, query)
               : newest_segments(from, segments, query);
  if (found && !query.at && found->stamp && query.age_noise_until) {
    const std::chrono::nanoseconds period = found->period;
    found = segments_at(from, segments, {nanoseconds(*found->stamp), true}, query);
    if (found) found->period = period;
  }
  if (found && hint && found->stamp && hint != found->stamp) {
    auto at_hint = segments_at(from, segments, {nanoseconds(*hint), true}, query);
    if (at_hint) found->at_hint = static_cast<ValuesAtInstant&&>(*at_hint);
  }
  return found;
}

bool all_finite(const ValuesAtInstant& found) {
  const auto finite = [](const Transform& X) { return is_finite(X); };
  const auto sound = [&](const PathCorrelation& one) {
    return (!one.unknown || finite({Pose(), *one.unknown})) &&
           check_common_errors(one.common_errors).has_value();
  };
  return std::all_of(found.values.begin(), found.values.end(), finite) &&
         std::all_of(found.correlations.begin(), found.correlations.end(), sound);
}

}  // namespace

Result<SegmentValues> Forest::lookup_segments(const std::vector<PathEnds>& segments,
                                              const Query& query, std::optional<Time> hint,
                                              bool edges, Rows rows) const {
  const epoch::Guard guard;
  const auto find = [&]() -> Result<std::vector<Ends>> {
    auto ends = all_ends(impl_->frames_, segments);
    if (!ends || !edges) return ends;
    auto single = check_single_edges(*ends, rows);
    if (!single) return tl::unexpected(std::move(single.error()));
    return ends;
  };
  const auto answer = [&](const std::vector<Ends>& ends) {
    Result<SegmentValues> found = asked_segments(Own(), ends, query, hint);
    if (!found) {
      found = tl::unexpected(explained(std::move(found.error()), ends, query, impl_->now_));
      return found;
    }
    describe(ends, *found);
    if (edges) tell_observed_with(ends, rows, *found);
    return found;
  };
  if (query.believed_at) {
    std::optional<FormerEdges> former;
    const auto then = impl_->go_back(former, query, hint, find);
    return then ? answer(*then) : tl::unexpected(then.error());
  }
  const auto ends = find();
  return ends ? answer(*ends) : tl::unexpected(ends.error());
}

Result<SegmentValues> Forest::lookup_segments(const std::vector<PathEnds>& segments,
                                              const Query& query, std::optional<Time> hint,
                                              const RemoteEdges& others, bool motion,
                                              std::optional<Time> timed_since) const {
  if (query.believed_at) return not_readable();
  const epoch::Guard guard;
  const auto ends = all_ends(impl_->frames_, segments);
  if (!ends) return tl::unexpected(ends.error());
  RemoteReading reading(others);
  Result<SegmentValues> found;
  const auto read = [&](RemoteReading& now, SegmentValues& values) -> Result<void> {
    auto asked = asked_segments(Others{now}, *ends, query, hint);
    if (!asked) return tl::unexpected(std::move(asked.error()));
    values = *std::move(asked);
    values.commit = now.commit();
    if (motion && !tell_motion(*ends, timed_since, now, values)) return not_readable();
    return {};
  };
  if (!read_intact(reading, found, read) ||
      (found && !(all_finite(*found) && all_finite(found->at_hint))))
    return not_readable();
  return found;
}

Result<std::vector<SegmentValues>> Forest::segments_since(const std::vector<PathEnds>& segments,
                                                          const SeenSegments& seen,
                                                          std::size_t most) const {
  const epoch::Guard guard;
  const auto ends = all_ends(impl_->frames_, segments);
  if (!ends) return tl::unexpected(ends.error());
  auto newest = newest_or_cleared(*ends);
  if (!newest) {
    return tl::unexpected(explained(std::move(newest.error()), *ends, {}, impl_->now_));
  }
  describe(*ends, *newest);
  newest->said = said_of(*ends);
  std::vector<SegmentValues> all;
  if (newest->stamp) {
    const auto instants = changed_instants(*ends, seen, newest->said);
    const auto end =
        std::lower_bound(instants.begin(), instants.end(), nanoseconds(*newest->stamp));
    const auto count = std::min(static_cast<std::size_t>(end - instants.begin()), most);
    for (auto t = end - static_cast<std::ptrdiff_t>(count); t != end; ++t) {
      auto then = segments_at(Own(), *ends, {*t}, {});
      if (!then) continue;  // another edge has begun later
      then->commit = newest->commit;
      then->history = newest->history;
      all.push_back(*std::move(then));
    }
  }
  all.push_back(*std::move(newest));
  return all;
}

Result<void> Forest::check_timed(const std::vector<PathEnds>& segments, Time at) const {
  const epoch::Guard guard;
  const auto ends = all_ends(impl_->frames_, segments);
  if (!ends) return tl::unexpected(ends.error());
  const HeldVersion* untimed = nullptr;
  for_each_held(*ends, [&](const HeldVersion& edge) {
    if (!edge.moving() || edge.lacks_sample()) return;
    if (!edge.samples->is_timed_since(nanoseconds(at), edge.number)) untimed = &edge;
  });
  if (untimed == nullptr) return {};
  return fail(Errc::kInvalidInput,
              "the edge of " + quote(untimed->name->text) +
                  " has samples that came without a stamp: when they arrived tells no velocity");
}

bool Forest::have_noise(const std::vector<PathEnds>& segments) const {
  const epoch::Guard guard;
  const auto ends = all_ends(impl_->frames_, segments);
  bool found = false;
  if (!ends) return found;
  for_each_held(*ends, [&](const HeldVersion& edge) {
    found = found || (edge.samples != nullptr && edge.samples->has_noise());
  });
  return found;
}

}  // namespace tfdude
