#pragma once

#include <algorithm>
#include <cstdint>
#include <type_traits>

#include "tfdude/math/interpolate.hpp"

#include "base/saturating.hpp"
#include "math/path_accumulation.hpp"
#include "tree/forest.hpp"
#include "tree/held_edge.hpp"
#include "tree/revised_sample.hpp"
#include "tree/source_instants.hpp"

// The value of one edge at an instant, for a walk along a path. The edge is one that is held here
// (OwnEdge), or in the memory of another process (RemoteEdge), where stamps may be any numbers.
namespace tfdude {

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

inline double seconds(std::int64_t nanoseconds) { return static_cast<double>(nanoseconds) * 1e-9; }

// Adds what the edge may have drifted in a time.
template <class Samples>
void add_noise(Pose&, const Samples&, double) {}
template <class Samples>
void add_noise(Transform& X, const Samples& samples, double seconds) {
  if (!X.covariance.complete()) return;
  const Covariance::Upper& rate = samples.process_noise().upper();
  Covariance::Upper sum = X.covariance.of_specified().upper();
  for (std::size_t i = 0; i < sum.size(); ++i) sum[i] += seconds * rate[i];
  X.covariance = Covariance::trusted(sum);
}

// The text is added by explained(), where all edges are known.
inline tl::unexpected<Error> no_data(Errc code) { return fail(code, {}); }
// What another process has written cannot be read, or makes no sense.
inline tl::unexpected<Error> not_readable() { return fail(Errc::kUnsupported, {}); }

// The two newest samples of the edge, if it may be extrapolated so far.
template <class Samples>
Result<SampleHistory::Bracket> newest_of(const HeldVersion& edge, const Samples& samples,
                                         std::int64_t t, const Query& query) {
  if (edge.lacks_sample()) return no_data(Errc::kNotYet);
  const std::int64_t beyond = saturating_subtract(t, edge.stamp);
  if (beyond > query.extrapolate.count() || beyond > samples.reach(edge.number)) {
    return no_data(Errc::kNotYet);
  }
  const SampleHistory::Bracket found{
      edge.number > samples.oldest() ? samples.sample(edge.number - 1) : nullptr,
      samples.sample(edge.number)};
  if (found.before == nullptr || found.after == nullptr) return no_data(Errc::kNotYet);
  return found;
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

// As said of the edge, unless its samples say otherwise. @return whether that could be read
template <class Value, class Edge>
bool correlate_as_said(PathAccumulation<Value>& path, const Edge& from, typename Edge::Copy& copy) {
  const Correlation* said = nullptr;
  if constexpr (std::is_same_v<Value, Belief>) {
    if (!from.find_said(copy, said)) return false;
    correlate_next(path, said);
  }
  return true;
}

// The instant of a walk.
struct Moment {
  std::int64_t t;
  std::int64_t age;  // adds the process noise until then
  const Query& query;
  bool common;              // as of PathLookup::Instant
  std::uint64_t back = 0;   // see SampleHistory::around()
  bool correlated = false;  // a sample has a correlation of its own
  SourceInstants* sources = nullptr;
};

// Tells from which samples the error of the edge comes that is accumulated next.
template <class Value>
void tell_instants(PathAccumulation<Value>& path, const Moment& moment, FromSamples from) {
  if constexpr (std::is_same_v<Value, Belief>) {
    const std::vector<CommonError>* errors = path.next_errors();
    if (errors == nullptr || moment.sources == nullptr) return;
    path.replace_next(moment.sources->met(*errors, from));
  }
}

// The same, if its instant is that of a sample.
template <class Value, class Samples>
void tell_instant(PathAccumulation<Value>& path, const Moment& moment, const Samples& samples) {
  if constexpr (std::is_same_v<Value, Belief>) {
    tell_instants(path, moment, samples.drifts() ? kLasting : FromSamples{moment.t, moment.t});
  }
}

// Accumulates a value that was computed, and has drifted for some time since.
template <class Value, class Samples>
Result<void> accumulate_correlated(PathAccumulation<Value>& path, const CorrelatedValue& value,
                                   const Samples& samples, double seconds, const Moment& moment,
                                   FromSamples from) {
  correlate_next(path, &value.correlation);
  tell_instants(path, moment, samples.drifts() ? kLasting : from);
  Transform& X = path.place();
  X = value.X_PC;
  if (samples.has_noise()) add_noise(X, samples, seconds);
  path.up(X);
  return {};
}

// Accumulates an edge beyond its newest sample.
template <class Value, class Edge>
Result<void> accumulate_beyond(PathAccumulation<Value>& path, const Edge& from, Moment& moment) {
  const HeldVersion& edge = *from.version;
  const auto samples = from.samples();
  auto found = newest_of(edge, samples, moment.t, moment.query);
  if (!found) return tl::unexpected(found.error());
  typename decltype(samples)::Copies copies;
  if (!samples.make_whole(*found, copies)) return not_readable();
  const Sample& before = *found->before;
  const Sample& newest = *found->after;
  const double span = seconds(saturating_subtract(edge.stamp, before.stamp));
  const double beyond = seconds(saturating_subtract(moment.t, edge.stamp));
  const double s = 1.0 + beyond / span;
  const bool revised = before.revision() != nullptr || newest.revision() != nullptr;
  moment.correlated = moment.correlated || is_correlated(newest);
  // A random walk of this density has also moved the sample before, by which the twist is wrong.
  const double noise = beyond * s + seconds(moment.age);
  if constexpr (!std::is_same_v<Value, Pose>) {
    typename Edge::Copy copy;
    const Correlation* said = nullptr;
    if (!from.find_said(copy, said)) return not_readable();
    if (revised || said != nullptr || samples.drifts()) {
      const Walk walk{samples.process_noise(), beyond};
      const bool drifts = samples.drifts();
      const CorrelatedValue ahead =
          extrapolate_correlated(before, newest, edge.X_PC, s, said, drifts ? &walk : nullptr);
      return accumulate_correlated(path, ahead, samples, drifts ? seconds(moment.age) : noise,
                                   moment, {before.stamp, edge.stamp});
    }
  }
  OfEdge<Value>& X = path.place();
  extrapolate(before, newest, value_of<Value>(edge), s, X);
  add_noise(X, samples, noise);
  path.up(X);
  return {};
}

// Accumulates an edge whose instant is that of a sample, with this value.
template <class Value, class Samples>
void accumulate_sample(PathAccumulation<Value>& path, const Samples& samples,
                       const OfEdge<Value>& X_PC, std::int64_t age) {
  if (age == 0 || !samples.has_noise()) return path.up(X_PC);
  OfEdge<Value>& X = path.place();
  X = X_PC;
  add_noise(X, samples, seconds(age));
  path.up(X);
}

// Accumulates an edge between two samples.
template <class Value, class Edge, class Samples>
Result<void> accumulate_between(PathAccumulation<Value>& path, const Edge& from,
                                const Samples& samples, SampleHistory::Bracket found,
                                Moment& moment) {
  const std::int64_t begin = found.before->stamp;
  const auto span = static_cast<double>(saturating_subtract(found.after->stamp, begin));
  const double s = static_cast<double>(saturating_subtract(moment.t, begin)) / span;
  const bool noisy = samples.has_noise();
  TransformParts first{};
  TransformParts second{};
  const FromSamples both{begin, found.after->stamp};
  typename Edge::Copy copy;
  if (!noisy && !samples.drifts() && samples.given_parts(*found.before, first) &&
      samples.given_parts(*found.after, second)) {
    if (!correlate_as_said(path, from, copy)) return not_readable();
    tell_instants(path, moment, both);
    path.up_between(first, second, s);
    return {};
  }
  typename Samples::Copies copies;
  if (!samples.make_whole(found, copies)) return not_readable();
  const Sample& before = *found.before;
  const Sample& after = *found.after;
  const double noise = seconds(moment.age) + s * (1.0 - s) * span * 1e-9;
  const bool correlated = is_correlated(before) || is_correlated(after);
  moment.correlated = moment.correlated || correlated;
  if constexpr (!std::is_same_v<Value, Pose>) {
    if (samples.drifts()) {
      const Correlation* said = nullptr;
      if (!from.find_said(copy, said)) return not_readable();
      const Walk walk{samples.process_noise(), span * 1e-9};
      const CorrelatedValue X = drifted_between(before, after, s, said, walk);
      return accumulate_correlated(path, X, samples, seconds(moment.age), moment, both);
    }
  }
  if constexpr (std::is_same_v<Value, Belief>) {
    if (correlated) {
      const Correlation* said = nullptr;
      if (!from.find_said(copy, said)) return not_readable();
      const CorrelatedValue X = interpolate_observed(before, after, s, said);
      return accumulate_correlated(path, X, samples, noise, moment, both);
    }
  }
  if (!correlate_as_said(path, from, copy)) return not_readable();
  tell_instants(path, moment, both);
  OfEdge<Value>& X = path.place();
  interpolate(before, after, s, X);
  if (noisy) add_noise(X, samples, noise);
  path.up(X);
  return {};
}

// Accumulates a dynamic edge of the path.
template <class Value, class Edge>
Result<void> accumulate_at(PathAccumulation<Value>& path, const Edge& from, Moment& moment) {
  const HeldVersion& edge = *from.version;
  const std::int64_t t = moment.t;
  if (t > edge.stamp) {
    if (moment.common && edge.unsampled()) {
      tell_instants(path, moment, {t, t});
      path.up(value_of<Value>(edge));
      return {};
    }
    return accumulate_beyond(path, from, moment);
  }
  const auto samples = from.samples();
  if (t == edge.stamp) {
    tell_instant(path, moment, samples);
    accumulate_sample(path, samples, value_of<Value>(edge), moment.age);
    return {};
  }
  auto found = samples.around(t, edge.number, moment.back);
  if (found.before == nullptr) return no_data(Errc::kTooOld);
  if (t != found.before->stamp) return accumulate_between(path, from, samples, found, moment);
  found.after = nullptr;
  typename decltype(samples)::Copies copies;
  if (!samples.make_whole(found, copies)) return not_readable();
  moment.correlated = moment.correlated || is_correlated(*found.before);
  typename Edge::Copy copy;
  if constexpr (std::is_same_v<Value, Belief>) {
    const Correlation* said = nullptr;
    if (!from.find_said(copy, said)) return not_readable();
    correlate_next(path, correlation_at(*found.before, said));
    tell_instant(path, moment, samples);
  }
  OfEdge<Value>& X = path.place();
  X = value_of<Value>(*found.before);
  accumulate_sample(path, samples, X, moment.age);
  return {};
}

}  // namespace tfdude
