#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "tfdude/base/export.hpp"
#include "tfdude/math/belief.hpp"

// A measurement of where one end of a path is seen from the other, and what it tells of the path's edges.
namespace tfdude {

/// An edge that an observation concerns.
struct ObservedEdge {
  enum class Way : std::uint8_t {
    kDown,    ///< the path goes from the parent to the child,
    kUp,      ///< or from the child to the parent;
    kBeside,  ///< or not along it, but its error has to do with that of an edge of the path by an earlier observation
  };
  Belief X_PC;  ///< as its owner believes it to be
  Way way = Way::kDown;
};

/// How a measurement is judged.
struct ObserveOptions {
  /// Where a part of all right measurements above this would be refused: those whose squared Mahalanobis distance is
  /// beyond this quantile of χ². 1: none is.
  double gate = 0.999;
  /// False: the measurement may have to do with what the edges' values come from; then by covariance intersection.
  bool independent = true;
};

/// What an observation says of one edge's covariance. Over many observations the mean of `squares` is that of `expected` if
/// the covariance is right, and more if it is too small: the estimate of a variance component, v'Σ⁻¹v over its redundancy
/// (Förstner, "Ein Verfahren zur Schätzung von Varianz- und Kovarianzkomponenten", 1979).
struct NormalizedInnovation {
  double squares = 0;
  double expected = 0;
  double variance = 0;  ///< of squares, where all is as believed
};

/// One edge as it is after an observation.
struct ObservedResult {
  Belief X_PC;
  bool corrected = false;  ///< false: it is what it was
  NormalizedInnovation innovation;
};

struct Observation {
  double distance_squared = 0;        ///< of the measurement from what was believed, Mahalanobis
  int dimensions = 0;                 ///< that it has a distance in
  double limit = 0;                   ///< the gate's; infinite if there is none
  bool accepted = false;              ///< within the limit
  std::vector<ObservedResult> edges;  ///< in the order given; corrected where accepted
};

/// Distributes a measurement of X_AB over the edges of the path from A to B: the most probable perturbations ξᵢ of all
/// edges at once, of which Σ ξᵀ P⁻¹ ξ + eᵀ R⁻¹ e with e = Log(Z⁻¹ X_AB(ξ)) is least, by Gauss-Newton (an iterated
/// Kalman update); P is the joint covariance that the edges' beliefs make. Edges without uncertainty stay as they are.
///
/// What the edges know of each other afterwards is kept in common errors of a new source, which takes the place of those
/// that earlier observations have left: so it is exact to first order for every path, and a second observation is not
/// counted as if it were of edges with independent errors. Common errors of other sources are kept as a Schmidt-Kalman
/// filter keeps them: what others hold of such a source need not change. An uncertain edge that is alone takes all of the
/// correction, and needs none. More columns than a loading may have are left out so that no covariance becomes too small.
///
/// Parts of unknown correlation count to the measurement's error: it is then not independent of the rest. An edge that is
/// alone with such a part is corrected by covariance intersection.
/// O(edges · columns²).
/// @param edges  those of the path in its order, and among them, anywhere, all others that depend on a source that an
///   observation has made in common with them
/// @param Z_AB  the measurement
/// @param source  the name of the new source: kObservedPrefix and something that no other observation has
/// @return kInvalidInput: no edge has any uncertainty, several are of unknown correlation and no other is uncertain,
///   a gate that is not within (0, 1], nothing that converges.
[[nodiscard]] TFDUDE_EXPORT Result<Observation> observe(const std::vector<ObservedEdge>& edges,
                                                        const Transform& Z_AB,
                                                        const std::string& source,
                                                        const ObserveOptions& options = {});

}  // namespace tfdude
