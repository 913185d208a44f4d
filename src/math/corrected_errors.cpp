#include "math/corrected_errors.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Eigenvalues>
#include <Eigen/QR>

#include "math/semidefinite.hpp"
#include "math/symmetric_eigen.hpp"

namespace tfdude {
namespace {

using Matrix = Eigen::MatrixXd;

// The fraction of the largest eigenvalue that may be rounding.
constexpr double kRounding = 1e-14;

// L with L Lᵀ = A⁺.
Matrix6d inverse_root(const Matrix6d& semidefinite) {
  const SymmetricEigen eigen = symmetric_eigen(pseudo_inverse(semidefinite));
  return eigen.vectors * eigen.values.cwiseMax(0.0).cwiseSqrt().asDiagonal();
}

// Columns over all edges, six rows each, which are added to the joint covariance or subtracted from
// it.
class SignedColumns {
 public:
  explicit SignedColumns(std::size_t edges) : columns_(6 * static_cast<Eigen::Index>(edges), 0) {}

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

  // Writes the same sum with the fewest columns, as common errors of one source. All edges that
  // share the source are here. Columns beyond the maximum that subtract may therefore be dropped.
  // Those that add go to the own parts: no correlation of n parts exceeds n times their sum.
  void give(std::vector<CorrectedError>& edges, const std::string& name) const {
    const Eigen::HouseholderQR<Matrix> qr(columns_);
    const Eigen::Index rank = std::min(columns_.rows(), columns_.cols());
    const Matrix thin = qr.householderQ() * Matrix::Identity(columns_.rows(), rank);
    const Matrix upper = qr.matrixQR().topRows(rank).triangularView<Eigen::Upper>();
    const Eigen::SelfAdjointEigenSolver<Matrix> solver(upper * signs_.asDiagonal() *
                                                       upper.transpose());
    const Eigen::VectorXd& values = solver.eigenvalues();  // ascending
    const Matrix vectors = thin * solver.eigenvectors();
    const double least = kRounding * values.cwiseAbs().maxCoeff();
    Matrix less(columns_.rows(), 0);
    Matrix more(columns_.rows(), 0);
    const auto put = [&](Matrix& to, Eigen::Index k) {
      to.conservativeResize(Eigen::NoChange, to.cols() + 1);
      to.rightCols(1) = vectors.col(k) * std::sqrt(std::abs(values[k]));
    };
    for (Eigen::Index k = 0; k < rank && values[k] < -least && less.cols() < kMaxLoadingColumns;
         ++k) {
      put(less, k);
    }
    for (Eigen::Index k = rank; k-- > 0 && values[k] > least;) {
      if (more.cols() < kMaxLoadingColumns) {
        put(more, k);
        continue;
      }
      for (std::size_t i = 0; i < edges.size(); ++i) {
        const Twist part = vectors.col(k).segment<6>(6 * static_cast<Eigen::Index>(i));
        edges[i].own += static_cast<double>(edges.size()) * values[k] * part * part.transpose();
      }
    }
    add_common(edges, name, less, true);
    add_common(edges, name, more, false);
  }

 private:
  static void add_common(std::vector<CorrectedError>& edges, const std::string& name,
                         const Matrix& all, bool subtracts) {
    if (all.cols() == 0) return;
    for (std::size_t i = 0; i < edges.size(); ++i) {
      const Loading part = all.middleRows(6 * static_cast<Eigen::Index>(i), 6);
      edges[i].common_errors.push_back({name, subtracts, part});
    }
  }

  Matrix columns_;
  Eigen::VectorXd signs_;
};

}  // namespace

std::vector<CorrectedError> corrected_errors(const JointPrior& prior,
                                             const std::vector<Matrix6d>& H, const Matrix6d& R,
                                             const std::string& new_source) {
  const auto& edges = prior.edges();
  const Moments m = prior.moments(H);
  const Matrix6d inverse = pseudo_inverse(m.of_path + R);
  Matrix6d S_0 = R;
  std::vector<Matrix6d> gains;
  std::vector<CorrectedError> corrected;
  for (std::size_t i = 0; i < edges.size(); ++i) {
    S_0 += H[edges[i]] * prior.own()[i] * H[edges[i]].transpose();
    gains.push_back(m.with_edge[i] * inverse);
    corrected.push_back({prior.own()[i], {}});
  }
  const bool alone = edges.size() == 1;
  if (alone) {
    // Others are correlated with it through common errors only: the rest is its own.
    const Matrix6d rest = Matrix6d::Identity() - gains[0] * H[edges[0]];
    corrected[0].own =
        rest * prior.own()[0] * rest.transpose() + gains[0] * R * gains[0].transpose();
  }
  SignedColumns observed(edges.size());
  for (const JointPrior::Source& source : prior.sources()) {
    const Loading on_path = source.on_path(prior, H);
    std::vector<Loading> loadings = source.loadings;
    for (std::size_t i = 0; i < edges.size(); ++i) loadings[i] -= gains[i] * on_path;
    if (!alone && is_observed({source.name, source.subtracts, {}})) {
      observed.append(loadings, source.subtracts);
      continue;
    }
    for (std::size_t i = 0; i < edges.size(); ++i) {
      if (!loadings[i].isZero(0)) {
        corrected[i].common_errors.push_back({source.name, source.subtracts, loadings[i]});
      }
    }
  }
  if (alone) return corrected;
  const Matrix6d root = inverse_root(S_0);
  std::vector<Loading> less;
  std::vector<Loading> more;
  for (std::size_t i = 0; i < edges.size(); ++i) {
    const Matrix6d N = prior.own()[i] * H[edges[i]].transpose();
    less.emplace_back(N * root);
    more.emplace_back((gains[i] * S_0 - N) * root);
  }
  observed.append(less, true);
  if (!prior.sources().empty()) observed.append(more, false);
  observed.give(corrected, new_source);
  return corrected;
}

}  // namespace tfdude
