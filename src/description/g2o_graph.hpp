#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "tfdude/base/result.hpp"
#include "tfdude/math/transform.hpp"
#include "tfdude/types/correlation.hpp"

namespace tfdude {

/// A pose graph as g2o has it: the error of an edge is the translation and the vector part of the
/// quaternion of Z⁻¹ X_from⁻¹ X_to, where Z was measured.
struct G2oGraph {
  struct Vertex {
    Pose X_MV;  ///< in the map
    bool fixed = false;
    int line = 0;
  };
  struct Edge {
    std::size_t from = 0;  ///< index of its vertex
    std::size_t to = 0;
    Pose Z;
    Matrix6d information;
    int line = 0;
  };

  std::vector<Vertex> vertices;
  std::vector<std::string> ids;  ///< of the vertices
  std::vector<Edge> edges;
};

/// The error of a pose in the map.
struct G2oError {
  Covariance own;
  std::vector<CommonError> common_errors;
};

/// Maximum number of poses that are not fixed: a few megabytes of common errors.
inline constexpr std::size_t kMaxG2oPoses = 300;

/// The errors of all poses, jointly: the inverse of the Gauss-Newton matrix at the poses, of right
/// perturbations. Without a fixed vertex the first one is fixed, and its error is zero.
/// @param source  prefix of the names of the sources
/// @return one per vertex; kInvalidInput naming file and vertex: not determined, not the solution;
///   kTooMuch: more than kMaxG2oPoses.
[[nodiscard]] Result<std::vector<G2oError>> g2o_errors(const G2oGraph& graph,
                                                       const std::string& source,
                                                       const std::string& file);

}  // namespace tfdude
