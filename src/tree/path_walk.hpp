#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>
#include <utility>

#include "tfdude/base/id.hpp"

#include "math/instant_sources.hpp"
#include "tree/edge_values.hpp"
#include "tree/frames.hpp"
#include "tree/path_lookup.hpp"
#include "tree/remote_edges.hpp"
#include "tree/unspecified_edges.hpp"

// Walks from both ends of a path to their common ancestor. The caller holds an epoch::Guard.
namespace tfdude {

template <class Value>
PathAccumulation<Value> begin_path(Order order) {
  if constexpr (std::is_same_v<Value, Belief>) {
    return PathAccumulation<Belief>(order);
  } else {
    return PathAccumulation<Value>();
  }
}

/// Lets `take` add an edge to the accumulation, with the correlation that it has now.
template <class Value, class Edge, class Take>
Result<void> pass(PathAccumulation<Value>& path, const Edge& edge, Take& take) {
  if constexpr (std::is_same_v<Value, Belief>) {
    typename Edge::Copy copy;
    const Correlation* now = nullptr;
    if (!edge.find_now(copy, now)) return not_readable();
    correlate_next(path, now);
    return take(path, edge);
  } else {
    return take(path, edge);
  }
}

/// The walk that all lookups share. `take` gets the accumulation of an edge, and the edge, whose
/// value it adds. The walk stops at an error of `take`.
/// @param others  finds edges that others hold: OwnEdgesOnly, or RemoteReading, and errors have no
///   text
template <class Value, class Others, class Take>
Result<void> walk(const Ends& ends, PathLookup::Absent absent, Order order, Others& others,
                  Take take, Value& X_AB) {
  if constexpr (!Others::kNone) others.begin_walk();
  const Version* a = ends.a;
  const Version* b = ends.b;
  PathAccumulation<Value> path_a = begin_path<Value>(order);
  PathAccumulation<Value> path_b = begin_path<Value>(order);
  // From the first error on only errors matter. kNotConnected has priority over kNotOwner, and that
  // over others.
  std::optional<Error> error;
  while (a != b) {
    const bool from_a = a->depth >= b->depth;
    const Version*& here = from_a ? a : b;
    const bool top =
        absent == PathLookup::Absent::kEnds ? here->depth == 0 : here->above == nullptr;
    if (top) return not_connected(ends);
    PathAccumulation<Value>& path = from_a ? path_a : path_b;
    if (here->held()) {
      if (!error) {
        Result<void> taken = pass(path, OwnEdge{static_cast<const HeldVersion*>(here)}, take);
        if (!taken) error = std::move(taken.error());
      }
    } else if constexpr (!Others::kNone) {
      const RemoteEdge edge = others.find(*here);
      if (edge.version == nullptr) return no_data(Errc::kNotOwner);
      if (Result<void> taken = pass(path, edge, take); !taken) return taken;
    } else if (!error || error->code != Errc::kNotOwner) {
      // A path to others may have many such edges.
      error = Error{Errc::kNotOwner,
                    "the edge of " + quote(here->name->text) + " is owned by another partition"};
    }
    here = Frames::at(*here->above, ends.commit);
  }
  if (error) return tl::unexpected(*std::move(error));
  join(std::move(path_a), std::move(path_b), X_AB);
  return {};
}

// Only a Belief can represent correlation.
template <class Value>
bool leaves_out_correlation(const HeldVersion& edge) {
  return std::is_same_v<Value, Transform> && edge.correlation != nullptr;
}

/// X_AB at an instant. @param sources  null: errors of sources have the names that edges say
template <class Value, class Others>
Result<void> walk_once_at(const Ends& ends, PathLookup::Absent absent,
                          const PathLookup::Instant& at, const Query& query, Others& others,
                          SourceInstants* sources, PathLookup::Met& met, Value& X_AB) {
  std::int64_t age = 0;
  if (query.age_noise_until) {
    age = std::max(saturating_subtract(nanoseconds(*query.age_noise_until), at.t), age);
  }
  // An edge without samples is behind every instant.
  Moment moment{std::max(at.t, kNoSample + 1), age, query, at.common};
  moment.sources = sources;
  const auto take = [&](auto& path, const auto& from) -> Result<void> {
    const HeldVersion& edge = *from.version;
    if (leaves_out_correlation<Value>(edge)) met.correlated = true;
    if (edge.moving()) {
      met.moving = true;
      Result<void> taken = accumulate_at<Value>(path, from, moment);
      met.correlated = met.correlated || (std::is_same_v<Value, Transform> && moment.correlated);
      return taken;
    }
    tell_instants(path, moment, kLasting);
    if (!met.correlated) path.up(value_of<Value>(edge));
    return {};
  };
  return walk(ends, absent, query.order, others, take, X_AB);
}
template <class Value, class Others>
Result<void> walk_at(const Ends& ends, PathLookup::Absent absent, const PathLookup::Instant& at,
                     const Query& query, Others& others, PathLookup::Met& met, Value& X_AB) {
  if constexpr (std::is_same_v<Value, Belief>) {
    SourceInstants sources;
    auto found = walk_once_at(ends, absent, at, query, others, &sources, met, X_AB);
    if (!found || !sources.begin_naming(absent == PathLookup::Absent::kMayPass)) return found;
    return walk_once_at(ends, absent, at, query, others, &sources, met, X_AB);
  }
  return walk_once_at(ends, absent, at, query, others, nullptr, met, X_AB);
}

/// X_AB at the latest common time: that of the newest sample of Met::limiting.
template <class Value, class Others>
Result<void> walk_newest(const Ends& ends, PathLookup::Absent absent, Order order, Others& others,
                         PathLookup::Met& met, Value& X_AB) {
  // Usually all dynamic edges have their newest sample at the same instant, or none is dynamic.
  // Then the stored values are used unchanged.
  const HeldVersion* limiting = nullptr;
  bool mixed = false;
  bool correlated = false;
  const auto take = [&](auto& path, const auto& from) -> Result<void> {
    const HeldVersion& edge = *from.version;
    if (edge.limits()) {
      if (limiting == nullptr) limiting = &edge;
      if (edge.stamp != limiting->stamp) {
        mixed = true;
        if (edge.stamp < limiting->stamp) limiting = &edge;
      }
    }
    if (leaves_out_correlation<Value>(edge)) correlated = true;
    if (!mixed && !correlated) path.up(value_of<Value>(edge));
    return {};
  };
  auto newest = walk(ends, absent, order, others, take, X_AB);
  met = {limiting, limiting != nullptr, correlated};
  // An edge without a sample has the earliest of all stamps.
  if (newest && limiting != nullptr && limiting->lacks_sample()) return no_data(Errc::kNotYet);
  if (!newest || !mixed || correlated) return newest;
  Query query;
  query.order = order;
  return walk_at(ends, absent, {limiting->stamp, true}, query, others, met, X_AB);
}

inline Result<void> hand_over(Belief&& X_AB, const Output& output) {
  output.X = {X_AB.pose, X_AB.own};
  output.X.covariance.set_complete(!X_AB.unspecified);
  output.correlation = {std::move(X_AB.unknown), std::move(X_AB.common_errors), {}};
  return {};
}

/// As walk_newest() and walk_at(), with the correlation, if there is any.
template <class Others>
Result<void> reach_newest(const Ends& ends, PathLookup::Absent absent, Order order, Others& others,
                          PathLookup::Met& met, Output X_AB) {
  if (order == Order::kSecond) {
    auto plain = walk_newest(ends, absent, order, others, met, X_AB.X);
    if (!plain || !met.correlated) return plain;
  }
  met = {};
  Belief whole;
  auto walked = walk_newest(ends, absent, order, others, met, whole);
  return walked ? hand_over(std::move(whole), X_AB) : walked;
}
template <class Others>
Result<void> reach_at(const Ends& ends, PathLookup::Absent absent, const PathLookup::Instant& at,
                      const Query& query, Others& others, PathLookup::Met& met, Output X_AB) {
  if (query.order == Order::kSecond) {
    auto plain = walk_at(ends, absent, at, query, others, met, X_AB.X);
    if (!plain || !met.correlated) return plain;
  }
  met = {};
  Belief whole;
  auto walked = walk_at(ends, absent, at, query, others, met, whole);
  return walked ? hand_over(std::move(whole), X_AB) : walked;
}

/// X_AB at the latest common time.
template <class Others>
Result<void> compute_newest(const Ends& ends, Others& others, Pose& X_AB) {
  PathLookup::Met met;
  return walk_newest(ends, PathLookup::Absent::kEnds, Order::kSecond, others, met, X_AB);
}

/// Whether what observations have removed is better subtracted at A: as seen from B, as from the
/// centre of the Earth, levers make the errors so large that the difference would lose its digits.
[[nodiscard]] inline bool cancels_at_a(const Belief& X_AB) {
  constexpr double kMuchLarger = 1e6;
  const auto& errors = X_AB.common_errors;
  const bool any = std::any_of(errors.begin(), errors.end(),
                               [](const CommonError& one) { return one.subtracts; });
  if (!any) return false;
  const Covariance at_a = inverse(Transform{X_AB.pose, X_AB.own}).covariance.of_specified();
  return X_AB.own.matrix().trace() > kMuchLarger * at_a.matrix().trace();
}

/// What a query asks for.
/// @param turned  of the path from B to A instead
template <class Others>
Result<void> compute_queried(const Ends& ends, const Query& query, Others& others,
                             StampedTransform& X_AB, bool turned = false) {
  PathLookup::Met met;
  PathCorrelation correlation;
  const Output output{X_AB, correlation};
  std::optional<Time> at = query.at;
  if (!at) {
    auto newest = reach_newest(ends, PathLookup::Absent::kEnds, query.order, others, met, output);
    if (!newest) return newest;
    if (met.moving) at = time_of(met.limiting->stamp);
  }
  if (query.at || (at && query.age_noise_until)) {
    met = {};
    const PathLookup::Instant instant{nanoseconds(*at), !query.at};
    auto then = reach_at(ends, PathLookup::Absent::kEnds, instant, query, others, met, output);
    if (!then) return then;
  }
  if (!met.moving) at.reset();
  X_AB.stamp = at;
  X_AB.basis.order = query.order;
  const bool complete = X_AB.covariance.complete();
  if (correlation.empty() && complete) return {};
  const Belief whole = belief_of(X_AB, correlation);
  if (!turned && query.order == Order::kSecond && cancels_at_a(whole)) {
    StampedTransform X_BA;
    auto back = compute_queried({ends.b, ends.a, ends.commit}, query, others, X_BA, true);
    if (!back) return back;
    std::reverse(X_BA.basis.unspecified.begin(), X_BA.basis.unspecified.end());
    X_AB = {inverse(X_BA), X_BA.stamp, std::move(X_BA.basis)};
    return {};
  }
  X_AB = collapsed(whole, query.order, at);
  if (!complete) {
    X_AB.basis.unspecified = unspecified_edges(ends, at ? nanoseconds(*at) : kAlways, others);
  }
  return {};
}

}  // namespace tfdude
