#pragma once

#include "tfdude/math/belief.hpp"

namespace tfdude {

[[nodiscard]] inline bool same_source(const CommonError& a, const CommonError& b) {
  return a.source == b.source && a.subtracts == b.subtracts;
}

/// Appends columns of zeros until the loading has `columns`.
inline void widen(Loading& loading, Eigen::Index columns) {
  const Eigen::Index before = loading.cols();
  if (columns <= before) return;
  loading.conservativeResize(Eigen::NoChange, columns);
  loading.rightCols(columns - before).setZero();
}

}  // namespace tfdude
