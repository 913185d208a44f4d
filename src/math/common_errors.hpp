#pragma once

#include <algorithm>
#include <utility>
#include <vector>

#include "tfdude/math/belief.hpp"

namespace tfdude {

[[nodiscard]] inline bool same_source(const CommonError& a, const CommonError& b) {
  return a.source == b.source && a.subtracts == b.subtracts;
}

/// Whether an observation has left nothing there but the name by which it is recognised.
[[nodiscard]] inline bool is_name_only(const CommonError& common_error) {
  return is_observed(common_error) && common_error.loading.isZero(0);
}

/// The entry for the same source in a list; null: none.
template <class List>
[[nodiscard]] auto of_same_source(List& common_errors, const CommonError& common_error)
    -> decltype(common_errors.data()) {
  const auto found =
      std::find_if(common_errors.begin(), common_errors.end(),
                   [&](const CommonError& other) { return same_source(other, common_error); });
  return found == common_errors.end() ? nullptr : &*found;
}

/// Appends columns of zeros until the loading has `columns`.
inline void widen(Loading& loading, Eigen::Index columns) {
  const Eigen::Index before = loading.cols();
  if (columns <= before) return;
  loading.conservativeResize(Eigen::NoChange, columns);
  loading.rightCols(columns - before).setZero();
}

/// Adds errors, source by source and column by column.
void add_errors(const std::vector<CommonError>& more, std::vector<CommonError>& sum);

/// Adds up those that have got the same name.
inline void add_up(std::vector<CommonError>& errors) {
  std::vector<CommonError> sum;
  add_errors(errors, sum);
  errors = std::move(sum);
}

/// The errors of a value that is this multiple of another one.
[[nodiscard]] inline std::vector<CommonError> times(const Matrix6d& factor,
                                                    std::vector<CommonError> common_errors) {
  for (CommonError& one : common_errors) one.loading = (factor * one.loading).eval();
  return common_errors;
}

}  // namespace tfdude
