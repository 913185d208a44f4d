#include "math/corrected_errors.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <utility>

#include "math/decompositions.hpp"
#include "math/instant_sources.hpp"
#include "math/joint_covariance.hpp"
#include "math/joint_update.hpp"
#include "math/left_columns.hpp"
#include "math/semidefinite.hpp"
#include "math/square_root.hpp"

namespace tfdude {
namespace {

using Matrix = Eigen::MatrixXd;

// Whether the errors of an edge and of any other one have more than a tenth in common along their
// axes. Less may count as independent.
bool depends(const JointCovariance& joint, const std::vector<CorrectedError>& edges,
             std::size_t edge) {
  constexpr double kLittle = 6 * 0.1 * 0.1;
  for (std::size_t k = 0; k < edges.size(); ++k) {
    if (k != edge && joint.correlation(edges, edge, k) > kLittle) return true;
  }
  return false;
}

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
  beside.resize(std::min(edges.size() - kMaxObservedTogether, beside.size()));
  for (const auto& [sum, i] : beside) edges[i].depends = depends(joint, edges, i);
  for (const auto& [sum, i] : beside) {
    joint.forget(edges, i);
    edges[i].forgotten = true;
  }
}

// What was forgotten shares nothing.
void clear_forgotten(std::vector<CorrectedError>& edges) {
  for (CorrectedError& edge : edges) {
    if (!edge.forgotten) continue;
    edge.common_errors.erase(
        std::remove_if(edge.common_errors.begin(), edge.common_errors.end(), is_observed),
        edge.common_errors.end());
  }
}

void give(const JointCovariance& joint, std::vector<CorrectedError>& edges,
          const std::string& name) {
  joint.give(edges, name);
  clear_forgotten(edges);
}

// The errors of sources at instants. They stay apart from what observations have found, as it is
// not known how they are correlated with their sources (instant_sources.hpp). None subtracts.
class InstantErrors {
 public:
  void append(const JointPrior::Source& source, const std::vector<Loading>& loadings) {
    if (!instant_in(source.name).empty()) {
      kept_.push_back({source.name, false, loadings});
      return;
    }
    const std::string said(said_source(source.name));
    merged_.try_emplace(said, loadings.size()).first->second.append(loadings, false);
  }

  // After all others, by which an observation is recognised.
  void give(std::vector<CorrectedError>& edges, const std::string& name) const {
    for (const JointPrior::Source& source : kept_) {
      for (std::size_t i = 0; i < edges.size(); ++i) {
        if (source.loadings[i].isZero(0)) continue;
        edges[i].common_errors.push_back({source.name, false, source.loadings[i]});
      }
    }
    for (const auto& [said, joint] : merged_) joint.give_of(edges, name, said);
    for (CorrectedError& edge : edges) {
      if (edge.forgotten) make_own(edge);
    }
  }

 private:
  static void make_own(CorrectedError& edge) {
    auto& errors = edge.common_errors;
    const auto of_instants = std::stable_partition(
        errors.begin(), errors.end(),
        [](const CommonError& one) { return said_source(one.source).empty(); });
    for (auto one = of_instants; one != errors.end(); ++one) {
      edge.own += square_of(one->loading);
    }
    errors.erase(of_instants, errors.end());
  }

  std::vector<JointPrior::Source> kept_;
  std::map<std::string, JointCovariance> merged_;
};

// Where the errors of sources of earlier observations go.
struct Left {
  JointCovariance observed;
  InstantErrors of_instants;
};

// Gives the edges their new loadings of a source. Those of earlier observations are merged into
// `left`, unless it is null.
void carry(const JointPrior::Source& source, const std::vector<Loading>& loadings, Left* left,
           std::vector<CorrectedError>& edges) {
  if (left != nullptr && !said_source(source.name).empty()) {
    left->of_instants.append(source, loadings);
    return;
  }
  if (left != nullptr && is_observed({source.name, source.subtracts, {}})) {
    left->observed.append(loadings, source.subtracts);
    return;
  }
  for (std::size_t i = 0; i < edges.size(); ++i) {
    if (loadings[i].isZero(0)) continue;
    edges[i].common_errors.push_back({source.name, source.subtracts, loadings[i]});
  }
}

// F - K C, the loadings of a source after a measurement.
std::vector<Loading> lessened(const JointPrior::Source& source, const std::vector<Matrix6d>& gains,
                              const JointPrior& prior, const std::vector<Matrix6d>& H) {
  const Loading on_path = source.on_path(prior, H);
  std::vector<Loading> loadings = source.loadings;
  for (std::size_t i = 0; i < loadings.size(); ++i) loadings[i] -= gains[i] * on_path;
  return loadings;
}

void give_many(const JointPrior& prior, JointCovariance& joint, Eigen::Index before,
               const std::string& name, std::vector<CorrectedError>& edges) {
  forget_least(prior, joint, edges);
  joint.give_many(edges, name, before);
  clear_forgotten(edges);
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
  for (const Matrix6d& one : prior.own()) corrected.push_back({one, {}});
  corrected[edge].own = square_of(rest);
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

// The update of many columns, which all add. Sources that are not estimated leave six more.
std::vector<CorrectedError> corrected_many(const JointPrior& prior, const LinearPath& linear,
                                           const Factor& S, const Loading& R, Eigen::Index before,
                                           const std::string& new_source) {
  const std::size_t count = prior.edges().size();
  // In the directions of S only.
  const Matrix6d seen = S.rank() < 6 ? Matrix6d(S.root() * S.whitening()) : Matrix6d::Identity();
  std::vector<Matrix6d> H;
  for (const std::size_t k : prior.edges()) H.emplace_back(seen * linear.H[k]);
  const Twist rounding = rounding_of_pose(linear.reach);
  const Loading noise = compressed(seen * joined(R, Matrix6d(rounding.asDiagonal())));
  MeasuredJoint found = measured_joint(prior.own_roots(), left_columns(prior, before), H, noise);
  std::vector<CorrectedError> corrected;
  for (const Matrix6d& own : found.own) corrected.push_back({own, {}});
  JointCovariance observed(count);
  observed.append(found.F);
  Left left{JointCovariance(count), {}};
  const bool others = !std::all_of(prior.sources().begin(), prior.sources().end(), is_left);
  if (others) {
    const auto with_path = prior.with_path(linear.H, S.whitening());
    const auto root = found.seen.topRows<6>();
    Matrix more(found.F.rows(), root.cols());
    std::vector<Matrix6d> gains;
    for (std::size_t i = 0; i < count; ++i) {
      const auto row = 6 * static_cast<Eigen::Index>(i);
      gains.emplace_back(with_path[i] * S.whitening());
      more.middleRows<6>(row) = gains[i] * root - found.seen.middleRows<6>(6 + row);
    }
    observed.append(more);
    for (const JointPrior::Source& source : prior.sources()) {
      if (!is_left(source))
        carry(source, lessened(source, gains, prior, linear.H), &left, corrected);
    }
  }
  give_many(prior, observed, before, new_source, corrected);
  left.of_instants.give(corrected, new_source);
  return corrected;
}

// The edges and, last, the one that is determined: with the noise of the measurement, and with what
// the sources of the others cause in it.
// @param left  null: as carry()
std::vector<CorrectedError> carried(const JointPrior& prior, const LinearPath& linear,
                                    const Matrix6d& G, const Loading& noise, Left* left) {
  std::vector<CorrectedError> determined;
  for (const Matrix6d& own : prior.own()) determined.push_back({own, {}});
  determined.push_back({square_of(noise), {}});
  for (const JointPrior::Source& source : prior.sources()) {
    std::vector<Loading> loadings = source.loadings;
    loadings.emplace_back(-G * source.on_path(prior, linear.H));
    carry(source, loadings, left, determined);
  }
  return determined;
}

// As determined_errors(), if there are many columns, which all add: those of the edge follow from
// them.
std::vector<CorrectedError> determined_many(const JointPrior& prior, const LinearPath& linear,
                                            const Matrix6d& G, const Loading& noise,
                                            Eigen::Index before, const std::string& new_source) {
  const std::size_t count = prior.edges().size();
  Left left{JointCovariance(count + 1), {}};
  JointCovariance& observed = left.observed;
  std::vector<CorrectedError> determined = carried(prior, linear, G, noise, &left);
  for (std::size_t i = 0; i < count; ++i) {
    const Matrix6d& H = linear.H[prior.edges()[i]];
    const Loading& root = prior.own_roots()[i];
    if (H.isZero(0) || root.cols() == 0) continue;
    std::vector<Loading> loadings(count + 1, Loading::Zero(6, root.cols()));
    loadings[i] = root;
    loadings[count] = -G * H * root;
    observed.append(loadings, false);
    determined[i].own.setZero();
  }
  give_many(prior, observed, before, new_source, determined);
  left.of_instants.give(determined, new_source);
  return determined;
}

}  // namespace

std::vector<CorrectedError> corrected_errors(const JointPrior& prior, const PathMinimum& found,
                                             const Loading& R, const std::string& new_source,
                                             bool merge) {
  const auto& edges = prior.edges();
  const LinearPath& linear = found.linear;
  const Factor& S = found.S;
  const auto& H = linear.H;
  const bool alone = edges.size() == 1;
  const Eigen::Index many = merge && !alone ? many_left_columns(prior) : 0;
  if (many > 0) return corrected_many(prior, linear, S, R, many, new_source);
  const Twist rounding = rounding_of_pose(linear.reach);
  const auto with_path = prior.with_path(H, S.whitening());
  std::vector<Matrix6d> gains;
  std::vector<CorrectedError> corrected;
  for (std::size_t i = 0; i < edges.size(); ++i) {
    gains.emplace_back(with_path[i] * S.whitening());
    corrected.push_back({prior.own()[i], {}});
  }
  if (alone) {
    // Others are correlated with it through common errors only: the rest is its own.
    const Loading& own = prior.own_roots()[0];
    const Loading rest = prior.sources().empty()
                             ? updated_root(own, H[edges[0]] * own, R, S)
                             : joined(own - gains[0] * (H[edges[0]] * own), gains[0] * R);
    corrected[0].own = square_of(rest);
  }
  Left left{JointCovariance(edges.size()), {}};
  JointCovariance& observed = left.observed;
  for (const JointPrior::Source& source : prior.sources()) {
    carry(source, lessened(source, gains, prior, H), alone || !merge ? nullptr : &left, corrected);
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
  left.of_instants.give(corrected, new_source);
  return corrected;
}

std::vector<CorrectedError> determined_errors(const JointPrior& prior, std::size_t u,
                                              const LinearPath& linear, const Loading& R,
                                              const std::string& new_source, bool merge) {
  const Matrix6d G = inverse_of(linear.H[u]);
  if (const Eigen::Index many = merge ? many_left_columns(prior) : 0; many > 0) {
    return determined_many(prior, linear, G, G * R, many, new_source);
  }
  Left left{JointCovariance(prior.edges().size() + 1), {}};
  JointCovariance& observed = left.observed;
  auto determined = carried(prior, linear, G, G * R, merge ? &left : nullptr);
  const Factor whole(prior.own_on_path(linear.H));
  if (whole.rank() > 0) {
    couple(prior, linear.H, whole, determined.size() - 1, G, whole.root(),
           Matrix::Identity(whole.rank(), whole.rank()), observed);
  }
  forget_least(prior, observed, determined);
  if (!observed.empty()) give(observed, determined, new_source);
  left.of_instants.give(determined, new_source);
  return determined;
}

}  // namespace tfdude
