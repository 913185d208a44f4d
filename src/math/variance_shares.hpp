#pragma once

#include <cstddef>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "tfdude/math/observation.hpp"

namespace tfdude {

/// One number that depends on the error of a path, to first order: how far B's origin is off along
/// a direction, or how far B is turned about one.
struct PathFunctional {
  Eigen::Vector3d direction;  ///< a unit vector: along the axes of A, or about the axes of B
  bool is_rotation = false;
  Twist gradient;  ///< by the right perturbation of X_AB
};

/// The direction in which the position of B in A is the least certain; if it is known exactly, the
/// axis about which B is.
[[nodiscard]] PathFunctional worst_direction(const Transform& X_AB);

/// The parts of the variance of such a number.
struct VarianceShares {
  double total = 0;                       ///< the sum of all below
  std::vector<double> edges;              ///< of own parts, by edge
  std::map<std::string, double> sources;  ///< of common errors, less what observations have removed
  /// The variance after an observation of each edge, by an independent error: it corrects the edge
  /// and those that observations have tied to it, but estimates no source.
  std::vector<double> after;
};

/// @param edges  of the path from A to B, in order. Parts of unknown correlation are left out, as
///   only a bound of their sum is known.
/// @param sensor  variances of a measurement of an edge, in the axes of its child
[[nodiscard]] VarianceShares variance_shares(const std::vector<ObservedEdge>& edges,
                                             const PathFunctional& functional,
                                             const Eigen::Matrix<double, 6, 1>& sensor);

}  // namespace tfdude
