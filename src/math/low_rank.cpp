#include "math/low_rank.hpp"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include <Eigen/Cholesky>

#include "math/decompositions.hpp"
#include "math/symmetric_eigen.hpp"

namespace tfdude {
namespace {

using Matrix = Eigen::MatrixXd;
using Block = Eigen::Matrix<double, 6, 6>;
using Vector = Eigen::Matrix<double, 6, 1>;

constexpr Eigen::Index kSize = 6;

// The correlation that counts as none.
constexpr double kNone = 1e-11;

// Eigenvalues of a correlation matrix below this are zero.
constexpr double kSingular = 1e-12;

// Pivots of a correlation matrix below this are rounding.
constexpr double kPivotRounding = 1e-15;

// Coordinates of a block in which its covariance is one, or zero where it is known exactly. Scaled
// to correlations first, as metres and radians differ.
struct White {
  Block to;    // W A Wᵀ = 1
  Block from;  // its pseudo-inverse
};

White white(const Block& A) {
  Vector scale = A.diagonal().cwiseMax(0.0).cwiseSqrt();
  for (double& one : scale) one = one > 0 ? one : 1.0;
  const Vector per = scale.cwiseInverse();
  const SymmetricEigen eigen = symmetric_eigen(per.asDiagonal() * A * per.asDiagonal());
  const Vector roots = eigen.values.cwiseMax(0.0).cwiseSqrt();
  const Vector inverse_roots = eigen.values.unaryExpr(
      [](double value) { return value > kSingular ? 1.0 / std::sqrt(value) : 0.0; });
  return {inverse_roots.asDiagonal() * eigen.vectors.transpose() * per.asDiagonal(),
          scale.asDiagonal() * eigen.vectors * roots.asDiagonal()};
}

class Hubs {
 public:
  Hubs(Matrix P, const Eigen::VectorXd& rounding)
      : P_(std::move(P)), n_(P_.rows() / kSize), least_(n_) {
    for (Eigen::Index i = 0; i < n_; ++i) {
      white_.push_back(white(P_.block<6, 6>(kSize * i, kSize * i)));
      const Block& W = white_.back().to;
      P_.middleRows(kSize * i, kSize) = (W * P_.middleRows(kSize * i, kSize)).eval();
      P_.middleCols(kSize * i, kSize) = (P_.middleCols(kSize * i, kSize) * W.transpose()).eval();
      const Block rounded = W * rounding.segment(kSize * i, kSize).asDiagonal();
      least_[i] = std::max(std::sqrt(kNone), rounded.norm());
    }
  }

  std::optional<BlocksAndColumns> run(Eigen::Index most_columns) {
    Matrix F(P_.rows(), 0);
    while (const auto hub = next()) {
      const SymmetricEigen eigen = symmetric_eigen(P_.block<6, 6>(kSize * *hub, kSize * *hub));
      const Matrix with_others = P_.middleCols(kSize * *hub, kSize);
      for (Eigen::Index k = 0; k < kSize; ++k) {
        const double value = eigen.values[k];
        if (value <= kSingular) continue;
        if (F.cols() == most_columns) return std::nullopt;
        F.conservativeResize(Eigen::NoChange, F.cols() + 1);
        F.rightCols(1) = with_others * eigen.vectors.col(k) / std::sqrt(value);
        P_.noalias() -= F.rightCols(1) * F.rightCols(1).transpose();
      }
      P_.middleRows(kSize * *hub, kSize).setZero();
      P_.middleCols(kSize * *hub, kSize).setZero();
    }
    BlocksAndColumns found{Matrix(P_.rows(), kSize), std::move(F)};
    for (Eigen::Index i = 0; i < n_; ++i) {
      const Block& from = white_[static_cast<std::size_t>(i)].from;
      found.own.middleRows(kSize * i, kSize) =
          from * P_.block<6, 6>(kSize * i, kSize * i) * from.transpose();
      found.F.middleRows(kSize * i, kSize) = (from * found.F.middleRows(kSize * i, kSize)).eval();
    }
    return found;
  }

 private:
  // The block with the most correlation with others; empty if there is none left.
  [[nodiscard]] std::optional<Eigen::Index> next() const {
    std::optional<Eigen::Index> hub;
    double most = 0;
    for (Eigen::Index i = 0; i < n_; ++i) {
      double sum = 0;
      for (Eigen::Index j = 0; j < n_; ++j) {
        if (j == i) continue;
        const auto both = P_.block<6, 6>(kSize * i, kSize * j);
        if (both.cwiseAbs().maxCoeff() > least_[i] * least_[j]) sum += both.squaredNorm();
      }
      if (sum <= most) continue;
      most = sum;
      hub = i;
    }
    return hub;
  }

  Matrix P_;  // in white coordinates
  const Eigen::Index n_;
  std::vector<White> white_;
  Eigen::VectorXd least_;
};

}  // namespace

std::optional<BlocksAndColumns> by_hubs(Matrix P, const Eigen::VectorXd& rounding,
                                        Eigen::Index most_columns) {
  return Hubs(std::move(P), rounding).run(most_columns);
}

Eigen::MatrixXd root_of_joint(const Eigen::MatrixXd& P) {
  const Eigen::VectorXd size = P.diagonal().cwiseMax(0.0).cwiseSqrt();
  const Eigen::VectorXd unit = size.unaryExpr([](double one) { return one > 0 ? 1.0 / one : 0.0; });
  const Eigen::LDLT<Matrix> factor(unit.asDiagonal() * P * unit.asDiagonal());
  const Eigen::VectorXd pivots = factor.vectorD();
  Matrix L = factor.matrixL();
  Eigen::Index rank = 0;
  for (Eigen::Index k = 0; k < pivots.size(); ++k) {
    if (!(pivots[k] > kPivotRounding)) continue;
    L.col(rank) = L.col(k) * std::sqrt(pivots[k]);
    ++rank;
  }
  const Matrix F = factor.transpositionsP().transpose() * L.leftCols(rank);
  return size.asDiagonal() * F;
}

Eigen::MatrixXd triangle_of_columns(const Eigen::MatrixXd& F) {
  if (F.cols() <= F.rows()) return F;
  const auto qr = qr_of(F.transpose());
  const Matrix upper = qr.matrixQR().topRows(F.rows()).triangularView<Eigen::Upper>();
  return upper.transpose();
}

}  // namespace tfdude
