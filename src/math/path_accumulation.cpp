#include "math/path_accumulation.hpp"

#include <algorithm>
#include <cstddef>

#include "tfdude/math/interpolate.hpp"

#include "math/common_errors.hpp"
#include "math/interpolate_far.hpp"

namespace tfdude {
namespace {

using kernel::Blend;

void blend_all(Blend* const* all, std::size_t count, const Pose*) {
  kernel::functions().blend_poses(all, count);
}
void blend_all(Blend* const* all, std::size_t count, const Transform*) {
  kernel::functions().blend_with_covariance(all, count);
}

void blend_far(const Blend& one, Pose& X) {
  interpolate_far(kernel::pose_of(one.X0), kernel::pose_of(one.X1), one.s, X);
}
void blend_far(const Blend& one, Transform& X) {
  interpolate_far(kernel::transform_of(one.X0), kernel::transform_of(one.X1), one.s, X);
}

}  // namespace

template <class Value>
void PathAccumulation<Value>::up_between(const TransformParts& X0, const TransformParts& X1,
                                         double s) {
  if constexpr (std::is_same_v<Value, Transform>) {
    const bool complete = X0.covariance->complete();
    if (complete != X1.covariance->complete()) {
      interpolate(X0.whole(), X1.whole(), s, place());
      return up(place());
    }
    complete_ &= complete;
  }
  const kernel::Edge edge = kernel::edge_of(place());
  blends_[blend_count_++] = {kernel::edge_of(*X0.pose, *X0.covariance),
                             kernel::edge_of(*X1.pose, *X1.covariance), s,
                             kernel::numbers_of(place()), &pending_[count_]};
  push(edge);
}

template <class Value>
void PathAccumulation<Value>::blend(PathAccumulation* other) {
  // All at once, because four take hardly longer than one.
  std::array<Blend*, 2 * std::tuple_size_v<decltype(blends_)>> all;
  std::size_t count = 0;
  for (PathAccumulation* path : {this, other}) {
    for (std::size_t i = 0; path != nullptr && i < path->blend_count_; ++i) {
      all[count++] = &path->blends_[i];
    }
    if (path != nullptr) path->blend_count_ = 0;
  }
  if (count == 0) return;
  blend_all(all.data(), count, static_cast<const Value*>(nullptr));
  for (std::size_t i = 0; i < count; ++i) {
    const Blend& one = *all[i];
    if (one.near) continue;
    Value X;
    blend_far(one, X);
    std::copy_n(kernel::numbers_of(X), std::is_same_v<Value, Pose> ? 7 : 28, one.X);
    *one.edge = {one.X, one.X + 7};
  }
}

template <class Value>
void PathAccumulation<Value>::climb() {
  blend(nullptr);
  const kernel::Functions& compute = kernel::functions();
  if constexpr (std::is_same_v<Value, Transform>) {
    compute.climb_with_covariance(climbed_, {pending_.data(), count_});
  } else {
    compute.climb(climbed_, {pending_.data(), count_});
  }
  count_ = 0;
}

template <class Value>
void join(PathAccumulation<Value>&& from_a, PathAccumulation<Value>&& from_b, Value& X_AB) {
  from_a.blend(&from_b);
  const kernel::Functions& compute = kernel::functions();
  const kernel::Edges a{from_a.pending_.data(), from_a.count_};
  const kernel::Edges b{from_b.pending_.data(), from_b.count_};
  if constexpr (std::is_same_v<Value, Transform>) {
    compute.join_with_covariance(from_a.climbed_, a, from_b.climbed_, b, kernel::numbers_of(X_AB));
    X_AB.covariance.set_complete(from_a.complete_ && from_b.complete_);
  } else {
    compute.join(from_a.climbed_, a, from_b.climbed_, b, kernel::numbers_of(X_AB));
  }
}

namespace {

const Covariance kExact;

// Adds the common errors, transported by X.
void add_transported(const kernel::Columns& X, const std::vector<CommonError>& common_errors,
                     std::vector<CommonError>& sum) {
  for (const CommonError& one : common_errors) {
    CommonError* same = of_same_source(sum, one);
    if (same == nullptr) {
      same = &sum.emplace_back(CommonError{one.source, one.subtracts, {}});
    }
    kernel::add_transported(X, one.loading, same->loading);
  }
}

void add_unknown(const kernel::Columns& X, const Covariance& unknown,
                 std::optional<Covariance>& sum) {
  const Covariance here = kernel::transported(X, unknown);
  sum = sum ? bound(*sum, here) : here;
}

}  // namespace

template <class Value>
void PathAccumulation<Value>::up_exactly(const Pose& X_PC) {
  push({kernel::numbers_of(X_PC), kExact.upper().data()});
}

void PathAccumulation<Belief>::up(const Transform& X_PC) {
  if (order_ == Order::kFourth) {
    Belief edge;
    edge.pose = X_PC.pose;
    (unknown_ ? edge.unknown.emplace() : edge.own) = X_PC.covariance.of_specified();
    edge.unspecified = !X_PC.covariance.complete();
    if (common_errors_ != nullptr) edge.common_errors = *common_errors_;
    X_HS_ = compose(edge, X_HS_, order_);
    return;
  }
  if (!correlated()) return own_.up(X_PC);
  const kernel::Columns& X_SC = own_.reached();
  if (common_errors_ != nullptr) add_transported(X_SC, *common_errors_, X_HS_.common_errors);
  if (!unknown_) return own_.up(X_PC);
  add_unknown(X_SC, X_PC.covariance.of_specified(), X_HS_.unknown);
  X_HS_.unspecified |= !X_PC.covariance.complete();
  own_.up_exactly(X_PC.pose);
}

void PathAccumulation<Belief>::up_between(const TransformParts& X0, const TransformParts& X1,
                                          double s) {
  if (order_ == Order::kSecond && !correlated()) return own_.up_between(X0, X1, s);
  interpolate(X0.whole(), X1.whole(), s, place());
  up(place());
}

template <>
void join(PathAccumulation<Belief>&& from_a, PathAccumulation<Belief>&& from_b, Belief& X_AB) {
  if (from_a.order_ == Order::kFourth) {
    X_AB = compose(inverse(from_a.X_HS_), from_b.X_HS_, from_a.order_);
    return;
  }
  Transform own;
  join(std::move(from_a.own_), std::move(from_b.own_), own);
  const Belief& a = from_a.X_HS_;
  const Belief& b = from_b.X_HS_;
  const kernel::Columns X_BA = kernel::columns_of(own.pose.inverse());
  X_AB = {own.pose, own.covariance.of_specified(), b.unknown, {}, false};
  if (a.unknown) add_unknown(X_BA, *a.unknown, X_AB.unknown);
  // The error of the inverse is the negative one.
  add_transported(X_BA, a.common_errors, X_AB.common_errors);
  for (CommonError& one : X_AB.common_errors) one.loading = -one.loading;
  add_errors(b.common_errors, X_AB.common_errors);
  X_AB.unspecified = a.unspecified || b.unspecified || !own.covariance.complete();
}

template class PathAccumulation<Transform>;
template class PathAccumulation<Pose>;
template void join(PathAccumulation<Transform>&&, PathAccumulation<Transform>&&, Transform&);
template void join(PathAccumulation<Pose>&&, PathAccumulation<Pose>&&, Pose&);

}  // namespace tfdude
