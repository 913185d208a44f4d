#include "description/g2o_graph.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <queue>

#include <Eigen/Cholesky>

#include "tfdude/base/id.hpp"
#include "tfdude/base/number.hpp"

#include "description/file_text.hpp"

namespace tfdude {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr Index kSize = 6;

// An edge's error, and its derivative by the right perturbation of E = Z⁻¹ X_from⁻¹ X_to.
struct Linearized {
  Twist error;
  Matrix6d by_E = Matrix6d::Zero();
};

Linearized linearized(const Pose& E) {
  Eigen::Quaterniond q = E.rotation();
  if (q.w() < 0) q.coeffs() = -q.coeffs();
  Linearized at;
  at.error << E.translation(), q.vec();
  at.by_E.topLeftCorner<3, 3>() = q.toRotationMatrix();
  at.by_E.bottomRightCorner<3, 3>() = (q.w() * Eigen::Matrix3d::Identity() + skew(q.vec())) / 2;
  return at;
}

class Marginals {
 public:
  Marginals(const G2oGraph& graph, const std::string& file) : graph_(graph), file_(file) {
    place_.resize(graph.vertices.size());
    const bool any = std::any_of(graph.vertices.begin(), graph.vertices.end(),
                                 [](const G2oGraph::Vertex& vertex) { return vertex.fixed; });
    for (std::size_t i = 0; i < graph.vertices.size(); ++i) {
      if (graph.vertices[i].fixed || (!any && i == 0)) continue;
      place_[i] = kSize * static_cast<Index>(free_.size());
      free_.push_back(i);
    }
  }

  [[nodiscard]] Result<std::vector<G2oError>> errors(const std::string& source) {
    if (free_.size() > kMaxG2oPoses) {
      return fail(Errc::kTooMuch, file_ + ": has " + std::to_string(free_.size()) +
                                      " poses that are not fixed; covariances are computed for " +
                                      std::to_string(kMaxG2oPoses) + " at most");
    }
    if (auto ok = check_connected(); !ok) return tl::unexpected(ok.error());
    add_edges();
    if (auto ok = invert(); !ok) return tl::unexpected(ok.error());
    if (auto ok = check_solved(); !ok) return tl::unexpected(ok.error());
    return divided(source);
  }

 private:
  [[nodiscard]] tl::unexpected<Error> error(std::size_t vertex, const std::string& message) const {
    return file_error(Errc::kInvalidInput, file_, graph_.vertices[vertex].line,
                      "vertex " + graph_.ids[vertex] + " " + message);
  }

  [[nodiscard]] Result<void> check_connected() const {
    std::vector<std::vector<std::size_t>> beside(graph_.vertices.size());
    for (const G2oGraph::Edge& edge : graph_.edges) {
      beside[edge.from].push_back(edge.to);
      beside[edge.to].push_back(edge.from);
    }
    std::vector<bool> reached(graph_.vertices.size(), false);
    std::queue<std::size_t> waiting;
    for (std::size_t i = 0; i < graph_.vertices.size(); ++i) {
      if (place_[i]) continue;
      reached[i] = true;
      waiting.push(i);
    }
    for (; !waiting.empty(); waiting.pop()) {
      for (const std::size_t other : beside[waiting.front()]) {
        if (reached[other]) continue;
        reached[other] = true;
        waiting.push(other);
      }
    }
    for (const std::size_t i : free_) {
      if (!reached[i]) return error(i, "is not connected with a fixed one");
    }
    return {};
  }

  // The Gauss-Newton matrix and its right side.
  void add_edges() {
    const Index size = kSize * static_cast<Index>(free_.size());
    H_ = MatrixXd::Zero(size, size);
    b_ = VectorXd::Zero(size);
    for (const G2oGraph::Edge& edge : graph_.edges) {
      const Pose& X_from = graph_.vertices[edge.from].X_MV;
      const Pose& X_to = graph_.vertices[edge.to].X_MV;
      const auto at = linearized(edge.Z.inverse() * (X_from.inverse() * X_to));
      const Matrix6d by_from = -at.by_E * adjoint(X_to.inverse() * X_from);
      const std::pair<std::optional<Index>, const Matrix6d*> ends[] = {
          {place_[edge.from], &by_from}, {place_[edge.to], &at.by_E}};
      for (const auto& [row, J_row] : ends) {
        if (!row) continue;
        const Matrix6d weighted = J_row->transpose() * edge.information;
        b_.segment<kSize>(*row) += weighted * at.error;
        for (const auto& [column, J_column] : ends) {
          if (column) H_.block<kSize, kSize>(*row, *column) += weighted * *J_column;
        }
      }
    }
  }

  // Scaled, since metres and radians differ.
  [[nodiscard]] Result<void> invert() {
    constexpr double kLeast = 1e-12;
    for (Index k = 0; k < H_.rows(); ++k) {
      if (!(H_(k, k) > 0)) return undetermined(k);
    }
    const VectorXd scale = H_.diagonal().cwiseSqrt().cwiseInverse();
    const Eigen::LLT<MatrixXd> llt(scale.asDiagonal() * H_ * scale.asDiagonal());
    const VectorXd pivots = llt.matrixLLT().diagonal();
    for (Index k = 0; k < H_.rows(); ++k) {
      if (!(pivots[k] * pivots[k] > kLeast)) return undetermined(k);
    }
    if (llt.info() != Eigen::Success) return undetermined(H_.rows() - 1);
    sigma_ = llt.solve(MatrixXd(scale.asDiagonal()));
    sigma_ = MatrixXd(scale.asDiagonal() * sigma_);
    return {};
  }

  [[nodiscard]] tl::unexpected<Error> undetermined(Index row) const {
    return error(free_[static_cast<std::size_t>(row / kSize)],
                 "is not determined: the information of its edges is singular");
  }

  // A pose that the optimizer would still move has another covariance, and is not the solution.
  [[nodiscard]] Result<void> check_solved() const {
    constexpr double kMost = 0.5;  // standard deviations
    const VectorXd step = sigma_ * b_;
    for (std::size_t i = 0; i < free_.size(); ++i) {
      const Index at = *place_[free_[i]];
      const Matrix6d marginal = sigma_.block<kSize, kSize>(at, at);
      const Twist move = step.segment<kSize>(at);
      const double distance = std::sqrt(move.dot(marginal.ldlt().solve(move)));
      if (distance <= kMost) continue;
      return error(free_[i], "is not at the solution: it would move by " +
                                 number_text(distance, 3) +
                                 " standard deviations; optimize the graph first");
    }
    return {};
  }

  // Σ = D + F Fᵀ. D has the blocks 0.49 H_ii⁻¹, each edge's own. That leaves something positive:
  // edges have two ends, so H is at most twice its blocks, and Σ at least half of their inverses.
  [[nodiscard]] Result<std::vector<G2oError>> divided(const std::string& source) {
    constexpr double kOwn = 0.49;
    std::vector<G2oError> errors(graph_.vertices.size());
    for (const std::size_t i : free_) {
      const Index at = *place_[i];
      const Matrix6d block = H_.block<kSize, kSize>(at, at);
      const Matrix6d inverse = block.ldlt().solve(Matrix6d::Identity());
      const Matrix6d own = kOwn / 2 * (inverse + inverse.transpose());
      sigma_.block<kSize, kSize>(at, at) -= own;
      errors[i].own = Covariance::trusted(own);
    }
    const Eigen::LLT<MatrixXd> llt(sigma_);
    if (llt.info() != Eigen::Success) return undetermined(0);
    const MatrixXd F = llt.matrixL();
    for (const std::size_t i : free_) {
      const Index at = *place_[i];
      for (Index first = 0; first < at + kSize; first += kMaxLoadingColumns) {
        const Index count = std::min<Index>(kMaxLoadingColumns, at + kSize - first);
        errors[i].common_errors.push_back({source + std::to_string(first / kMaxLoadingColumns),
                                           false, F.block(at, first, kSize, count)});
      }
    }
    return errors;
  }

  const G2oGraph& graph_;
  const std::string& file_;
  std::vector<std::optional<Index>> place_;  // of each vertex its first row; none: fixed
  std::vector<std::size_t> free_;            // the vertices with rows, in their order
  MatrixXd H_;
  VectorXd b_;
  MatrixXd sigma_;
};

}  // namespace

Result<std::vector<G2oError>> g2o_errors(const G2oGraph& graph, const std::string& source,
                                         const std::string& file) {
  return Marginals(graph, file).errors(source);
}

}  // namespace tfdude
