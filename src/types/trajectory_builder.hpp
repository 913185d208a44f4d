#pragma once

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "tfdude/types/many.hpp"

namespace tfdude {

/// Puts answers together to a trajectory, in any order.
class TrajectoryBuilder {
 public:
  explicit TrajectoryBuilder(std::size_t instants) { trajectory_.X_AB.resize(instants); }

  void add(std::size_t i, const Result<StampedTransform>& found) {
    if (!found) return add_missing(i, found.error());
    trajectory_.X_AB[i] = static_cast<const Transform&>(*found);
    add(found->basis);
  }

  [[nodiscard]] Trajectory take() && {
    auto& missing = trajectory_.missing;
    std::stable_sort(missing.begin(), missing.end(),
                     [](const auto& x, const auto& y) { return x.first < y.first; });
    std::vector<MissingInstants> runs;
    for (MissingInstants& one : missing) {
      if (!runs.empty() && continues(runs.back(), one.first, one.error)) {
        runs.back().count += one.count;
      } else {
        runs.push_back(std::move(one));
      }
    }
    missing = std::move(runs);
    return std::move(trajectory_);
  }

  static void merge(const Basis& from, Basis& to) {
    to.order = from.order;
    to.bound = to.bound || from.bound;
    merge(from.sources, to.sources);
    merge(from.unspecified, to.unspecified);
  }

 private:
  static void merge(const std::vector<std::string>& from, std::vector<std::string>& to) {
    for (const std::string& name : from) {
      if (std::find(to.begin(), to.end(), name) == to.end()) to.push_back(name);
    }
  }
  void add(const Basis& basis) { merge(basis, trajectory_.basis); }
  static bool continues(const MissingInstants& run, std::size_t i, const Error& error) {
    return run.first + run.count == i && run.error.code == error.code;
  }
  void add_missing(std::size_t i, const Error& error) {
    auto& missing = trajectory_.missing;
    if (!missing.empty() && continues(missing.back(), i, error)) {
      ++missing.back().count;
    } else {
      missing.push_back({i, 1, error});
    }
  }

  Trajectory trajectory_;
};

}  // namespace tfdude
