#pragma once

#include <type_traits>

#include "tfdude/math/belief.hpp"
#include "tfdude/math/transform.hpp"

#include "math/kernel.hpp"

namespace tfdude::kernel {

/// Conversions between the library's types and the kernel's.
[[nodiscard]] Columns columns_of(const Pose& X);
[[nodiscard]] Pose pose_of(const Edge& edge);
[[nodiscard]] Transform transform_of(const Edge& edge);

/// Ad(X) Σ Ad(X)ᵀ.
[[nodiscard]] Covariance transported(const Columns& X, const Covariance& sigma);
/// sum += Ad(X) F; the sum gets as many columns as it needs.
void add_transported(const Columns& X, const Loading& F, Loading& sum);

/// The numbers of a pose or transform, as the kernel reads and writes them.
template <class Value>
[[nodiscard]] const double* numbers_of(const Value& X) {
  static_assert(std::is_same_v<Value, Pose> || std::is_same_v<Value, Transform>);
  // NOLINTNEXTLINE(cppcoreguidelines-pro-type-reinterpret-cast): of doubles, columns.cpp
  return reinterpret_cast<const double*>(&X);
}
template <class Value>
[[nodiscard]] double* numbers_of(Value& X) {
  static_assert(std::is_same_v<Value, Pose> || std::is_same_v<Value, Transform>);
  // NOLINTNEXTLINE(cppcoreguidelines-pro-type-reinterpret-cast): of doubles, columns.cpp
  return reinterpret_cast<double*>(&X);
}

[[nodiscard]] inline Edge edge_of(const Pose& X) { return {numbers_of(X), nullptr}; }
[[nodiscard]] inline Edge edge_of(const Pose& X, const StatedCovariance& sigma) {
  return {numbers_of(X), sigma.of_specified().upper().data()};
}
[[nodiscard]] inline Edge edge_of(const Transform& X) { return edge_of(X.pose, X.covariance); }

}  // namespace tfdude::kernel
