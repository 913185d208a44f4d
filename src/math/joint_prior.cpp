#include "math/joint_prior.hpp"

#include <algorithm>
#include <cmath>

#include "math/semidefinite.hpp"
#include "math/shares.hpp"

namespace tfdude {
namespace {

JointPrior::Source& source_of(std::vector<JointPrior::Source>& sources, const Share& share) {
  for (JointPrior::Source& source : sources) {
    if (source.name == share.source && source.subtracts == share.subtracts) return source;
  }
  return sources.emplace_back(JointPrior::Source{share.source, share.subtracts, {}});
}

}  // namespace

Factor JointPrior::Source::on_path(const JointPrior& prior, const std::vector<Matrix6d>& H) const {
  Factor sum = Factor::Zero(6, factors.front().cols());
  for (std::size_t i = 0; i < factors.size(); ++i) sum += H[prior.edges_[i]] * factors[i];
  return sum;
}

JointPrior::JointPrior(const std::vector<ObservedEdge>& all) : all_(all) {
  for (std::size_t k = 0; k < all.size(); ++k) {
    const Belief& X = all[k].X_PC;
    const bool shares = std::any_of(X.shares.begin(), X.shares.end(),
                                    [](const Share& share) { return !share.factor.isZero(0); });
    if (!shares && X.own.matrix().isZero(0)) continue;
    edges_.push_back(k);
    own_.push_back(X.own.matrix());
  }
  for (std::size_t i = 0; i < edges_.size(); ++i) {
    for (const Share& share : all[edges_[i]].X_PC.shares) {
      Source& source = source_of(sources_, share);
      source.factors.resize(edges_.size(), Factor(6, 0));
      source.factors[i] = share.factor;
    }
  }
  for (Source& source : sources_) {
    Eigen::Index columns = 0;
    for (const Factor& factor : source.factors) columns = std::max(columns, factor.cols());
    for (Factor& factor : source.factors) tfdude::widen(factor, columns);
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
    sum += source.sign() * source.factors[i] * source.factors[i].transpose();
  }
  return sources_.empty() ? sum : nearest_semidefinite(sum);
}

Moments JointPrior::moments(const std::vector<Matrix6d>& H) const {
  Moments m{{}, Matrix6d::Zero()};
  for (std::size_t i = 0; i < edges_.size(); ++i) {
    m.with_edge.push_back(own_[i] * H[edges_[i]].transpose());
  }
  for (const Source& source : sources_) {
    const Factor on_path = source.on_path(*this, H);
    for (std::size_t i = 0; i < edges_.size(); ++i) {
      m.with_edge[i] += source.sign() * source.factors[i] * on_path.transpose();
    }
  }
  for (std::size_t i = 0; i < edges_.size(); ++i) m.of_path += H[edges_[i]] * m.with_edge[i];
  m.of_path = nearest_semidefinite(m.of_path);
  return m;
}

void JointPrior::widen(double by) {
  for (Matrix6d& own : own_) own *= by;
  for (Source& source : sources_) {
    for (Factor& factor : source.factors) factor *= std::sqrt(by);
  }
}

}  // namespace tfdude
