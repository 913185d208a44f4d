#include "math/joint_prior.hpp"

#include <algorithm>
#include <cmath>

#include "math/common_errors.hpp"
#include "math/square_root.hpp"
#include "math/unknown_rotation.hpp"

namespace tfdude {
namespace {

JointPrior::Source& source_of(std::vector<JointPrior::Source>& sources,
                              const CommonError& common_error) {
  for (JointPrior::Source& source : sources) {
    if (source.name == common_error.source && source.subtracts == common_error.subtracts)
      return source;
  }
  return sources.emplace_back(JointPrior::Source{common_error.source, common_error.subtracts, {}});
}

}  // namespace

Loading JointPrior::Source::on_path(const JointPrior& prior, const std::vector<Matrix6d>& H) const {
  Loading sum = Loading::Zero(6, loadings.front().cols());
  for (std::size_t i = 0; i < loadings.size(); ++i) {
    const Matrix6d& H_i = H[prior.edges_[i]];
    if (!H_i.isZero(0)) sum.noalias() += H_i * loadings[i];  // most are beside the path
  }
  return sum;
}

JointPrior::JointPrior(const std::vector<ObservedEdge>& all) : all_(all) {
  for (std::size_t k = 0; k < all.size(); ++k) {
    const Belief& X = all[k].X_PC;
    const bool has_common = std::any_of(
        X.common_errors.begin(), X.common_errors.end(),
        [](const CommonError& common_error) { return !common_error.loading.isZero(0); });
    if (!has_common && X.own.matrix().isZero(0)) continue;
    // An edge beside the path may have got a new value since it was observed with others.
    const bool observed = std::any_of(X.common_errors.begin(), X.common_errors.end(), is_observed);
    if (all[k].way == ObservedEdge::Way::kBeside && !observed) continue;
    edges_.push_back(k);
    own_.push_back(with_bounded_rotations(X.own.matrix()));
    own_roots_.push_back(root_of(own_.back()));
  }
  for (std::size_t i = 0; i < edges_.size(); ++i) {
    for (const CommonError& common_error : all[edges_[i]].X_PC.common_errors) {
      Source& source = source_of(sources_, common_error);
      source.loadings.resize(edges_.size(), Loading(6, 0));
      source.loadings[i] = common_error.loading;
    }
  }
  for (Source& source : sources_) {
    Eigen::Index columns = 0;
    for (const Loading& loading : source.loadings) columns = std::max(columns, loading.cols());
    for (Loading& loading : source.loadings) tfdude::widen(loading, columns);
    // What observations have left is bounded already, and part of a difference.
    if (!is_observed({source.name, source.subtracts, {}})) bound_rotations(source.loadings);
  }
}

void JointPrior::take_unknown(std::size_t edge) {
  edges_ = {edge};
  own_ = {with_bounded_rotations(all_[edge].X_PC.unknown->matrix())};
  own_roots_ = {root_of(own_.front())};
  sources_.clear();
  of_unknown_ = true;
}

bool JointPrior::is_tied() const {
  return std::any_of(sources_.begin(), sources_.end(), [](const Source& source) {
    const auto has = [](const Loading& loading) { return !loading.isZero(0); };
    return std::count_if(source.loadings.begin(), source.loadings.end(), has) > 1;
  });
}

Loading JointPrior::marginal(std::size_t i) const {
  Loading adds = own_roots_[i];
  Loading subtracts(6, 0);
  for (const Source& source : sources_) {
    Loading& sum = source.subtracts ? subtracts : adds;
    sum = joined(sum, source.loadings[i]);
  }
  return root_of_difference(adds, subtracts);
}

Twist JointPrior::deviations(std::size_t i) const {
  const auto subtracts = [](const Source& source) { return source.subtracts; };
  if (std::any_of(sources_.begin(), sources_.end(), subtracts)) {
    return marginal(i).rowwise().norm();
  }
  Twist sum = own_roots_[i].rowwise().squaredNorm();
  for (const Source& source : sources_) sum += source.loadings[i].rowwise().squaredNorm();
  return sum.cwiseSqrt();
}

Loading JointPrior::own_on_path(const std::vector<Matrix6d>& H) const {
  Loading columns(6, 0);
  for (std::size_t i = 0; i < edges_.size(); ++i) {
    if (H[edges_[i]].isZero(0)) continue;  // beside the path
    columns = joined(columns, H[edges_[i]] * own_roots_[i]);
  }
  return columns;
}

Loading JointPrior::path(const std::vector<Matrix6d>& H) const {
  Loading adds = own_on_path(H);
  Loading subtracts(6, 0);
  for (const Source& source : sources_) {
    Loading& sum = source.subtracts ? subtracts : adds;
    sum = joined(sum, source.on_path(*this, H));
  }
  return root_of_difference(adds, subtracts);
}

Twist JointPrior::uncancelled(const std::vector<Matrix6d>& H, std::size_t i) const {
  const Matrix6d& H_i = H[edges_[i]];
  if (H_i.isZero(0)) return Twist::Zero();  // beside the path
  Twist variances = (H_i * own_roots_[i]).rowwise().squaredNorm();
  for (const Source& source : sources_) {
    variances += (H_i * source.loadings[i]).rowwise().squaredNorm();
  }
  return variances;
}

Twist JointPrior::size_on_path(const std::vector<Matrix6d>& H) const {
  Twist sum = Twist::Zero();
  for (std::size_t i = 0; i < edges_.size(); ++i) sum += uncancelled(H, i);
  return sum.cwiseSqrt();
}

Twist JointPrior::least_on_path(const std::vector<Matrix6d>& H, bool of_all) const {
  // Of a deviation. Variances, whose digits are half as many, must tell it from rounding.
  constexpr double kLeast = 3e-8;
  Twist sum = Twist::Zero();
  Twist most = Twist::Zero();
  for (std::size_t i = 0; i < edges_.size(); ++i) {
    const Twist one = uncancelled(H, i);
    sum += one;
    most = most.cwiseMax(one);
  }
  if (!of_all) sum -= most;
  return kLeast * sum.cwiseMax(0.0).cwiseSqrt();
}

std::vector<Loading> JointPrior::with_path(const std::vector<Matrix6d>& H,
                                           const Whitening& W) const {
  std::vector<Loading> with_path;
  for (std::size_t i = 0; i < edges_.size(); ++i) {
    const Loading on_path = H[edges_[i]] * own_roots_[i];
    with_path.emplace_back(own_roots_[i] * (W * on_path).transpose());
  }
  for (const Source& source : sources_) {
    const Eigen::MatrixXd seen = (W * source.on_path(*this, H)).transpose();
    for (std::size_t i = 0; i < edges_.size(); ++i) {
      with_path[i] += source.sign() * source.loadings[i] * seen;
    }
  }
  return with_path;
}

Loading JointPrior::with_path(const std::vector<Matrix6d>& H, const Whitening& W,
                              std::size_t i) const {
  const Loading on_path = H[edges_[i]] * own_roots_[i];
  Loading sum = own_roots_[i] * (W * on_path).transpose();
  for (const Source& source : sources_) {
    sum += source.sign() * source.loadings[i] * (W * source.on_path(*this, H)).transpose();
  }
  return sum;
}

Deviations JointPrior::most_probable(const std::vector<Matrix6d>& H, const Whitening& W,
                                     const Eigen::VectorXd& y) const {
  Deviations found;
  for (std::size_t i = 0; i < edges_.size(); ++i) {
    const Loading on_path = H[edges_[i]] * own_roots_[i];
    found.own.emplace_back((W * on_path).transpose() * y);
  }
  for (const Source& source : sources_) {
    found.of_source.emplace_back((W * source.on_path(*this, H)).transpose() * y);
  }
  return found;
}

std::vector<Twist> JointPrior::errors(const Deviations& deviations) const {
  std::vector<Twist> xi;
  for (std::size_t i = 0; i < edges_.size(); ++i) {
    xi.emplace_back(own_roots_[i] * deviations.own[i]);
    for (std::size_t k = 0; k < sources_.size(); ++k) {
      xi[i] += sources_[k].sign() * sources_[k].loadings[i] * deviations.of_source[k];
    }
  }
  return xi;
}

double JointPrior::cost(const Deviations& deviations) const {
  double sum = 0;
  for (const Eigen::VectorXd& own : deviations.own) sum += own.squaredNorm();
  for (std::size_t k = 0; k < sources_.size(); ++k) {
    sum += sources_[k].sign() * deviations.of_source[k].squaredNorm();
  }
  return sum;
}

void JointPrior::widen(double by) {
  if (by == 1.0) return;
  for (Matrix6d& own : own_) own *= by;
  for (Loading& root : own_roots_) root *= std::sqrt(by);
  for (Source& source : sources_) {
    for (Loading& loading : source.loadings) loading *= std::sqrt(by);
  }
}

}  // namespace tfdude
