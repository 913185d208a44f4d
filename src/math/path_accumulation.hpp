#pragma once

#include <array>
#include <cstddef>
#include <type_traits>
#include <utility>

#include "tfdude/math/belief.hpp"
#include "tfdude/math/transform.hpp"

#include "math/columns.hpp"

namespace tfdude {

/// A transform whose parts are stored apart.
struct TransformParts {
  const Pose* pose;
  const StatedCovariance* covariance;

  [[nodiscard]] Transform whole() const { return {*pose, *covariance}; }
};

/// The path from a frame S up towards its root. The sum Σ Ad(X_SC) Σ_C Ad(X_SC)ᵀ over the climbed
/// edges (C is the child of each) needs one adjoint per edge, whatever follows. Edges are computed
/// in batches, which keeps the arithmetic in registers. So a value passed to up() must stay in
/// place until the accumulation is joined.
///
/// @tparam Value  Transform, or Pose if no covariance is needed
template <class Value>
class PathAccumulation {
 public:
  // NOLINTNEXTLINE(*-member-init,*-use-equals-default): what is pending is written before it is read
  PathAccumulation() {}

  /// Goes up one edge with value X_PC, from C, the frame reached so far, to P.
  void up(const Value& X_PC) {
    if constexpr (std::is_same_v<Value, Transform>) complete_ &= X_PC.covariance.complete();
    push(kernel::edge_of(X_PC));
  }
  /// As up(), known exactly.
  void up_exactly(const Pose& X_PC);

  /// As up(), for X_PC at the fraction s between X0 and X1 (interpolate()), whose parts must also
  /// stay in place.
  void up_between(const TransformParts& X0, const TransformParts& X1, double s);

  /// Storage in which to compute a value for the next up().
  [[nodiscard]] Value& place() { return computed_[count_]; }

  /// The pose X_SC of the frame reached so far.
  [[nodiscard]] const kernel::Columns& reached() {
    if (count_ > 0 || climbed_.empty) climb();
    return climbed_.X_SH;
  }

  /// X_AB, if A and B climbed to the same frame. Independent errors, first order.
  template <class V>
  friend void join(PathAccumulation<V>&& from_a, PathAccumulation<V>&& from_b, V& X_AB);

 private:
  void push(const kernel::Edge& edge) {
    pending_[count_++] = edge;
    if (count_ == pending_.size()) climb();
  }
  void climb();
  /// Interpolates what is pending here and, unless it is null, in the other one.
  void blend(PathAccumulation* other);

  kernel::Climb climbed_;
  // The edges after those, and which of them are still to be interpolated. Not zeroed, which would
  // take as long as a short lookup.
  std::array<kernel::Edge, 16> pending_;
  union {
    std::array<Value, 16> computed_;
  };
  union {
    std::array<kernel::Blend, 16> blends_;
  };
  std::size_t count_ = 0;
  std::size_t blend_count_ = 0;
  bool complete_ = true;  // the covariances of the edges
};

/// Into an object of the caller, which need not copy it.
template <class Value>
void join(PathAccumulation<Value>&& from_a, PathAccumulation<Value>&& from_b, Value& X_AB);

template <class Value>
[[nodiscard]] Value join(PathAccumulation<Value>&& from_a, PathAccumulation<Value>&& from_b) {
  Value X_AB;
  join(std::move(from_a), std::move(from_b), X_AB);
  return X_AB;
}

/// As above with the full error description. To second order, only the common errors of an edge
/// and its part of unknown correlation are transported edge by edge; to fourth order, the errors of
/// each edge are composed with those of the climb, which is ten times slower.
template <>
class PathAccumulation<Belief> {
 public:
  explicit PathAccumulation(Order order) : order_(order) {}

  /// How the error of the next edge is correlated with others; common_errors may be null.
  void correlate_next(bool unknown, const std::vector<CommonError>* common_errors) {
    unknown_ = unknown;
    common_errors_ = common_errors;
  }

  /// The common errors of the next edge; null: none.
  [[nodiscard]] const std::vector<CommonError>* next_errors() const { return common_errors_; }
  /// Gives it these instead.
  void replace_next(const std::vector<CommonError>& common_errors) {
    common_errors_ = &common_errors;
  }

  void up(const Transform& X_PC);
  void up_between(const TransformParts& X0, const TransformParts& X1, double s);
  [[nodiscard]] Transform& place() {
    if (correlated()) (void)own_.reached();  // up() needs it, and it frees all places
    return own_.place();
  }

  template <class V>
  friend void join(PathAccumulation<V>&& from_a, PathAccumulation<V>&& from_b, V& X_AB);

 private:
  [[nodiscard]] bool correlated() const { return unknown_ || common_errors_ != nullptr; }

  Order order_;
  // To second order: own parts, as of a transform; all other parts of the error in the start's
  // frame, where they are needed, in X_HS_. To fourth order all is in X_HS_.
  PathAccumulation<Transform> own_;
  Belief X_HS_;
  bool unknown_ = false;
  const std::vector<CommonError>* common_errors_ = nullptr;
};

}  // namespace tfdude
