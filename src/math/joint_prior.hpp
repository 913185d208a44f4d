#pragma once

#include <string>
#include <vector>

#include "tfdude/math/observation.hpp"

namespace tfdude {

/// How the edges are correlated with the end of the path: P Hᵀ by edge, and H P Hᵀ.
struct Moments {
  std::vector<Matrix6d> with_edge;
  Matrix6d of_path;
};

/// The joint covariance P of the uncertain edges: P_ij = δ_ij own_i + Σ ± F_i F_jᵀ over the
/// sources.
class JointPrior {
 public:
  /// The edges' shares of one source: a loading per uncertain edge, all with the same columns.
  struct Source {
    std::string name;
    bool subtracts = false;
    std::vector<Loading> loadings;

    [[nodiscard]] double sign() const { return subtracts ? -1.0 : 1.0; }
    /// Σ H_i F_i.
    [[nodiscard]] Loading on_path(const JointPrior& prior, const std::vector<Matrix6d>& H) const;
  };

  /// Takes the own parts and common errors of the edges. Edges without either are left out.
  explicit JointPrior(const std::vector<ObservedEdge>& all);

  /// Treats the edge's unknown part as its own; no other edge may be uncertain.
  void take_unknown(std::size_t edge);
  [[nodiscard]] bool is_of_unknown() const { return of_unknown_; }

  /// Indices of the uncertain edges.
  [[nodiscard]] const std::vector<std::size_t>& edges() const { return edges_; }
  [[nodiscard]] const std::vector<Matrix6d>& own() const { return own_; }
  [[nodiscard]] const std::vector<Source>& sources() const { return sources_; }

  /// Whether an uncertain edge is not on the path.
  [[nodiscard]] bool is_beside(std::size_t i) const {
    return all_[edges_[i]].way == ObservedEdge::Way::kBeside;
  }

  /// P_ii.
  [[nodiscard]] Matrix6d marginal(std::size_t i) const;

  /// @param H  one per edge, for all edges
  [[nodiscard]] Moments moments(const std::vector<Matrix6d>& H) const;

  /// P times a factor.
  void widen(double by);

 private:
  const std::vector<ObservedEdge>& all_;
  std::vector<std::size_t> edges_;
  std::vector<Matrix6d> own_;
  std::vector<Source> sources_;
  bool of_unknown_ = false;
};

}  // namespace tfdude
