#include "math/joint_prior.hpp"

#include <algorithm>
#include <cmath>

#include "math/common_errors.hpp"
#include "math/semidefinite.hpp"

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
  for (std::size_t i = 0; i < loadings.size(); ++i) sum += H[prior.edges_[i]] * loadings[i];
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
    own_.push_back(X.own.matrix());
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
  }
}

void JointPrior::take_unknown(std::size_t edge) {
  edges_ = {edge};
  own_ = {all_[edge].X_PC.unknown->matrix()};
  of_unknown_ = true;
}

Matrix6d JointPrior::marginal(std::size_t i) const {
  Matrix6d sum = own_[i];
  for (const Source& source : sources_) {
    sum += source.sign() * source.loadings[i] * source.loadings[i].transpose();
  }
  return sources_.empty() ? sum : nearest_semidefinite(sum);
}

Moments JointPrior::moments(const std::vector<Matrix6d>& H) const {
  Moments m{{}, Matrix6d::Zero()};
  for (std::size_t i = 0; i < edges_.size(); ++i) {
    m.with_edge.push_back(own_[i] * H[edges_[i]].transpose());
  }
  for (const Source& source : sources_) {
    const Loading on_path = source.on_path(*this, H);
    for (std::size_t i = 0; i < edges_.size(); ++i) {
      m.with_edge[i] += source.sign() * source.loadings[i] * on_path.transpose();
    }
  }
  for (std::size_t i = 0; i < edges_.size(); ++i) m.of_path += H[edges_[i]] * m.with_edge[i];
  m.of_path = nearest_semidefinite(m.of_path);
  return m;
}

void JointPrior::widen(double by) {
  for (Matrix6d& own : own_) own *= by;
  for (Source& source : sources_) {
    for (Loading& loading : source.loadings) loading *= std::sqrt(by);
  }
}

}  // namespace tfdude
