#pragma once

#include "tfdude/math/belief.hpp"

namespace tfdude {

[[nodiscard]] inline bool same_source(const Share& a, const Share& b) {
  return a.source == b.source && a.subtracts == b.subtracts;
}

/// Gives a factor columns of zeros until it has so many.
inline void widen(Factor& factor, Eigen::Index columns) {
  const Eigen::Index before = factor.cols();
  if (columns <= before) return;
  factor.conservativeResize(Eigen::NoChange, columns);
  factor.rightCols(columns - before).setZero();
}

}  // namespace tfdude
