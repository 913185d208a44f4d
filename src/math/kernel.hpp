#pragma once

#include <cstddef>

// The arithmetic in which lookups spend most of their time, on plain arrays. It is compiled for any
// processor of the architecture and, on x86-64, also for those with AVX2 and FMA; the choice is
// made at run time. With products of 3x3 matrices, edge by edge, a lookup of 30 edges with
// covariance took 1.3 times as long as in tf2; with this kernel it takes 0.56 of tf2's time
// (core/lookup in bench/REPORT.md).
//
// Matrices have three columns of four numbers. The fourth is zero, so that a column fits one AVX
// register.
namespace tfdude::kernel {

/// A pose: R and t of X = [R, t].
struct alignas(32) Columns {
  double R[3][4] = {{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}};
  double t[4] = {0, 0, 0, 0};
};

/// A covariance [P, C; Cᵀ, Q].
struct alignas(32) Blocks {
  double P[3][4] = {};
  double C[3][4] = {};
  double Q[3][4] = {};
};

/// An edge as stored in Transform: quaternion x, y, z, w, translation, upper triangle of the
/// covariance.
using Edge = const double*;

/// One interpolation.
struct Blend {
  Edge X0 = nullptr;  ///< of these, the poses are read
  Edge X1 = nullptr;
  const double* upper0 = nullptr;  ///< the covariance of X0, as an upper triangle; maybe that of X1
  const double* upper1 = nullptr;
  double s = 0;
  double* X = nullptr;  ///< output; room for an edge, not X0 or X1
  bool near = false;    ///< output: the two are less than 0.1 rad apart; otherwise X is not written
};

/// The functions compiled for one instruction set.
struct Functions {
  /// X_SH := X_SC · X_PC⁻¹ for each edge in turn, C the frame reached so far.
  void (*accumulate)(Columns& X_SH, const Edge* edges, std::size_t count);
  /// As accumulate; before each step sum += Ad(X_SC) Σ_C Ad(X_SC)ᵀ.
  void (*accumulate_with_covariance)(Columns& X_SH, Blocks& sum, const Edge* edges,
                                     std::size_t count);
  /// X · Y⁻¹.
  Columns (*quotient)(const Columns& X, const Columns& Y);
  /// sum += Ad(X) Σ Ad(X)ᵀ, with Σ as an upper triangle, row by row.
  void (*add_transported)(const Columns& X, const double* upper, Blocks& sum);
  /// As interpolate(), for the pairs that are near.
  void (*blend_poses)(Blend* all, std::size_t count);
  void (*blend_with_covariance)(Blend* all, std::size_t count);
};

/// For any processor of the architecture.
extern const Functions kPortable;

/// The fastest functions that this processor supports.
[[nodiscard]] const Functions& functions();

}  // namespace tfdude::kernel
