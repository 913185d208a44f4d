#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "tfdude/base/export.hpp"
#include "tfdude/math/belief.hpp"

// A measurement of the pose of one end of a path in the other, and its effect on the path's edges.
namespace tfdude {

/// An edge affected by an observation.
struct ObservedEdge {
  enum class Way : std::uint8_t {
    kDown,    ///< the path goes from the parent to the child
    kUp,      ///< the path goes from the child to the parent
    kBeside,  ///< not on the path, but correlated with an edge of it by an earlier observation
  };
  Belief X_PC;  ///< as its owner estimates it
  Way way = Way::kDown;
};

/// How to judge a measurement.
struct ObserveOptions {
  /// Probability with which a correct measurement is accepted: those with a squared Mahalanobis
  /// distance beyond this quantile of χ² are rejected. 1: accepts all.
  double gate = 0.999;
  /// False: the measurement may be correlated with the values of the edges; covariance intersection
  /// is used.
  bool independent = true;
};

/// What an observation shows about one edge's covariance. Over many observations the mean of
/// `squares` is that of `expected` if the covariance is right, and greater if it is too small. This
/// is the estimate of a variance component, v'Σ⁻¹v over its redundancy (Förstner, "Ein Verfahren
/// zur Schätzung von Varianz- und Kovarianzkomponenten", 1979).
struct NormalizedInnovation {
  double squares = 0;
  double expected = 0;
  double variance = 0;  ///< of `squares`, if the covariances are right
};

/// Maximum number of edges whose errors stay correlated after an observation.
inline constexpr std::size_t kMaxObservedTogether = 112;

/// An edge after an observation.
struct ObservedResult {
  Belief X_PC;
  bool corrected = false;  ///< false: unchanged
  /// More than kMaxObservedTogether edges are correlated. This one is among the least correlated
  /// with the path. Its error now counts as independent of the others, or, if it had more than a
  /// tenth in common with one of them along an axis, as of unknown correlation.
  bool forgotten = false;
  NormalizedInnovation innovation;
};

struct Observation {
  /// Of the measurement from the estimate, squared Mahalanobis distance: the least sum of squares
  /// by which edges and measurement explain each other. Infinite if they contradict each other in a
  /// direction that both know exactly.
  double distance_squared = 0;
  int dimensions = 0;                 ///< of that distance
  double limit = 0;                   ///< of the gate; infinite without a gate
  bool accepted = false;              ///< within the limit
  std::vector<ObservedResult> edges;  ///< in the given order; corrected if accepted
};

/// Distributes a measurement of X_AB over the edges of the path from A to B. Finds the most
/// probable perturbations ξᵢ of all edges at once, which minimize Σ ξᵀ P⁻¹ ξ + eᵀ R⁻¹ e with e =
/// Log(Z⁻¹ X_AB(ξ)), by Gauss-Newton (an iterated Kalman update). P is the joint covariance of the
/// edges' beliefs. Edges without uncertainty stay unchanged. The gate judges the sum there.
///
/// The correlation between the edges afterwards is kept in common errors of a new source, which
/// replaces those of earlier observations. So it is exact to first order for every path, and a
/// second observation does not treat the edges' errors as independent. Common errors of other
/// sources are kept as in a Schmidt-Kalman filter: what other edges hold of such a source need not
/// change. A single uncertain edge takes all of the correction, and needs no new source. The
/// columns are few if others depend on a few edges only, and otherwise little more than the edges
/// have dimensions. At most kMaxObservedTogether edges stay correlated.
///
/// Parts of unknown correlation count as part of the measurement's error, which is then not
/// independent of the rest. If such an edge is the only uncertain one, it is corrected by
/// covariance intersection.
///
/// An edge of unspecified covariance takes what the measurement says, whatever its value was: the
/// distance is then zero, of no dimensions. Its error is correlated with those of the other edges
/// accordingly; if the measurement or an edge is of unknown correlation, so is this edge from then
/// on.
/// O(edges · columns²).
/// @param edges  the edges of the path in order, and, at any place among them, all others that
///   share a source created by an observation with them
/// @param Z_AB  the measurement
/// @param source  the name of the new source: kObservedPrefix and a suffix unique to this
///   observation
/// @return kInvalidInput: the covariance of the measurement, or of several edges of the path, is
///   unspecified; no edge is uncertain; several edges are of unknown correlation and no
///   other is uncertain; a gate outside (0, 1]; no convergence.
[[nodiscard]] TFDUDE_EXPORT Result<Observation> observe(const std::vector<ObservedEdge>& edges,
                                                        const Transform& Z_AB,
                                                        const std::string& source,
                                                        const ObserveOptions& options = {});

}  // namespace tfdude
