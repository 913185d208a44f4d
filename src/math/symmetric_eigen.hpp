#pragma once

#include "tfdude/math/pose.hpp"

namespace tfdude {

/// A = V diag(values) Vᵀ of a symmetric matrix.
struct SymmetricEigen {
  Twist values;  ///< ascending
  Matrix6d vectors;

  /// V diag(f(values)) Vᵀ.
  template <class Function>
  [[nodiscard]] Matrix6d of(Function f) const {
    const Twist changed = values.unaryExpr(f);
    return vectors * changed.asDiagonal() * vectors.transpose();
  }
};

/// In a file of its own, as the compiler needs seconds for the solver wherever it is used.
[[nodiscard]] SymmetricEigen symmetric_eigen(const Matrix6d& symmetric);

}  // namespace tfdude
