#pragma once

#include <cstddef>

// The arithmetic in which lookups spend most of their time, on plain arrays. It is compiled for any
// processor of the architecture and, on x86-64, also for those with AVX2 and FMA; the choice is
// made at run time. With products of 3x3 matrices, edge by edge, a lookup of 30 edges with
// covariance took 1.3 times as long as in tf2; with this kernel it takes 0.4 of tf2's time
// (core/lookup in bench/REPORT.md).
//
// Matrices have three columns of four numbers. The fourth is zero, so that a column fits one AVX
// register.
namespace tfdude::kernel {

/// A pose: R and t of X = [R, t].
struct alignas(32) Columns {
  double R[3][4];
  double t[4];
};

/// A covariance [P + Pᵀ, C; Cᵀ, Q]. P is not symmetric, because a part and its transpose are
/// computed once.
struct alignas(32) Blocks {
  double P[3][4];
  double C[3][4];
  double Q[3][4];
};

/// An edge, where it is stored.
struct Edge {
  const double* pose;   ///< quaternion x, y, z, w, translation
  const double* upper;  ///< upper triangle of the covariance; not read if only poses are computed
};

/// A climb from a frame S, as far as it is accumulated.
// NOLINTNEXTLINE(cppcoreguidelines-pro-type-member-init): what is not read is not written
struct Climb {
  bool empty = true;  ///< S itself; the rest is not written yet
  Columns X_SH;       ///< pose of the frame reached (here, H)
  Blocks sum;         ///< of its left perturbation, expressed in S
};

/// Edges of a climb that are not accumulated yet, upwards.
struct Edges {
  const Edge* first;
  std::size_t count;
};

/// One interpolation.
struct Blend {
  Edge X0{};
  Edge X1{};  ///< its covariance may be that of X0
  double s = 0;
  double* X = nullptr;  ///< output: the pose; and the covariance, but not if that of X0 is returned
  Edge* edge = nullptr;  ///< output: where both are
  bool near = false;  ///< output: the two are less than 0.1 rad apart; otherwise nothing is written
};

/// The covariance of the product of two errors to fourth order (compose() in belief.hpp). Each is
/// an own part and common errors. All covariances are upper triangles.
struct Fourth {
  const double* own[2] = {};      ///< of the own parts
  const double* all[2] = {};      ///< with the common errors
  const double* joint = nullptr;  ///< E[ξ1 ξ2ᵀ], column by column; null if they are independent
  double* sum = nullptr;          ///< output: without what only common errors make
  /// Output: the derivatives D = [M, N; 0, M] of the terms of third order.
  alignas(32) double M[2][3][4] = {};
  alignas(32) double N[2][3][4] = {};
};

/// A pose, and by how much what is transported by it counts.
struct Weighted {
  Columns X;
  double weight;
};

/// The functions compiled for one instruction set.
struct Functions {
  /// X_SH := X_SC · X_PC⁻¹ for each edge in turn, C the frame reached so far.
  void (*climb)(Climb& climb, const Edges& edges);
  /// As climb(); before each step sum += Ad(X_SC) Σ_C Ad(X_SC)ᵀ.
  void (*climb_with_covariance)(Climb& climb, const Edges& edges);
  /// X_AB of two climbs to the same frame: as in Transform, quaternion, translation, and the upper
  /// triangle of the covariance. The edges of A that are not accumulated yet are walked downwards,
  /// so that their covariances need not be transported from A to B.
  void (*join)(const Climb& a, const Edges& from_a, const Climb& b, const Edges& from_b,
               double* X_AB);
  void (*join_with_covariance)(const Climb& a, const Edges& from_a, const Climb& b,
                               const Edges& from_b, double* X_AB);
  /// Ad(X) Σ Ad(X)ᵀ, both as upper triangles, row by row.
  void (*transport)(const Columns& X, const double* upper, double* transported);
  /// Σ w Ad(X) Σ Ad(X)ᵀ over `count` poses.
  void (*transport_sum)(const Weighted* all, std::size_t count, const double* upper, double* sum);
  /// sum += Ad(X) F, both with six rows and `count` columns, column by column.
  void (*add_columns)(const Columns& X, const double* F, std::size_t count, double* sum);
  /// As interpolate(), for the pairs that are near.
  void (*blend_poses)(Blend* const* all, std::size_t count);
  void (*blend_with_covariance)(Blend* const* all, std::size_t count);
  void (*add_fourth)(Fourth& terms);
};

/// For any processor of the architecture.
extern const Functions kPortable;

/// The fastest functions that this processor supports.
[[nodiscard]] const Functions& functions();

}  // namespace tfdude::kernel
