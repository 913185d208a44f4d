#pragma once

#include <algorithm>
#include <string>
#include <vector>

#include "tfdude/math/observation.hpp"

#include "math/square_root.hpp"

namespace tfdude {

/// An error of all edges, in standard deviations of the own parts and of the sources.
struct Deviations {
  std::vector<Eigen::VectorXd> own;
  std::vector<Eigen::VectorXd> of_source;
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

  /// Takes the own parts and common errors of the edges, with bounded rotations
  /// (unknown_rotation.hpp). Edges without either are left out.
  explicit JointPrior(const std::vector<ObservedEdge>& all);

  /// Treats the edge's unknown part as its own; no other edge of the path may be uncertain. Those
  /// beside the path are left out.
  void take_unknown(std::size_t edge);
  [[nodiscard]] bool is_of_unknown() const { return of_unknown_; }

  /// Indices of the uncertain edges.
  [[nodiscard]] const std::vector<std::size_t>& edges() const { return edges_; }
  [[nodiscard]] const std::vector<Matrix6d>& own() const { return own_; }
  /// Roots of the own parts.
  [[nodiscard]] const std::vector<Loading>& own_roots() const { return own_roots_; }
  [[nodiscard]] const std::vector<Source>& sources() const { return sources_; }

  /// Whether an uncertain edge is not on the path.
  [[nodiscard]] bool is_beside(std::size_t i) const {
    return all_[edges_[i]].way == ObservedEdge::Way::kBeside;
  }

  /// Whether an uncertain edge is on the path.
  [[nodiscard]] bool has_path() const {
    const auto on_path = [&](std::size_t k) { return all_[k].way != ObservedEdge::Way::kBeside; };
    return std::any_of(edges_.begin(), edges_.end(), on_path);
  }

  /// Whether errors of several edges are correlated.
  [[nodiscard]] bool is_tied() const;

  /// A root of P_ii.
  [[nodiscard]] Loading marginal(std::size_t i) const;
  /// Standard deviations of the edge.
  [[nodiscard]] Twist deviations(std::size_t i) const;

  /// A root of H P Hᵀ. @param H  one per edge, for all edges
  [[nodiscard]] Loading path(const std::vector<Matrix6d>& H) const;
  /// A root of Σ H_i own_i H_iᵀ, with all columns.
  [[nodiscard]] Loading own_on_path(const std::vector<Matrix6d>& H) const;
  /// The standard deviations that the path would have if nothing in P cancelled.
  [[nodiscard]] Twist size_on_path(const std::vector<Matrix6d>& H) const;
  /// Standard deviations that a measurement must leave of the path's error, where the errors of
  /// edges cancel, so that it is not lost in their rounding.
  /// @param of_all  false: one edge takes the whole error of others, and nothing of its own cancels
  [[nodiscard]] Twist least_on_path(const std::vector<Matrix6d>& H, bool of_all) const;
  /// P Hᵀ Wᵀ by edge. What is whitened keeps its digits over long levers.
  [[nodiscard]] std::vector<Loading> with_path(const std::vector<Matrix6d>& H,
                                               const Whitening& W) const;
  /// That of one edge.
  [[nodiscard]] Loading with_path(const std::vector<Matrix6d>& H, const Whitening& W,
                                  std::size_t i) const;

  /// The most probable error if the whitened path shows y: P Hᵀ Wᵀ y.
  [[nodiscard]] Deviations most_probable(const std::vector<Matrix6d>& H, const Whitening& W,
                                         const Eigen::VectorXd& y) const;
  /// ξ of the uncertain edges.
  [[nodiscard]] std::vector<Twist> errors(const Deviations& deviations) const;
  /// ξᵀ P⁺ ξ of a most probable error.
  [[nodiscard]] double cost(const Deviations& deviations) const;

  /// P times a factor.
  void widen(double by);

 private:
  // What an edge adds to the variances of the path's axes if nothing cancels.
  [[nodiscard]] Twist uncancelled(const std::vector<Matrix6d>& H, std::size_t i) const;

  const std::vector<ObservedEdge>& all_;
  std::vector<std::size_t> edges_;
  std::vector<Matrix6d> own_;
  std::vector<Loading> own_roots_;
  std::vector<Source> sources_;
  bool of_unknown_ = false;
};

}  // namespace tfdude
