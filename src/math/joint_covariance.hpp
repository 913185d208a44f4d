#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <string>
#include <vector>

#include "math/corrected_errors.hpp"
#include "math/decompositions.hpp"
#include "math/instant_sources.hpp"
#include "math/low_rank.hpp"
#include "math/semidefinite.hpp"

namespace tfdude {

/// The joint covariance of all edges, six rows each: own parts, and columns that are added to it or
/// subtracted from it.
class JointCovariance {
 public:
  explicit JointCovariance(std::size_t edges)
      : edges_(static_cast<Eigen::Index>(edges)), columns_(6 * edges_, 0) {}

  void append(const std::vector<Loading>& loadings, bool subtracts) {
    const Eigen::Index first = columns_.cols();
    const Eigen::Index more = loadings.front().cols();
    columns_.conservativeResize(Eigen::NoChange, first + more);
    for (std::size_t i = 0; i < loadings.size(); ++i) {
      columns_.block(6 * static_cast<Eigen::Index>(i), first, 6, more) = loadings[i];
    }
    signs_.conservativeResize(first + more);
    signs_.tail(more).setConstant(subtracts ? -1.0 : 1.0);
  }

  // Columns that add.
  void append(const Eigen::MatrixXd& more) {
    const Eigen::Index first = columns_.cols();
    columns_.conservativeResize(Eigen::NoChange, first + more.cols());
    columns_.rightCols(more.cols()) = more;
    signs_.conservativeResize(first + more.cols());
    signs_.tail(more.cols()).setOnes();
  }

  // Makes the errors of an edge independent of all others.
  void forget(std::vector<CorrectedError>& edges, std::size_t edge) {
    auto rows = columns_.middleRows(6 * static_cast<Eigen::Index>(edge), 6);
    edges[edge].own = nearest_semidefinite(edges[edge].own + product(rows, rows));
    rows.setZero();
  }

  // How much the errors of two edges are correlated: the sum of the squares of the correlations of
  // their elements.
  [[nodiscard]] double correlation(const std::vector<CorrectedError>& edges, std::size_t a,
                                   std::size_t b) const {
    const auto F_a = columns_.middleRows(6 * static_cast<Eigen::Index>(a), 6);
    const auto F_b = columns_.middleRows(6 * static_cast<Eigen::Index>(b), 6);
    const Matrix6d both = product(F_a, F_b);
    const auto inverse_deviations = [&](const auto& F, std::size_t i) {
      const Twist variances = edges[i].own.diagonal() + (F.cwiseAbs2() * signs_);
      return Twist(variances.unaryExpr([](double v) { return v > 0 ? 1 / std::sqrt(v) : 0.0; }));
    };
    return (inverse_deviations(F_a, a).asDiagonal() * both *
            inverse_deviations(F_b, b).asDiagonal())
        .squaredNorm();
  }

  [[nodiscard]] bool empty() const { return columns_.cols() == 0; }

  // Writes the same joint covariance with few columns, as common errors of new sources. All edges
  // that share the sources are here. While there are few, some may subtract.
  void give(std::vector<CorrectedError>& edges, const std::string& name) const {
    Eigen::Index count = columns_.cols();
    if (count <= kMostOfHubs) {
      const Signed own = with_signs();
      count = own.less.cols() + own.more.cols();
      if (count <= kMaxLoadingColumns) return add_signed(edges, {name, {}}, own);
    }
    const Eigen::MatrixXd P = dense(edges);
    if (give_by_hubs(edges, name, P, count)) return;
    for (CorrectedError& edge : edges) edge.own.setZero();
    add_common(edges, {name, {}}, root_of_joint(P), false);
  }

  // The same for many columns that all add.
  // @param before  how many there were before the observation. To look for fewer takes longer than
  //   the observation, so it is done when they have doubled, or are many more than rows
  void give_many(std::vector<CorrectedError>& edges, const std::string& name,
                 Eigen::Index before) const {
    const auto doubled = [](Eigen::Index count) { return std::ilogb(count / kMaxLoadingColumns); };
    const Eigen::Index count = columns_.cols();
    const bool too_many =
        count > columns_.rows() + std::max(kMaxLoadingColumns, columns_.rows() / 8);
    const bool fewer = too_many || doubled(count) > doubled(std::max(before, kMaxLoadingColumns));
    if (fewer && give_by_hubs(edges, name, dense(edges), count / 2)) return;
    add_common(edges, {name, {}}, too_many ? triangle_of_columns(columns_) : columns_, false);
  }

  // The same for errors of a source at some instants, which stay apart. None subtracts. Those
  // beyond the maximum go to the own parts: no correlation of n parts exceeds n times their sum.
  void give_of(std::vector<CorrectedError>& edges, const std::string& name,
               const std::string& said) const {
    const Eigen::MatrixXd more = with_signs().more;
    for (Eigen::Index k = kMostOfInstants; k < more.cols(); ++k) {
      for (std::size_t i = 0; i < edges.size(); ++i) {
        const Twist part = more.col(k).segment<6>(6 * static_cast<Eigen::Index>(i));
        edges[i].own += static_cast<double>(edges.size()) * part * part.transpose();
      }
    }
    add_common(edges, {name, said}, more.leftCols(std::min(more.cols(), kMostOfInstants)), false);
  }

 private:
  struct Name {
    const std::string& observation;
    std::string said;  // empty: no source
  };
  // More blocks on which all others depend are not looked for.
  static constexpr Eigen::Index kMostOfHubs = 4 * kMaxLoadingColumns;
  static constexpr Eigen::Index kMostOfInstants = 4 * kMaxLoadingColumns;
  // Of the sum of what is subtracted from each other.
  static constexpr double kRounding = 1e-14;

  // A diag(signs) Bᵀ.
  [[nodiscard]] Eigen::MatrixXd product(const Eigen::Ref<const Eigen::MatrixXd>& A,
                                        const Eigen::Ref<const Eigen::MatrixXd>& B) const {
    return A * signs_.asDiagonal() * B.transpose();
  }

  // The fewest columns with the same sum.
  struct Signed {
    Eigen::MatrixXd less;
    Eigen::MatrixXd more;
  };

  // Each row is scaled to one before, so that no edge and no unit is judged by another.
  [[nodiscard]] Signed with_signs() const {
    const Eigen::VectorXd size = columns_.rowwise().norm();
    const Eigen::VectorXd unit =
        size.unaryExpr([](double one) { return one > 0 ? 1.0 / one : 0.0; });
    const auto qr = qr_of(unit.asDiagonal() * columns_);
    const Eigen::Index rank = std::min(columns_.rows(), columns_.cols());
    const Eigen::MatrixXd upper = qr.matrixQR().topRows(rank).triangularView<Eigen::Upper>();
    const auto solver = eigen_of(upper, signs_);
    const Eigen::VectorXd& values = solver.eigenvalues();  // ascending
    const Eigen::MatrixXd vectors = size.asDiagonal() * thin_q(qr) * solver.eigenvectors();
    const double least = std::numeric_limits<double>::epsilon() * values.cwiseAbs().maxCoeff();
    Signed found{Eigen::MatrixXd(columns_.rows(), 0), Eigen::MatrixXd(columns_.rows(), 0)};
    const auto put = [&](Eigen::MatrixXd& to, Eigen::Index k) {
      to.conservativeResize(Eigen::NoChange, to.cols() + 1);
      to.rightCols(1) = vectors.col(k) * std::sqrt(std::abs(values[k]));
    };
    for (Eigen::Index k = 0; k < rank && values[k] < -least; ++k) put(found.less, k);
    for (Eigen::Index k = rank; k-- > 0 && values[k] > least;) put(found.more, k);
    return found;
  }

  static void add_signed(std::vector<CorrectedError>& edges, const Name& name,
                         const Signed& columns) {
    add_common(edges, name, columns.less, true);
    add_common(edges, name, columns.more, false);
  }

  // @return whether fewer columns than `count` suffice
  bool give_by_hubs(std::vector<CorrectedError>& edges, const std::string& name,
                    const Eigen::MatrixXd& P, Eigen::Index count) const {
    const auto hubs = by_hubs(P, rounding(edges), std::min(count, kMostOfHubs));
    if (!hubs) return false;
    for (std::size_t i = 0; i < edges.size(); ++i) {
      edges[i].own = hubs->own.middleRows(6 * static_cast<Eigen::Index>(i), 6);
    }
    add_common(edges, {name, {}}, hubs->F, false);
    return true;
  }

  // All edges get the first source, by which others see that it is the same observation.
  static void add_common(std::vector<CorrectedError>& edges, const Name& name,
                         const Eigen::MatrixXd& all, bool subtracts) {
    for (Eigen::Index first = 0; first < all.cols(); first += kMaxLoadingColumns) {
      const Eigen::Index count = std::min(kMaxLoadingColumns, all.cols() - first);
      std::string source = name.observation;
      if (first > 0) source += "+" + std::to_string(first / kMaxLoadingColumns);
      if (!name.said.empty()) source = merged_source(source, name.said);
      for (std::size_t i = 0; i < edges.size(); ++i) {
        const Loading part = all.block(6 * static_cast<Eigen::Index>(i), first, 6, count);
        if ((first > 0 || !name.said.empty()) && part.isZero(0)) continue;
        edges[i].common_errors.push_back({source, subtracts, part});
      }
    }
  }

  [[nodiscard]] Eigen::MatrixXd dense(const std::vector<CorrectedError>& edges) const {
    Eigen::MatrixXd P = product(columns_, columns_);
    for (Eigen::Index i = 0; i < edges_; ++i) {
      P.block<6, 6>(6 * i, 6 * i) += edges[static_cast<std::size_t>(i)].own;
    }
    return P;
  }

  // The root of the rounding of what was added and subtracted in each row.
  [[nodiscard]] Eigen::VectorXd rounding(const std::vector<CorrectedError>& edges) const {
    Eigen::VectorXd sums = columns_.rowwise().squaredNorm();
    for (Eigen::Index i = 0; i < edges_; ++i) {
      sums.segment<6>(6 * i) += edges[static_cast<std::size_t>(i)].own.diagonal();
    }
    return (kRounding * sums).cwiseSqrt();
  }

  const Eigen::Index edges_;
  Eigen::MatrixXd columns_;
  Eigen::VectorXd signs_;
};

}  // namespace tfdude
