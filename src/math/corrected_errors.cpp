#include "math/corrected_errors.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <Eigen/QR>

#include "math/square_root.hpp"

namespace tfdude {
namespace {

using Matrix = Eigen::MatrixXd;

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

  [[nodiscard]] bool empty() const { return columns_.cols() == 0; }

  // Writes the same sum with the fewest columns, as common errors of one source. Each row is scaled
  // to one before, so that no edge and no unit is judged by another. All edges that share the
  // source are here. Columns beyond the maximum that subtract may therefore be dropped.
  // Those that add go to the own parts: no correlation of n parts exceeds n times their sum.
  void give(std::vector<CorrectedError>& edges, const std::string& name) const {
    const Eigen::VectorXd size = columns_.rowwise().norm();
    const Eigen::VectorXd unit =
        size.unaryExpr([](double one) { return one > 0 ? 1.0 / one : 0.0; });
    const Eigen::HouseholderQR<Matrix> qr(unit.asDiagonal() * columns_);
    const Eigen::Index rank = std::min(columns_.rows(), columns_.cols());
    const Matrix thin = qr.householderQ() * Matrix::Identity(columns_.rows(), rank);
    const Matrix upper = qr.matrixQR().topRows(rank).triangularView<Eigen::Upper>();
    const Eigen::SelfAdjointEigenSolver<Matrix> solver(upper * signs_.asDiagonal() *
                                                       upper.transpose());
    const Eigen::VectorXd& values = solver.eigenvalues();  // ascending
    const Matrix vectors = size.asDiagonal() * thin * solver.eigenvectors();
    const double least = std::numeric_limits<double>::epsilon() * values.cwiseAbs().maxCoeff();
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

// Gives the edges their new loadings of a source. Those of earlier observations are merged into
// `observed`, unless it is null.
void carry(const JointPrior::Source& source, const std::vector<Loading>& loadings,
           SignedColumns* observed, std::vector<CorrectedError>& edges) {
  if (observed != nullptr && is_observed({source.name, source.subtracts, {}})) {
    observed->append(loadings, source.subtracts);
    return;
  }
  for (std::size_t i = 0; i < edges.size(); ++i) {
    if (loadings[i].isZero(0)) continue;
    edges[i].common_errors.push_back({source.name, source.subtracts, loadings[i]});
  }
}

// N Wᵀ, with N = own Hᵀ.
Loading own_seen(const JointPrior& prior, std::size_t i, const Matrix6d& H, const Factor& factor) {
  const Loading on_path = H * prior.own_roots()[i];
  return prior.own_roots()[i] * (factor.whitening() * on_path).transpose();
}

// Correlates an edge with the others of the path by e = c - K y, where c is independent of all and
// y = Σ H e of the others.
// @param H  that of the edge is zero
// @param Y  a root of the covariance of y; W Y with the others' W
void couple(const JointPrior& prior, const std::vector<Matrix6d>& H, const Factor& others,
            std::size_t edge, const Matrix6d& K, const Loading& Y, const Eigen::MatrixXd& WY,
            SignedColumns& observed) {
  std::vector<Loading> less(std::max(prior.edges().size(), edge + 1),
                            Loading::Zero(6, others.root().cols()));
  for (std::size_t i = 0; i < prior.edges().size(); ++i) {
    less[i] = own_seen(prior, i, H[prior.edges()[i]], others);
  }
  std::vector<Loading> more;
  for (const Loading& one : less) more.emplace_back(one * WY);
  more[edge] = -K * Y;
  observed.append(less, true);
  observed.append(more, false);
}

// How many times the variance that the path keeps was in those columns.
double lost(const Factor& kept, const Loading& columns) {
  return (kept.whitening() * columns).squaredNorm();
}

// The edge that makes nearly all of the path's error, if so much of that is taken away that the
// difference would lose its digits, as over a long lever.
std::optional<std::size_t> dominant(const JointPrior& prior, const std::vector<Matrix6d>& H,
                                    const Loading& R, const Factor& S) {
  constexpr double kManyDigits = 1e10;
  constexpr double kNearlyAll = 0.9;
  if (!prior.sources().empty()) return std::nullopt;
  const Loading path = prior.path(H);
  const Factor kept(updated_root(path, path, R, S));
  const double by_all = lost(kept, path);
  if (by_all < kManyDigits) return std::nullopt;
  for (std::size_t i = 0; i < prior.edges().size(); ++i) {
    if (lost(kept, H[prior.edges()[i]] * prior.own_roots()[i]) > kNearlyAll * by_all) return i;
  }
  return std::nullopt;
}

// The others are corrected as by a measurement with the dominant edge's error, and this edge by the
// measurement and them. What the path keeps is then a difference of what the others make of it.
std::vector<CorrectedError> errors_beside(const JointPrior& prior, const LinearPath& linear,
                                          const Loading& R, std::size_t edge,
                                          const std::string& new_source) {
  const Twist rounding = rounding_of_pose(linear.reach);
  const Loading& own = prior.own_roots()[edge];
  const Matrix6d& H = linear.H[prior.edges()[edge]];
  const Loading seen = H * own;
  const Factor S(joined(seen, R), rounding);
  const Matrix6d K = own_seen(prior, edge, H, S) * S.whitening();
  const Loading rest = updated_root(own, seen, R, S);
  std::vector<CorrectedError> corrected;
  for (const Matrix6d& one : prior.own()) corrected.push_back({one, {}});
  corrected[edge].own = rest * rest.transpose();
  auto beside = linear.H;
  beside[prior.edges()[edge]].setZero();
  const Factor others(prior.own_on_path(beside));
  const Loading noise = S.root();
  const Loading Y = updated_root(others.root(), others.root(), noise,
                                 Factor(joined(others.root(), noise), rounding));
  SignedColumns observed(corrected.size());
  couple(prior, beside, others, edge, K, Y, others.whitening() * Y, observed);
  observed.give(corrected, new_source);
  return corrected;
}

}  // namespace

std::vector<CorrectedError> corrected_errors(const JointPrior& prior, const LinearPath& linear,
                                             const Loading& R, const std::string& new_source) {
  const auto& edges = prior.edges();
  const auto& H = linear.H;
  const Twist rounding = rounding_of_pose(linear.reach);
  const Factor S(joined(prior.path(H), R), rounding);
  const auto with_path = prior.with_path(H, S.whitening());
  std::vector<Matrix6d> gains;
  std::vector<CorrectedError> corrected;
  for (std::size_t i = 0; i < edges.size(); ++i) {
    gains.emplace_back(with_path[i] * S.whitening());
    corrected.push_back({prior.own()[i], {}});
  }
  const bool alone = edges.size() == 1;
  if (alone) {
    // Others are correlated with it through common errors only: the rest is its own.
    const Loading& own = prior.own_roots()[0];
    const Loading rest = prior.sources().empty()
                             ? updated_root(own, H[edges[0]] * own, R, S)
                             : joined(own - gains[0] * (H[edges[0]] * own), gains[0] * R);
    corrected[0].own = rest * rest.transpose();
  }
  SignedColumns observed(edges.size());
  for (const JointPrior::Source& source : prior.sources()) {
    const Loading on_path = source.on_path(prior, H);
    std::vector<Loading> loadings = source.loadings;
    for (std::size_t i = 0; i < edges.size(); ++i) loadings[i] -= gains[i] * on_path;
    carry(source, loadings, alone ? nullptr : &observed, corrected);
  }
  if (alone) return corrected;
  if (const auto edge = dominant(prior, H, R, S)) {
    return errors_beside(prior, linear, R, *edge, new_source);
  }
  const Factor S_0(joined(prior.own_on_path(H), R), rounding);
  std::vector<Loading> less;
  std::vector<Loading> more;
  for (std::size_t i = 0; i < edges.size(); ++i) {
    less.push_back(own_seen(prior, i, H[edges[i]], S_0));
    more.emplace_back(gains[i] * S_0.root() - less.back());
  }
  observed.append(less, true);
  if (!prior.sources().empty()) observed.append(more, false);
  observed.give(corrected, new_source);
  return corrected;
}

std::vector<CorrectedError> determined_errors(const JointPrior& prior, std::size_t u,
                                              const LinearPath& linear, const Loading& R,
                                              const std::string& new_source) {
  const Matrix6d G = linear.H[u].inverse();
  std::vector<CorrectedError> determined;
  for (const Matrix6d& own : prior.own()) determined.push_back({own, {}});
  const Loading noise = G * R;
  determined.push_back({noise * noise.transpose(), {}});
  SignedColumns observed(determined.size());
  for (const JointPrior::Source& source : prior.sources()) {
    std::vector<Loading> loadings = source.loadings;
    loadings.emplace_back(-G * source.on_path(prior, linear.H));
    carry(source, loadings, &observed, determined);
  }
  const Factor whole(prior.own_on_path(linear.H));
  if (whole.rank() > 0) {
    couple(prior, linear.H, whole, determined.size() - 1, G, whole.root(),
           Matrix::Identity(whole.rank(), whole.rank()), observed);
  }
  if (!observed.empty()) observed.give(determined, new_source);
  return determined;
}

}  // namespace tfdude
