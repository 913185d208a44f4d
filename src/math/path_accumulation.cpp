#include "math/path_accumulation.hpp"

#include <cstddef>
#include <type_traits>

#include "tfdude/math/interpolate.hpp"

#include "math/columns.hpp"
#include "math/interpolate_far.hpp"

namespace tfdude {

// The layout in which the kernel reads an edge: quaternion, translation, upper triangle.
static_assert(std::is_standard_layout_v<Pose> && sizeof(Pose) == 7 * sizeof(double));
static_assert(std::is_standard_layout_v<Transform> && sizeof(Transform) == 29 * sizeof(double));
static_assert(offsetof(Transform, covariance) == 7 * sizeof(double));
static_assert(std::is_standard_layout_v<StatedCovariance> &&
              sizeof(StatedCovariance) == 22 * sizeof(double));

template <class Value>
void PathAccumulation<Value>::up_between(const TransformParts& X0, const TransformParts& X1,
                                         double s) {
  // NOLINTBEGIN(cppcoreguidelines-pro-type-reinterpret-cast): of doubles only
  blends_[blend_count_++] = {reinterpret_cast<kernel::Edge>(X0.pose),
                             reinterpret_cast<kernel::Edge>(X1.pose),
                             reinterpret_cast<const double*>(X0.covariance),
                             reinterpret_cast<const double*>(X1.covariance),
                             s,
                             reinterpret_cast<double*>(&place())};
  // NOLINTEND(cppcoreguidelines-pro-type-reinterpret-cast)
  up(place());
}

namespace {

// NOLINTBEGIN(cppcoreguidelines-pro-type-reinterpret-cast): what they were before
TransformParts first_of(const kernel::Blend& one) {
  return {reinterpret_cast<const Pose*>(one.X0),
          reinterpret_cast<const StatedCovariance*>(one.upper0)};
}
TransformParts second_of(const kernel::Blend& one) {
  return {reinterpret_cast<const Pose*>(one.X1),
          reinterpret_cast<const StatedCovariance*>(one.upper1)};
}
// NOLINTEND(cppcoreguidelines-pro-type-reinterpret-cast)

void finish(const kernel::Blend& one, Transform& X) {
  const TransformParts X0 = first_of(one);
  const TransformParts X1 = second_of(one);
  const bool complete = X0.covariance->complete();
  if (complete != X1.covariance->complete()) {
    return interpolate(X0.whole(), X1.whole(), one.s, X);
  }
  if (!one.near) interpolate_far(X0.whole(), X1.whole(), one.s, X);
  X.covariance.set_complete(complete);
}

void finish(const kernel::Blend& one, Pose& X) {
  if (!one.near) interpolate_far(*first_of(one).pose, *second_of(one).pose, one.s, X);
}

}  // namespace

template <class Value>
void PathAccumulation<Value>::blend() {
  const kernel::Functions& functions = kernel::functions();
  if constexpr (std::is_same_v<Value, Transform>) {
    functions.blend_with_covariance(blends_.data(), blend_count_);
  } else {
    functions.blend_poses(blends_.data(), blend_count_);
  }
  for (std::size_t i = 0; i < blend_count_; ++i) {
    // NOLINTNEXTLINE(cppcoreguidelines-pro-type-reinterpret-cast): what it was before
    finish(blends_[i], *reinterpret_cast<Value*>(blends_[i].X));
  }
  blend_count_ = 0;
}

template <class Value>
void PathAccumulation<Value>::compute() {
  if (blend_count_ > 0) blend();
  if constexpr (std::is_same_v<Value, Transform>) {
    kernel::functions().accumulate_with_covariance(X_SH_, left_, pending_.data(), count_);
    for (std::size_t i = 0; i < count_; ++i) {
      // NOLINTNEXTLINE(cppcoreguidelines-pro-type-reinterpret-cast): what it was before
      complete_ &= reinterpret_cast<const Value*>(pending_[i])->covariance.complete();
    }
  } else {
    kernel::functions().accumulate(X_SH_, pending_.data(), count_);
  }
  count_ = 0;
}

template <class Value>
Value join(PathAccumulation<Value>&& from_a, PathAccumulation<Value>&& from_b) {
  // Both at once: four take hardly longer than one.
  const bool together = from_a.blend_count_ + from_b.blend_count_ <= from_a.blends_.size();
  for (std::size_t i = 0; together && i < from_b.blend_count_; ++i) {
    from_a.blends_[from_a.blend_count_++] = from_b.blends_[i];
  }
  if (together) from_b.blend_count_ = 0;
  from_a.compute();
  from_b.compute();
  const kernel::Functions& compute = kernel::functions();
  const Pose X_AB = kernel::pose_of(compute.quotient(from_a.X_SH_, from_b.X_SH_));
  if constexpr (std::is_same_v<Value, Transform>) {
    const kernel::Columns X_BA = compute.quotient(from_b.X_SH_, from_a.X_SH_);
    compute.add_transported(X_BA, kernel::upper_of(from_a.left_).data(), from_b.left_);
    return {X_AB, StatedCovariance::trusted(kernel::upper_of(from_b.left_),
                                            from_a.complete_ && from_b.complete_)};
  } else {
    return X_AB;
  }
}

void PathAccumulation<Belief>::up(const Transform& X_PC) {
  Belief edge;
  edge.pose = X_PC.pose;
  (unknown_ ? edge.unknown.emplace() : edge.own) = X_PC.covariance.of_specified();
  edge.unspecified = !X_PC.covariance.complete();
  if (common_errors_ != nullptr) edge.common_errors = *common_errors_;
  X_HS_ = compose(edge, X_HS_, order_);
}

void PathAccumulation<Belief>::up_between(const TransformParts& X0, const TransformParts& X1,
                                          double s) {
  up(interpolate(X0.whole(), X1.whole(), s));
}

Belief join(PathAccumulation<Belief>&& from_a, PathAccumulation<Belief>&& from_b) {
  return compose(inverse(from_a.X_HS_), from_b.X_HS_, from_a.order_);
}

template class PathAccumulation<Transform>;
template class PathAccumulation<Pose>;
template Transform join(PathAccumulation<Transform>&&, PathAccumulation<Transform>&&);
template Pose join(PathAccumulation<Pose>&&, PathAccumulation<Pose>&&);

}  // namespace tfdude
