#include "tree/path_lookup.hpp"

#include <algorithm>
#include <cmath>
#include <type_traits>
#include <utility>

#include "tfdude/base/id.hpp"
#include "tfdude/math/interpolate.hpp"

#include "base/saturating.hpp"
#include "math/path_accumulation.hpp"
#include "tree/epoch.hpp"
#include "tree/no_data.hpp"
#include "tree/revised_sample.hpp"
#include "tree/unspecified_edges.hpp"

namespace tfdude {
namespace {

// The type of an edge's value that a walk accumulates; for a Belief it is a Transform.
template <class Value>
using OfEdge = std::conditional_t<std::is_same_v<Value, Pose>, Pose, Transform>;

template <class Value>
const OfEdge<Value>& value_of(const HeldVersion& version) {
  if constexpr (std::is_same_v<Value, Pose>) {
    return version.X_PC.pose;
  } else {
    return version.X_PC;
  }
}

template <class Value>
OfEdge<Value> value_of(const Sample& sample) {
  if constexpr (std::is_same_v<Value, Pose>) {
    return sample.value_pose();
  } else {
    return sample.value();
  }
}

double seconds(std::int64_t nanoseconds) { return static_cast<double>(nanoseconds) * 1e-9; }

void add_noise(Pose&, const HeldVersion&, double) {}
void add_noise(Transform& X, const HeldVersion& edge, double seconds) {
  if (!X.covariance.complete()) return;
  const Covariance::Upper& rate = edge.samples->timing().process_noise.upper();
  Covariance::Upper sum = X.covariance.of_specified().upper();
  for (std::size_t i = 0; i < sum.size(); ++i) sum[i] += seconds * rate[i];
  X.covariance = Covariance::trusted(sum);
}

// The text is added by explained(), where all edges are known.
tl::unexpected<Error> no_data(Errc code) { return fail(code, {}); }

// Two samples that an instant is extrapolated from.
struct Newest {
  const Sample* before = nullptr;
  const Sample* newest = nullptr;
};

// Those of the edge, if it may be extrapolated so far.
Result<Newest> newest_of(const HeldVersion& edge, std::int64_t t, const Query& query) {
  if (edge.lacks_sample()) return no_data(Errc::kNotYet);
  const std::int64_t beyond = t - edge.stamp;
  if (beyond > query.extrapolate.count() || beyond > edge.samples->reach(edge.number)) {
    return no_data(Errc::kNotYet);
  }
  const Newest found{
      edge.number > edge.samples->oldest() ? edge.samples->sample(edge.number - 1) : nullptr,
      edge.samples->sample(edge.number)};
  if (found.before == nullptr || found.newest == nullptr) return no_data(Errc::kNotYet);
  return found;
}

const Correlation* said_of(const HeldVersion& edge) {
  return edge.correlation != nullptr ? &edge.correlation->said : nullptr;
}

// How the error of the edge that is accumulated next is correlated.
template <class Value>
void correlate_next(PathAccumulation<Value>& path, const Correlation* correlation) {
  if constexpr (std::is_same_v<Value, Belief>) {
    if (correlation == nullptr) {
      path.correlate_next(false, nullptr);
    } else {
      path.correlate_next(correlation->unknown, &correlation->common_errors);
    }
  }
}

// The instant of a walk.
struct Moment {
  std::int64_t t;
  std::int64_t age;  // adds the process noise until then
  const Query& query;
  bool common;              // as of PathLookup::Instant
  std::uint64_t back = 0;   // see SampleHistory::around()
  bool correlated = false;  // a sample has a correlation of its own
};

// Accumulates an edge beyond its newest sample.
template <class Value>
Result<void> accumulate_beyond(PathAccumulation<Value>& path, const HeldVersion& edge,
                               Moment& moment) {
  const auto found = newest_of(edge, moment.t, moment.query);
  if (!found) return tl::unexpected(found.error());
  const auto [before, newest] = *found;
  const double span = seconds(edge.stamp - before->stamp);
  const double beyond = seconds(moment.t - edge.stamp);
  const double s = 1.0 + beyond / span;
  const bool revised = before->revision() != nullptr || newest->revision() != nullptr;
  moment.correlated = moment.correlated || is_correlated(*newest);
  // A random walk of this density has also moved the sample before, by which the twist is wrong.
  const double noise = beyond * s + seconds(moment.age);
  if constexpr (!std::is_same_v<Value, Pose>) {
    if (revised || said_of(edge) != nullptr) {
      CorrelatedValue ahead = extrapolate_correlated(*before, *newest, edge.X_PC, s, said_of(edge),
                                                     edge.samples->timing().drifts);
      correlate_next(path, &ahead.correlation);
      Transform& X = path.place();
      X = ahead.X_PC;
      add_noise(X, edge, noise);
      path.up(X);
      return {};
    }
  }
  OfEdge<Value>& X = path.place();
  extrapolate(*before, *newest, value_of<Value>(edge), s, X);
  add_noise(X, edge, noise);
  path.up(X);
  return {};
}

// Accumulates an edge whose instant is that of a sample, with this value.
template <class Value>
void accumulate_sample(PathAccumulation<Value>& path, const HeldVersion& edge,
                       const OfEdge<Value>& X_PC, std::int64_t age) {
  if (age == 0 || !edge.samples->has_noise()) return path.up(X_PC);
  OfEdge<Value>& X = path.place();
  X = X_PC;
  add_noise(X, edge, seconds(age));
  path.up(X);
}

// Accumulates an edge between two samples.
template <class Value>
void accumulate_between(PathAccumulation<Value>& path, const HeldVersion& edge,
                        const SampleHistory::Bracket& samples, Moment& moment) {
  const Sample& before = *samples.before;
  const Sample& after = *samples.after;
  const auto span = static_cast<double>(after.stamp - before.stamp);
  const double s = static_cast<double>(moment.t - before.stamp) / span;
  const bool noisy = edge.samples->has_noise();
  if (!noisy && before.is_given_pose() && after.is_given_pose()) {
    correlate_next(path, said_of(edge));
    path.up_between(before.parts(), after.parts(), s);
    return;
  }
  const double noise = seconds(moment.age) + s * (1.0 - s) * span * 1e-9;
  if (is_correlated(before) || is_correlated(after)) {
    moment.correlated = true;
    if constexpr (std::is_same_v<Value, Belief>) {
      CorrelatedValue value = interpolate_observed(before, after, s, said_of(edge));
      if (noisy) add_noise(value.X_PC, edge, noise);
      correlate_next(path, &value.correlation);
      path.up(value.X_PC);
      return;
    }
  }
  correlate_next(path, said_of(edge));
  OfEdge<Value>& X = path.place();
  interpolate(before, after, s, X);
  if (noisy) add_noise(X, edge, noise);
  path.up(X);
}

// Accumulates a dynamic edge of the path.
template <class Value>
Result<void> accumulate_at(PathAccumulation<Value>& path, const HeldVersion& edge, Moment& moment) {
  const std::int64_t t = moment.t;
  if (t > edge.stamp) {
    if (moment.common && edge.unsampled()) {
      path.up(value_of<Value>(edge));
      return {};
    }
    return accumulate_beyond(path, edge, moment);
  }
  if (t == edge.stamp) {
    accumulate_sample(path, edge, value_of<Value>(edge), moment.age);
    return {};
  }
  const auto found = edge.samples->around(t, edge.number, moment.back);
  if (found.before == nullptr) return no_data(Errc::kTooOld);
  if (t == found.before->stamp) {
    moment.correlated = moment.correlated || is_correlated(*found.before);
    correlate_next(path, correlation_at(*found.before, said_of(edge)));
    OfEdge<Value>& X = path.place();
    X = value_of<Value>(*found.before);
    accumulate_sample(path, edge, X, moment.age);
  } else {
    accumulate_between(path, edge, found, moment);
  }
  return {};
}

template <class Value>
PathAccumulation<Value> begin_path(Order order) {
  if constexpr (std::is_same_v<Value, Belief>) {
    return PathAccumulation<Belief>(order);
  } else {
    return PathAccumulation<Value>();
  }
}

}  // namespace

template <class Value, class Take>
Result<void> PathLookup::walk(const Ends& ends, Absent absent, Order order, Take take,
                              Value& X_AB) {
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
    const bool top = absent == Absent::kEnds ? here->depth == 0 : here->above == nullptr;
    if (top) return not_connected(*ends.a, *ends.b);
    if (!here->held()) {
      // A path to others may have many such edges.
      if (!error || error->code != Errc::kNotOwner) {
        error = Error{Errc::kNotOwner,
                      "the edge of " + quote(here->name->text) + " is owned by another partition"};
      }
    } else if (!error) {
      const auto& edge = static_cast<const HeldVersion&>(*here);
      PathAccumulation<Value>& path = from_a ? path_a : path_b;
      correlate_next(path, edge.correlation != nullptr ? &edge.correlation->now : nullptr);
      Result<void> taken = take(path, edge);
      if (!taken) error = std::move(taken.error());
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

template <class Value>
Result<void> PathLookup::walk_newest(const Ends& ends, Absent absent, Order order, Met& met,
                                     Value& X_AB) {
  // Usually all dynamic edges have their newest sample at the same instant, or none is dynamic.
  // Then the stored values are used unchanged.
  const HeldVersion* limiting = nullptr;
  bool mixed = false;
  bool correlated = false;
  const auto take = [&](auto& path, const HeldVersion& edge) {
    if (edge.limits()) {
      if (limiting == nullptr) limiting = &edge;
      if (edge.stamp != limiting->stamp) {
        mixed = true;
        if (edge.stamp < limiting->stamp) limiting = &edge;
      }
    }
    if (leaves_out_correlation<Value>(edge)) correlated = true;
    if (!mixed && !correlated) path.up(value_of<Value>(edge));
    return Result<void>();
  };
  auto newest = walk(ends, absent, order, take, X_AB);
  met = {limiting, limiting != nullptr, correlated};
  // An edge without a sample has the earliest of all stamps.
  if (newest && limiting != nullptr && limiting->lacks_sample()) return no_data(Errc::kNotYet);
  if (!newest || !mixed || correlated) return newest;
  Query query;
  query.order = order;
  return walk_at(ends, absent, {met.limiting->stamp, true}, query, met, X_AB);
}

template <class Value>
Result<void> PathLookup::walk_at(const Ends& ends, Absent absent, const Instant& at,
                                 const Query& query, Met& met, Value& X_AB) {
  std::int64_t age = 0;
  if (query.age_noise_until) {
    age = std::max(saturating_subtract(nanoseconds(*query.age_noise_until), at.t), age);
  }
  // An edge without samples is behind every instant.
  Moment moment{std::max(at.t, kNoSample + 1), age, query, at.common};
  const auto take = [&](auto& path, const HeldVersion& edge) -> Result<void> {
    if (leaves_out_correlation<Value>(edge)) met.correlated = true;
    if (edge.moving()) {
      met.moving = true;
      Result<void> taken = accumulate_at<Value>(path, edge, moment);
      met.correlated = met.correlated || (std::is_same_v<Value, Transform> && moment.correlated);
      return taken;
    }
    if (!met.correlated) path.up(value_of<Value>(edge));
    return {};
  };
  return walk(ends, absent, query.order, take, X_AB);
}

namespace {

Result<void> pass(Belief&& X_AB, const Output& output) {
  output.X = {X_AB.pose, X_AB.own};
  output.X.covariance.set_complete(!X_AB.unspecified);
  output.correlation = {std::move(X_AB.unknown), std::move(X_AB.common_errors), {}};
  return {};
}

}  // namespace

Result<void> PathLookup::reach_newest(const Ends& ends, Absent absent, Order order, Met& met,
                                      Output X_AB) {
  if (order == Order::kSecond) {
    auto plain = walk_newest(ends, absent, order, met, X_AB.X);
    if (!plain || !met.correlated) return plain;
  }
  met = {};
  Belief whole;
  auto walked = walk_newest(ends, absent, order, met, whole);
  return walked ? pass(std::move(whole), X_AB) : walked;
}

Result<void> PathLookup::reach_at(const Ends& ends, Absent absent, const Instant& at,
                                  const Query& query, Met& met, Output X_AB) {
  if (query.order == Order::kSecond) {
    auto plain = walk_at(ends, absent, at, query, met, X_AB.X);
    if (!plain || !met.correlated) return plain;
  }
  met = {};
  Belief whole;
  auto walked = walk_at(ends, absent, at, query, met, whole);
  return walked ? pass(std::move(whole), X_AB) : walked;
}

// Errors are rare, and long to explain.
[[gnu::cold, gnu::noinline]] tl::unexpected<Error> PathLookup::explain(Error&& error,
                                                                       const Ends& ends,
                                                                       const Query& query) const {
  return tl::unexpected(explained(std::move(error), {ends}, query, clock_));
}

template <class Value, class Name>
Result<void> PathLookup::compute(Name a, Name b, Value& X_AB) const {
  const epoch::Guard guard;
  const auto found = frames_.ends(a, b);
  if (!found) return tl::unexpected(found.error());
  Met met;
  auto newest = walk_newest(*found, Absent::kEnds, Order::kSecond, met, X_AB);
  if constexpr (std::is_same_v<Value, Transform>) {
    if (newest && met.correlated) {
      met = {};
      Belief whole;
      newest = walk_newest(*found, Absent::kEnds, Order::kSecond, met, whole);
      X_AB = collapse(whole);
    }
  }
  if (!newest) return explain(std::move(newest.error()), *found, Query{});
  return newest;
}

template <class Name>
Result<void> PathLookup::compute(Name a, Name b, const Query& query, StampedTransform& X_AB) const {
  const epoch::Guard guard;
  const auto found = frames_.ends(a, b);
  if (!found) return tl::unexpected(found.error());
  Met met;
  PathCorrelation correlation;
  const Output output{X_AB, correlation};
  std::optional<Time> at = query.at;
  if (!at) {
    auto newest = reach_newest(*found, Absent::kEnds, query.order, met, output);
    if (!newest) return explain(std::move(newest.error()), *found, query);
    if (met.moving) at = time_of(met.limiting->stamp);
  }
  if (query.at || (at && query.age_noise_until)) {
    met = {};
    const Instant instant{nanoseconds(*at), !query.at};
    auto then = reach_at(*found, Absent::kEnds, instant, query, met, output);
    if (!then) return explain(std::move(then.error()), *found, query);
  }
  if (!met.moving) at.reset();
  X_AB.stamp = at;
  X_AB.basis.order = query.order;
  const bool complete = X_AB.covariance.complete();
  if (correlation.empty() && complete) return {};
  X_AB = collapsed(belief_of(X_AB, correlation), query.order, at);
  if (!complete) {
    X_AB.basis.unspecified = unspecified_edges(*found, at ? nanoseconds(*at) : kAlways);
  }
  return {};
}

// For a frame's id, and for its handle.
template Result<void> PathLookup::compute(std::string_view a, std::string_view b,
                                          Transform& X_AB) const;
template Result<void> PathLookup::compute(std::string_view a, std::string_view b, Pose& X_AB) const;
template Result<void> PathLookup::compute(std::string_view a, std::string_view b,
                                          const Query& query, StampedTransform& X_AB) const;
template Result<void> PathLookup::compute(Handle a, Handle b, Transform& X_AB) const;
template Result<void> PathLookup::compute(Handle a, Handle b, Pose& X_AB) const;
template Result<void> PathLookup::compute(Handle a, Handle b, const Query& query,
                                          StampedTransform& X_AB) const;

}  // namespace tfdude
