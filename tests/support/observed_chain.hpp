#pragma once

#include <algorithm>
#include <string>
#include <vector>

#include "tfdude/math/observation.hpp"
#include "tfdude/math/perturbation.hpp"

#include "support/random.hpp"
#include "support/sampling.hpp"

namespace tfdude::testing {

/// A chain of edges with its true values, whose paths are observed. Edge i leads from frame i to
/// its child, frame i + 1. The dense filter is compiled only once, because it takes long.
class ObservedChain {
 public:
  ObservedChain(Random& random, std::size_t edges) {
    for (std::size_t i = 0; i < edges; ++i) {
      const Transform X = random.transform(1.0, 0.003, 0.003);
      edges_.push_back(
          {{X.pose, X.covariance.of_specified(), std::nullopt, {}}, ObservedEdge::Way::kDown});
      cluster_.push_back(i);
      truth_.push_back(X.pose);
    }
  }

  [[nodiscard]] const std::vector<ObservedEdge>& edges() const { return edges_; }

  void set_exact(std::size_t edge) {
    edges_[edge].X_PC.own = {};
    edges_[edge].X_PC.common_errors.clear();
  }

  void add_source(const std::string& name, const std::vector<std::size_t>& edges, Random& random) {
    for (const std::size_t edge : edges) {
      Loading loading =
          Loading::NullaryExpr(6, 3, [&](auto, auto) { return 0.003 * random.normal(); });
      edges_[edge].X_PC.common_errors.push_back({name, false, loading});
    }
    sources_.push_back(name);
  }

  /// Samples the true values from the beliefs. @param lies  the edge whose errors are `by` times as
  /// large
  void make_true(Random& random, std::size_t lies = SIZE_MAX, double by = 1.0) {
    std::vector<Eigen::Vector3d> drawn;
    for (std::size_t k = 0; k < sources_.size(); ++k) {
      const double x = random.normal();
      const double y = random.normal();
      drawn.emplace_back(x, y, random.normal());
    }
    for (std::size_t i = 0; i < edges_.size(); ++i) {
      Twist e = Gaussian(edges_[i].X_PC.own)(random);
      for (const CommonError& common_error : edges_[i].X_PC.common_errors) {
        const auto k =
            std::find(sources_.begin(), sources_.end(), common_error.source) - sources_.begin();
        e += common_error.loading * drawn[static_cast<std::size_t>(k)];
      }
      truth_[i] = edges_[i].X_PC.pose * exp(i == lies ? Twist(by * e) : e);
    }
  }

  /// The edges between two frames, in the order of the path.
  [[nodiscard]] std::vector<ObservedEdge> path(std::size_t from, std::size_t to) const {
    std::vector<ObservedEdge> path(
        edges_.begin() + static_cast<std::ptrdiff_t>(std::min(from, to)),
        edges_.begin() + static_cast<std::ptrdiff_t>(std::max(from, to)));
    if (from > to) {
      std::reverse(path.begin(), path.end());
      for (ObservedEdge& edge : path) edge.way = ObservedEdge::Way::kUp;
    }
    return path;
  }

  [[nodiscard]] Belief believed(std::size_t from, std::size_t to) const {
    Belief X;
    for (const ObservedEdge& edge : path(from, to)) {
      X = compose(X, edge.way == ObservedEdge::Way::kUp ? inverse(edge.X_PC) : edge.X_PC,
                  Order::kSecond);
    }
    return X;
  }

  [[nodiscard]] Pose truth(std::size_t from, std::size_t to) const {
    Pose X;
    for (std::size_t i = std::min(from, to); i < std::max(from, to); ++i) X = X * truth_[i];
    return from > to ? X.inverse() : X;
  }

  /// A measurement with noise of R.
  Observation observe(std::size_t from, std::size_t to, const Covariance& R, Random& random) {
    const Pose Z = truth(from, to) * exp(Gaussian(R)(random)).inverse();
    return take(from, to, {Z, R});
  }

  /// A measurement equal to the belief: it changes no pose.
  void observe_exactly(std::size_t from, std::size_t to, const Covariance& R) {
    take(from, to, {believed(from, to).pose, R});
  }

  /// The covariance if edges were independent.
  void forget_common_errors() {
    for (ObservedEdge& edge : edges_) {
      edge.X_PC.own = collapse(edge.X_PC).covariance.of_specified();
      edge.X_PC.common_errors.clear();
    }
    for (std::size_t i = 0; i < edges_.size(); ++i) cluster_[i] = i;
  }

  /// The joint covariance of all edges, from their beliefs.
  [[nodiscard]] Eigen::MatrixXd dense() const;

  /// The covariance after an observation: a Kalman update whose gain is zero for edges that are not
  /// correlated with it.
  [[nodiscard]] Eigen::MatrixXd dense_update(const Eigen::MatrixXd& P, std::size_t from,
                                             std::size_t to, const Covariance& R) const;

 private:
  // The edges of the path, and those that were observed together with one of them.
  [[nodiscard]] std::vector<std::size_t> concerned(std::size_t from, std::size_t to) const {
    std::vector<std::size_t> all;
    for (std::size_t i = 0; i < edges_.size(); ++i) {
      for (std::size_t k = std::min(from, to); k < std::max(from, to); ++k) {
        if (cluster_[i] != cluster_[k]) continue;
        all.push_back(i);
        break;
      }
    }
    return all;
  }

  Observation take(std::size_t from, std::size_t to, const Transform& Z) {
    std::vector<ObservedEdge> given = path(from, to);
    std::vector<std::size_t> index;
    for (std::size_t k = 0; k < given.size(); ++k)
      index.push_back(from > to ? from - 1 - k : from + k);
    const auto all = concerned(from, to);
    for (const std::size_t i : all) {
      if (i >= std::min(from, to) && i < std::max(from, to)) continue;
      given.push_back({edges_[i].X_PC, ObservedEdge::Way::kBeside});
      index.push_back(i);
    }
    const std::string source = std::string(kObservedPrefix) + std::to_string(++count_);
    auto observed = tfdude::observe(given, Z, source, {1.0, true});
    if (!observed) throw std::runtime_error(observed.error().message);
    for (std::size_t k = 0; k < index.size(); ++k) edges_[index[k]].X_PC = observed->edges[k].X_PC;
    const std::size_t together = cluster_[all.front()];
    for (const std::size_t i : all) cluster_[i] = together;
    return *observed;
  }

  std::vector<ObservedEdge> edges_;
  std::vector<std::size_t> cluster_;  // edges of the same number have been observed together
  std::vector<Pose> truth_;
  std::vector<std::string> sources_;
  int count_ = 0;
};

}  // namespace tfdude::testing
