#include "math/corrected_errors.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <Eigen/QR>

#include "math/low_rank.hpp"
#include "math/semidefinite.hpp"
#include "math/square_root.hpp"

namespace tfdude {
namespace {

using Matrix = Eigen::MatrixXd;

// The joint covariance of all edges, six rows each: own parts, and columns that are added to it or
// subtracted from it.
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

  // Makes the errors of an edge independent of all others.
  void forget(std::vector<CorrectedError>& edges, std::size_t edge) {
    auto rows = columns_.middleRows(6 * static_cast<Eigen::Index>(edge), 6);
    edges[edge].own =
        nearest_semidefinite(edges[edge].own + rows * signs_.asDiagonal() * rows.transpose());
    rows.setZero();
  }

  // How much the errors of two edges are correlated: the sum of the squares of the correlations of
  // their elements.
  [[nodiscard]] double correlation(const std::vector<CorrectedError>& edges, std::size_t a,
                                   std::size_t b) const {
    const auto F_a = columns_.middleRows(6 * static_cast<Eigen::Index>(a), 6);
    const auto F_b = columns_.middleRows(6 * static_cast<Eigen::Index>(b), 6);
    const Matrix6d both = F_a * signs_.asDiagonal() * F_b.transpose();
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
  // that share the sources are here. Columns with signs keep the most digits, so they are kept
  // while there are few.
  void give(std::vector<CorrectedError>& edges, const std::string& name) const {
    const Signed own = with_signs();
    const Eigen::Index count = own.less.cols() + own.more.cols();
    if (count <= kMaxLoadingColumns) return give_with_signs(edges, name, own);
    auto hubs = by_hubs(dense(edges), rounding(edges), std::min(count, kMostColumns));
    if (!hubs) return give_with_signs(edges, name, own);
    for (std::size_t i = 0; i < edges.size(); ++i) {
      edges[i].own = hubs->own.middleRows(6 * static_cast<Eigen::Index>(i), 6);
    }
    add_common(edges, name, hubs->F, false);
  }

 private:
  // Of all sources together.
  static constexpr Eigen::Index kMostColumns = 4 * kMaxLoadingColumns;
  // Of the sum of what is subtracted from each other.
  static constexpr double kRounding = 1e-14;

  // The fewest columns with the same sum.
  struct Signed {
    Matrix less;
    Matrix more;
  };

  // Each row is scaled to one before, so that no edge and no unit is judged by another.
  [[nodiscard]] Signed with_signs() const {
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
    Signed found{Matrix(columns_.rows(), 0), Matrix(columns_.rows(), 0)};
    const auto put = [&](Matrix& to, Eigen::Index k) {
      to.conservativeResize(Eigen::NoChange, to.cols() + 1);
      to.rightCols(1) = vectors.col(k) * std::sqrt(std::abs(values[k]));
    };
    for (Eigen::Index k = 0; k < rank && values[k] < -least; ++k) put(found.less, k);
    for (Eigen::Index k = rank; k-- > 0 && values[k] > least;) put(found.more, k);
    return found;
  }

  // Columns beyond the maximum that subtract may be dropped. Those that add go to the own parts: no
  // correlation of n parts exceeds n times their sum.
  static void give_with_signs(std::vector<CorrectedError>& edges, const std::string& name,
                              const Signed& columns) {
    const auto& [less, more] = columns;
    for (Eigen::Index k = kMostColumns; k < more.cols(); ++k) {
      for (std::size_t i = 0; i < edges.size(); ++i) {
        const Twist part = more.col(k).segment<6>(6 * static_cast<Eigen::Index>(i));
        edges[i].own += static_cast<double>(edges.size()) * part * part.transpose();
      }
    }
    add_common(edges, name, less.leftCols(std::min(less.cols(), kMostColumns)), true);
    add_common(edges, name, more.leftCols(std::min(more.cols(), kMostColumns)), false);
  }

  // All edges get the first source, by which others see that it is the same observation.
  static void add_common(std::vector<CorrectedError>& edges, const std::string& name,
                         const Matrix& all, bool subtracts) {
    for (Eigen::Index first = 0; first < all.cols(); first += kMaxLoadingColumns) {
      const Eigen::Index count = std::min(kMaxLoadingColumns, all.cols() - first);
      const std::string source =
          first == 0 ? name : name + "+" + std::to_string(first / kMaxLoadingColumns);
      for (std::size_t i = 0; i < edges.size(); ++i) {
        const Loading part = all.block(6 * static_cast<Eigen::Index>(i), first, 6, count);
        if (first > 0 && part.isZero(0)) continue;
        edges[i].common_errors.push_back({source, subtracts, part});
      }
    }
  }

  [[nodiscard]] Matrix dense(const std::vector<CorrectedError>& edges) const {
    Matrix P = columns_ * signs_.asDiagonal() * columns_.transpose();
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
  Matrix columns_;
  Eigen::VectorXd signs_;
};

// If more edges are correlated than may be, forgets that of those beside the path which are the
// least correlated with it.
void forget_least(const JointPrior& prior, JointCovariance& joint,
                  std::vector<CorrectedError>& edges) {
  if (edges.size() <= kMaxObservedTogether) return;
  std::vector<std::pair<double, std::size_t>> beside;
  // An edge of which nothing was known is the last one, and on the path.
  const auto is_beside = [&](std::size_t i) {
    return i < prior.edges().size() && prior.is_beside(i);
  };
  for (std::size_t i = 0; i < edges.size(); ++i) {
    if (!is_beside(i)) continue;
    double sum = 0;
    for (std::size_t k = 0; k < edges.size(); ++k) {
      if (!is_beside(k)) sum += joint.correlation(edges, i, k);
    }
    beside.emplace_back(sum, i);
  }
  std::sort(beside.begin(), beside.end());
  const std::size_t count = std::min(edges.size() - kMaxObservedTogether, beside.size());
  for (std::size_t k = 0; k < count; ++k) {
    joint.forget(edges, beside[k].second);
    edges[beside[k].second].forgotten = true;
  }
}

void give(const JointCovariance& joint, std::vector<CorrectedError>& edges,
          const std::string& name) {
  joint.give(edges, name);
  for (CorrectedError& edge : edges) {
    if (!edge.forgotten) continue;
    edge.common_errors.erase(
        std::remove_if(edge.common_errors.begin(), edge.common_errors.end(), is_observed),
        edge.common_errors.end());
  }
}

// Gives the edges their new loadings of a source. Those of earlier observations are merged into
// `observed`, unless it is null.
void carry(const JointPrior::Source& source, const std::vector<Loading>& loadings,
           JointCovariance* observed, std::vector<CorrectedError>& edges) {
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
            JointCovariance& observed) {
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
  for (const Matrix6d& one : prior.own()) corrected.push_back({one, {}, false});
  corrected[edge].own = rest * rest.transpose();
  auto beside = linear.H;
  beside[prior.edges()[edge]].setZero();
  const Factor others(prior.own_on_path(beside));
  const Loading noise = S.root();
  const Loading Y = updated_root(others.root(), others.root(), noise,
                                 Factor(joined(others.root(), noise), rounding));
  JointCovariance observed(corrected.size());
  couple(prior, beside, others, edge, K, Y, others.whitening() * Y, observed);
  give(observed, corrected, new_source);
  return corrected;
}

}  // namespace

std::vector<CorrectedError> corrected_errors(const JointPrior& prior, const LinearPath& linear,
                                             const Loading& R, const std::string& new_source,
                                             bool merge) {
  const auto& edges = prior.edges();
  const auto& H = linear.H;
  const Twist rounding = rounding_of_pose(linear.reach);
  const Factor S(joined(prior.path(H), R), rounding);
  const auto with_path = prior.with_path(H, S.whitening());
  std::vector<Matrix6d> gains;
  std::vector<CorrectedError> corrected;
  for (std::size_t i = 0; i < edges.size(); ++i) {
    gains.emplace_back(with_path[i] * S.whitening());
    corrected.push_back({prior.own()[i], {}, false});
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
  JointCovariance observed(edges.size());
  for (const JointPrior::Source& source : prior.sources()) {
    const Loading on_path = source.on_path(prior, H);
    std::vector<Loading> loadings = source.loadings;
    for (std::size_t i = 0; i < edges.size(); ++i) loadings[i] -= gains[i] * on_path;
    carry(source, loadings, alone || !merge ? nullptr : &observed, corrected);
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
  forget_least(prior, observed, corrected);
  give(observed, corrected, new_source);
  return corrected;
}

std::vector<CorrectedError> determined_errors(const JointPrior& prior, std::size_t u,
                                              const LinearPath& linear, const Loading& R,
                                              const std::string& new_source, bool merge) {
  const Matrix6d G = linear.H[u].inverse();
  std::vector<CorrectedError> determined;
  for (const Matrix6d& own : prior.own()) determined.push_back({own, {}, false});
  const Loading noise = G * R;
  determined.push_back({noise * noise.transpose(), {}, false});
  JointCovariance observed(determined.size());
  for (const JointPrior::Source& source : prior.sources()) {
    std::vector<Loading> loadings = source.loadings;
    loadings.emplace_back(-G * source.on_path(prior, linear.H));
    carry(source, loadings, merge ? &observed : nullptr, determined);
  }
  const Factor whole(prior.own_on_path(linear.H));
  if (whole.rank() > 0) {
    couple(prior, linear.H, whole, determined.size() - 1, G, whole.root(),
           Matrix::Identity(whole.rank(), whole.rank()), observed);
  }
  forget_least(prior, observed, determined);
  if (!observed.empty()) give(observed, determined, new_source);
  return determined;
}

}  // namespace tfdude
