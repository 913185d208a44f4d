#pragma once

#include <cstddef>

// The arithmetic that lookups spend their time in, on plain arrays, compiled once for any processor of the
// architecture and, on x86-64, once for those with AVX2 and FMA; the processor at hand decides at run time.
// A lookup of 30 edges with covariance took 1.3 of tf2's time with products of 3x3 matrices, edge by edge, and takes
// 0.56 of it with this (core/lookup in bench/REPORT.md).
//
// Matrices are three columns of four numbers, of which the fourth is zero, so that a column is one AVX register.
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

/// An edge as it lies in Transform: quaternion x, y, z, w, translation, upper triangle of the covariance.
using Edge = const double*;

/// What is to be interpolated.
struct Blend {
  Edge X0 = nullptr;
  Edge X1 = nullptr;
  double s = 0;
  double* X = nullptr;  ///< where to; room for an edge, another than X0 and X1
  bool near = false;    ///< says whether the two are less than 0.1 rad apart; else X is not written
};

/// Compiled for one instruction set.
struct Functions {
  /// X_SH := X_SC · X_PC⁻¹ for each edge in turn, C the frame reached so far.
  void (*accumulate)(Columns& X_SH, const Edge* edges, std::size_t count);
  /// The same, and before each step sum += Ad(X_SC) Σ_C Ad(X_SC)ᵀ.
  void (*accumulate_with_covariance)(Columns& X_SH, Blocks& sum, const Edge* edges,
                                     std::size_t count);
  /// X · Y⁻¹.
  Columns (*quotient)(const Columns& X, const Columns& Y);
  /// sum += Ad(X) Σ Ad(X)ᵀ, Σ an upper triangle row by row.
  void (*add_transported)(const Columns& X, const double* upper, Blocks& sum);
  /// As interpolate(), for those pairs that are near: X_0 to X_count.
  void (*blend_poses)(Blend* all, std::size_t count);
  void (*blend_with_covariance)(Blend* all, std::size_t count);
};

/// For any processor of the architecture.
extern const Functions kPortable;

/// The fastest for the processor at hand.
[[nodiscard]] const Functions& functions();

}  // namespace tfdude::kernel
