#pragma once

#include <array>
#include <cstddef>

#include "tfdude/math/belief.hpp"
#include "tfdude/math/transform.hpp"

#include "math/kernel.hpp"

namespace tfdude {

/// The way from a frame S up towards its root, added up in S itself: the sum Σ Ad(X_SC) Σ_C Ad(X_SC)ᵀ over the
/// edges climbed (C the child of each) needs one adjoint an edge, whatever follows. Edges are computed some at
/// a time, as the arithmetic then stays in registers: a value given to up() must stay where it is until the
/// accumulation is joined.
///
/// @tparam Value  Transform, or Pose where the covariance is not asked for
template <class Value>
class PathAccumulation {
 public:
  PathAccumulation() {
  }  // NOLINT(*-member-init,*-use-equals-default): what is pending is written before it is read

  /// Goes up one edge: X_PC is its value, C the frame reached so far, P the frame reached then.
  void up(const Value& X_PC) {
    // NOLINTNEXTLINE(cppcoreguidelines-pro-type-reinterpret-cast): of doubles only, see path_accumulation.cpp
    pending_[count_++] = reinterpret_cast<kernel::Edge>(&X_PC);
    if (count_ == pending_.size()) compute();
  }

  /// The same, X_PC being a part s of the way from X0 to X1 (interpolate()); these must stay where they are, too.
  void up_between(const Value& X0, const Value& X1, double s);

  /// Where to compute a value that has no place of its own, for up() next.
  [[nodiscard]] Value& place() { return computed_[count_]; }

  /// X_AB where A and B climbed to the same frame. Independent edges, first order.
  template <class V>
  friend V join(PathAccumulation<V>&& from_a, PathAccumulation<V>&& from_b);

 private:
  void compute();
  void blend();

  kernel::Columns X_SH_;  // the pose of the frame reached (here, H) in the start S
  kernel::Blocks left_;   // of the left perturbation of X_SH, expressed in S
  std::array<kernel::Edge, 16> pending_;
  // Not set to zero, which would take as long as a short lookup.
  union {
    std::array<Value, 16> computed_;
  };
  union {
    std::array<kernel::Blend, 16> blends_;  // what of the pending is to be computed first
  };
  std::size_t count_ = 0;
  std::size_t blend_count_ = 0;
};

template <class Value>
[[nodiscard]] Value join(PathAccumulation<Value>&& from_a, PathAccumulation<Value>&& from_b);

/// The same with all that is known of errors, edge by edge: some ten times slower.
template <>
class PathAccumulation<Belief> {
 public:
  explicit PathAccumulation(Order order) : order_(order) {}

  /// What the error of the next edge has to do with others'; common_errors: may be null.
  void correlate_next(bool unknown, const std::vector<CommonError>* common_errors) {
    unknown_ = unknown;
    common_errors_ = common_errors;
  }

  void up(const Transform& X_PC);
  void up_between(const Transform& X0, const Transform& X1, double s);
  [[nodiscard]] Transform& place() { return computed_; }

  friend Belief join(PathAccumulation<Belief>&& from_a, PathAccumulation<Belief>&& from_b);

 private:
  Order order_;
  Belief X_HS_;  // errors in the start's frame, in which they are needed
  Transform computed_;
  bool unknown_ = false;
  const std::vector<CommonError>* common_errors_ = nullptr;
};

}  // namespace tfdude
