#include <algorithm>
#include <cmath>
#include <type_traits>
#include <utility>

#include "tfdude/base/id.hpp"
#include "tfdude/math/interpolate.hpp"

#include "math/climb.hpp"
#include "tree/forest_impl.hpp"

// Lookups: the walk along a path, and where its edges were at an instant.
namespace tfdude {
namespace {

template <class Value>
const Value& value_of(const HeldVersion& version) {
  if constexpr (std::is_same_v<Value, Pose>) {
    return version.X_PC.pose;
  } else {
    return version.X_PC;
  }
}

double seconds(std::int64_t nanoseconds) { return static_cast<double>(nanoseconds) * 1e-9; }

void add_noise(Pose&, const HeldVersion&, double) {}
void add_noise(Transform& X, const HeldVersion& edge, double seconds) {
  const Covariance::Upper& rate = edge.ring->timing().process_noise.upper();
  Covariance::Upper sum = X.covariance.upper();
  for (std::size_t i = 0; i < sum.size(); ++i) sum[i] += seconds * rate[i];
  X.covariance = Covariance::trusted(sum);
}

tl::unexpected<Error> no_data(Errc code, const HeldVersion& edge, std::int64_t t,
                              const std::string& why) {
  return fail(code, "the edge of " + quote(edge.name->text) + " has no data of " +
                        to_string(time_of(t)) + ": " + why);
}

tl::unexpected<Error> too_old(const HeldVersion& edge, std::int64_t t) {
  const std::int64_t oldest = edge.ring->stamp(edge.ring->oldest());
  // It may be dropped while it is looked at.
  if (oldest == kAlways) return no_data(Errc::kTooOld, edge, t, "it is not kept any more");
  return no_data(
      Errc::kTooOld, edge, t,
      "its oldest sample is " + in_milliseconds(std::chrono::nanoseconds(oldest - t)) + " younger");
}

tl::unexpected<Error> not_yet(const HeldVersion& edge, std::int64_t t, const std::string& more) {
  const std::chrono::nanoseconds gap(t - edge.stamp);
  return no_data(Errc::kNotYet, edge, t,
                 "its newest sample is " + in_milliseconds(gap) + " older" + more);
}

// Beyond the newest sample, as far as is allowed.
template <class Value>
Result<void> compute_beyond(const HeldVersion& edge, std::int64_t t, const Instant& instant,
                            Value& X) {
  const std::int64_t beyond = t - edge.stamp;
  const std::int64_t limit = instant.extrapolate.count();
  if (limit == 0) return not_yet(edge, t, "");
  if (beyond > limit) {
    return not_yet(
        edge, t,
        ", and no more than " + in_milliseconds(instant.extrapolate) + " is to be extrapolated");
  }
  const HeldVersion* before =
      edge.number > edge.ring->oldest() ? edge.ring->sample(edge.number - 1) : nullptr;
  if (before == nullptr) return not_yet(edge, t, ", and the only one: its motion is not known");
  const double s = seconds(t - before->stamp) / seconds(edge.stamp - before->stamp);
  X = extrapolate(value_of<Value>(*before), value_of<Value>(edge), s);
  add_noise(X, edge, seconds(beyond));
  return {};
}

// What a walk knows of the instant it is about.
struct Moment {
  std::int64_t t;
  std::int64_t age;  // until when it is to hold, where noise is added for that
  const Instant& instant;
  std::uint64_t back = 0;  // see Ring::around()
};

// A moving edge, up which the climb goes.
template <class Value>
Result<void> climb_at(Climb<Value>& climb, const HeldVersion& edge, Moment& moment) {
  const std::int64_t t = moment.t;
  if (t > edge.stamp) {
    Value& X = climb.place();
    auto computed = compute_beyond<Value>(edge, t, moment.instant, X);
    if (!computed) return computed;
    if (moment.age != 0) add_noise(X, edge, seconds(moment.age));
    climb.up(X);
    return {};
  }
  const HeldVersion* before = &edge;
  const HeldVersion* after = &edge;
  if (t < edge.stamp) {
    const auto found = edge.ring->around(t, edge.number, moment.back);
    if (found.before == nullptr) return too_old(edge, t);
    before = found.before;
    after = before->stamp == t ? before : found.after;
  }
  const auto span = static_cast<double>(after->stamp - before->stamp);
  const double s = after == before ? 0 : static_cast<double>(t - before->stamp) / span;
  const double noise = seconds(moment.age) + s * (1.0 - s) * span * 1e-9;
  if (edge.ring->has_noise() && noise > 0) {
    Value& X = climb.place();
    X = value_of<Value>(*before);
    if (after != before) interpolate(value_of<Value>(*before), value_of<Value>(*after), s, X);
    add_noise(X, edge, noise);
    climb.up(X);
  } else if (after == before) {
    climb.up(value_of<Value>(*before));
  } else {
    climb.up_between(value_of<Value>(*before), value_of<Value>(*after), s);
  }
  return {};
}

}  // namespace

template <class Value, class Take>
Result<Value> Forest::Impl::walk(const Ends& ends, Absent absent, Take take) const {
  const Version* a = ends.a;
  const Version* b = ends.b;
  Climb<Value> climb_a;
  Climb<Value> climb_b;
  // What went wrong first; from there on only the errors matter, and kNotConnected goes first.
  std::optional<Error> error;
  while (a != b) {
    const bool from_a = a->depth >= b->depth;
    const Version*& here = from_a ? a : b;
    const bool top = absent == Absent::kEnds ? here->depth == 0 : here->above == nullptr;
    if (top) return not_connected(*ends.a, *ends.b);
    if (!here->held()) {
      error = Error{Errc::kNotOwner,
                    "the edge of " + quote(here->name->text) + " is held by another partition"};
    } else if (!error) {
      Result<void> taken = take(from_a ? climb_a : climb_b, static_cast<const HeldVersion&>(*here));
      if (!taken) error = std::move(taken.error());
    }
    here = at(*here->above, ends.commit);
  }
  if (error) return tl::unexpected(*std::move(error));
  return join(std::move(climb_a), std::move(climb_b));
}

template <class Value>
Result<Value> Forest::Impl::walk_newest(const Ends& ends, Absent absent,
                                        const HeldVersion*& limiting) const {
  // Mostly all moving edges have their newest sample of the same instant, or none is moving: then all values are as
  // they lie there.
  limiting = nullptr;
  bool mixed = false;
  auto newest = walk<Value>(ends, absent, [&](auto& climb, const HeldVersion& edge) {
    if (edge.moving()) {
      if (limiting == nullptr) limiting = &edge;
      if (edge.stamp != limiting->stamp) {
        mixed = true;
        if (edge.stamp < limiting->stamp) limiting = &edge;
      }
    }
    if (!mixed) climb.up(value_of<Value>(edge));
    return Result<void>();
  });
  if (!newest || !mixed) return newest;
  return walk_at<Value>(ends, absent, limiting->stamp, {}, nullptr);
}

template <class Value>
Result<Value> Forest::Impl::walk_at(const Ends& ends, Absent absent, std::int64_t t,
                                    const Instant& instant, bool* any_moving) const {
  const std::int64_t age =
      instant.age_noise_until ? std::max(nanoseconds(*instant.age_noise_until) - t, std::int64_t{0})
                              : 0;
  Moment moment{t, age, instant};
  return walk<Value>(ends, absent, [&](auto& climb, const HeldVersion& edge) -> Result<void> {
    if (edge.moving()) {
      if (any_moving != nullptr) *any_moving = true;
      return climb_at<Value>(climb, edge, moment);
    }
    climb.up(value_of<Value>(edge));
    return {};
  });
}

template <class Value, class Name>
Result<Value> Forest::Impl::look_up(Name a, Name b) const {
  const epoch::Guard guard;
  const auto found = ends(a, b);
  if (!found) return tl::unexpected(found.error());
  const HeldVersion* limiting = nullptr;
  return walk_newest<Value>(*found, Absent::kEnds, limiting);
}

template <class Name>
Result<StampedTransform> Forest::Impl::look_up(Name a, Name b, const Instant& instant) const {
  const epoch::Guard guard;
  const auto found = ends(a, b);
  if (!found) return tl::unexpected(found.error());
  std::int64_t t = 0;
  if (instant.at) {
    t = nanoseconds(*instant.at);
  } else {
    const HeldVersion* limiting = nullptr;
    const auto newest = walk_newest<Transform>(*found, Absent::kEnds, limiting);
    if (!newest) return tl::unexpected(newest.error());
    if (limiting == nullptr) return StampedTransform{*newest, std::nullopt};
    t = limiting->stamp;
    if (!instant.age_noise_until) return StampedTransform{*newest, time_of(t)};
  }
  bool moving = false;
  const auto X_AB = walk_at<Transform>(*found, Absent::kEnds, t, instant, &moving);
  if (!X_AB) return tl::unexpected(X_AB.error());
  return StampedTransform{*X_AB, moving ? std::optional<Time>(time_of(t)) : std::nullopt};
}

Result<std::vector<Forest::Impl::Ends>> Forest::Impl::all_ends(
    const std::vector<PathEnds>& segments) const {
  const std::uint64_t commit = snapshot();
  std::vector<Ends> all;
  all.reserve(segments.size());
  for (const PathEnds& segment : segments) {
    const Version* start = named(segment.from, commit);
    if (start == nullptr) return unknown_start(segment.from);
    const Version* end = named(segment.to, commit);
    if (end == nullptr) return unknown_end(segment.to);
    all.push_back({start, end, commit});
  }
  return all;
}

Result<std::vector<Transform>> Forest::Impl::values_at(const std::vector<Ends>& segments,
                                                       std::int64_t t, const Instant& instant,
                                                       bool* any_moving) const {
  std::vector<Transform> values;
  values.reserve(segments.size());
  for (const Ends& ends : segments) {
    const auto X = walk_at<Transform>(ends, Absent::kMayPass, t, instant, any_moving);
    if (!X) return tl::unexpected(X.error());
    values.push_back(*X);
  }
  return values;
}

// Each segment's newest, and of those with moving edges that whose newest is the oldest.
Result<std::vector<Transform>> Forest::Impl::newest_values(const std::vector<Ends>& segments,
                                                           const HeldVersion*& limiting) const {
  std::vector<Transform> values;
  values.reserve(segments.size());
  bool mixed = false;
  for (const Ends& ends : segments) {
    const HeldVersion* of_this = nullptr;
    const auto X = walk_newest<Transform>(ends, Absent::kMayPass, of_this);
    if (!X) return tl::unexpected(X.error());
    values.push_back(*X);
    if (of_this == nullptr) continue;
    if (limiting == nullptr) limiting = of_this;
    mixed = mixed || of_this->stamp != limiting->stamp;
    if (of_this->stamp < limiting->stamp) limiting = of_this;
  }
  if (mixed) return values_at(segments, limiting->stamp, {}, nullptr);
  return values;
}

Result<SegmentValues> Forest::lookup_segments(const std::vector<PathEnds>& segments,
                                              const Instant& instant,
                                              std::optional<Time> hint) const {
  const epoch::Guard guard;
  const auto ends = impl_->all_ends(segments);
  if (!ends) return tl::unexpected(ends.error());
  SegmentValues found;
  std::optional<std::int64_t> t;
  if (instant.at) {
    t = nanoseconds(*instant.at);
  } else {
    const HeldVersion* limiting = nullptr;
    auto newest = impl_->newest_values(*ends, limiting);
    if (!newest) return tl::unexpected(std::move(newest.error()));
    found.values = *std::move(newest);
    if (limiting == nullptr) return found;
    found.stamp = time_of(limiting->stamp);
    const std::int64_t before =
        limiting->number > 0 ? limiting->ring->stamp(limiting->number - 1) : kAlways;
    if (before != kAlways) found.period = std::chrono::nanoseconds(limiting->stamp - before);
    if (instant.age_noise_until) t = limiting->stamp;
  }
  bool moving = false;
  if (t) {
    auto values = impl_->values_at(*ends, *t, instant, &moving);
    if (!values) return tl::unexpected(std::move(values.error()));
    found.values = *std::move(values);
    if (moving) found.stamp = time_of(*t);
  }
  if (hint && hint != found.stamp) {
    auto values = impl_->values_at(*ends, nanoseconds(*hint), instant, &moving);
    if (values) found.at_hint = *std::move(values);
  }
  return found;
}

Result<Transform> Forest::lookup(std::string_view a, std::string_view b) const {
  return impl_->look_up<Transform>(a, b);
}
Result<Transform> Forest::lookup(Handle a, Handle b) const {
  return impl_->look_up<Transform>(a, b);
}
Result<Pose> Forest::lookup_pose(std::string_view a, std::string_view b) const {
  return impl_->look_up<Pose>(a, b);
}
Result<Pose> Forest::lookup_pose(Handle a, Handle b) const { return impl_->look_up<Pose>(a, b); }
Result<StampedTransform> Forest::lookup(std::string_view a, std::string_view b,
                                        const Instant& instant) const {
  return impl_->look_up(a, b, instant);
}
Result<StampedTransform> Forest::lookup(Handle a, Handle b, const Instant& instant) const {
  return impl_->look_up(a, b, instant);
}

}  // namespace tfdude
