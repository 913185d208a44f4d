#include "tree/over_fixed.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "tfdude/math/perturbation.hpp"

#include "math/bound_weights.hpp"
#include "math/common_errors.hpp"
#include "math/drift.hpp"
#include "math/instant_sources.hpp"
#include "math/symmetric_eigen.hpp"

namespace tfdude {
namespace {

using Edges = std::vector<EdgeFromFixed>;

Covariance mapped(const Matrix6d& G, const Covariance& sigma) {
  const Matrix6d all = G * sigma.matrix() * G.transpose();
  return Covariance::trusted(Matrix6d(0.5 * (all + all.transpose())));
}

bool is_zero(const Covariance& sigma) { return sigma.upper() == Covariance::Upper{}; }

// Whether it is one value, of one error, but for rounding: both may have come on different ways.
bool is_same(const Belief& a, const Belief& b) {
  const auto near = [](const auto& x, const auto& y) {
    return x.cols() == y.cols() && (x - y).norm() <= 1e-9 * x.norm();
  };
  const auto is_same_error = [&](const CommonError& x, const CommonError& y) {
    return same_source(x, y) && near(x.loading, y.loading);
  };
  const auto unknown = [](const Belief& X) { return X.unknown.value_or(Covariance()).matrix(); };
  const auto& errors = b.common_errors;
  return log(a.pose.inverse() * b.pose).norm() <= 1e-12 * (1 + a.pose.translation().norm()) &&
         a.unspecified == b.unspecified && near(a.own.matrix(), b.own.matrix()) &&
         near(unknown(a), unknown(b)) &&
         std::equal(a.common_errors.begin(), a.common_errors.end(), errors.begin(), errors.end(),
                    is_same_error);
}

void scale(Covariance& sigma, double by) {
  Covariance::Upper upper = sigma.upper();
  for (double& one : upper) one *= by;
  sigma = Covariance::trusted(upper);
}

Belief along(const Edges& edges, Order order) {
  Belief X;
  for (const EdgeFromFixed& edge : edges) {
    X = compose(X, edge.up ? inverse(edge.X_PC) : edge.X_PC, order);
  }
  return X;
}

// Both ways, and the error of X_AB as a sum over their edges.
class TwoWays {
 public:
  TwoWays(Edges to_a, Edges to_b, bool same_instant, bool a_is_later)
      : a_{std::move(to_a), {}},
        b_{std::move(to_b), {}},
        same_instant_(same_instant),
        a_is_later_(a_is_later) {
    leave_out_beginning();
    join_lasting_sources();
    const Pose X_FA = find_gains(a_);
    const Pose X_FB = find_gains(b_);
    const Matrix6d to_b_from_a = -adjoint(X_FB.inverse() * X_FA);
    for (Matrix6d& G : a_.gains) G = (to_b_from_a * G).eval();
  }

  /// Adds what the error consists of, in parts that are independent or of unknown correlation.
  void relate() {
    for (std::size_t i = 0; i < a_.edges.size(); ++i) {
      const std::string& id = a_.edges[i].id;
      const auto same = std::find_if(b_.edges.begin(), b_.edges.end(),
                                     [&](const EdgeFromFixed& other) { return other.id == id; });
      if (same != b_.edges.end()) {
        relate_edge(i, static_cast<std::size_t>(same - b_.edges.begin()));
      }
    }
    for (Way* way : {&a_, &b_}) {
      for (std::size_t i = 0; i < way->edges.size(); ++i) take_unknown(*way, i);
    }
    for (const std::string& source : sources()) relate_source(source);
  }

  [[nodiscard]] Transform X_AB(Order order) {
    Belief whole = compose(inverse(along(a_.edges, order)), along(b_.edges, order), order);
    whole.unknown = unknown_;
    // A source at A and at B is of one kind here: both have been allowed for.
    for (CommonError& one : whole.common_errors) {
      const std::string at_a(kAtA);
      if (one.source.rfind(at_a, 0) == 0) one.source.erase(0, at_a.size());
    }
    std::vector<CommonError> wider = whole.common_errors;
    bound_ = allow_any_relation(wider) || bound_;
    return collapse(whole);
  }
  [[nodiscard]] bool is_bound() const { return bound_ || unknown_; }
  [[nodiscard]] bool has(const std::string& id) const { return a_.has(id) || b_.has(id); }
  /// The names of the sources on either way.
  [[nodiscard]] std::vector<std::string> sources() const {
    std::vector<std::string> names;
    for (const Way* way : {&a_, &b_}) {
      for (const EdgeFromFixed& edge : way->edges) {
        for (const CommonError& one : edge.X_PC.common_errors) {
          if (is_name_only(one)) continue;
          const bool known = std::count(names.begin(), names.end(), one.source) > 0;
          if (!known && one.source.rfind(kOwn, 0) != 0) names.push_back(one.source);
        }
      }
    }
    return names;
  }

 private:
  // Of the own errors of edges. No id has a tab.
  static constexpr const char* kOwn = "\tedge:";
  static constexpr const char* kAtA = "\tat a:";

  struct Way {
    Edges edges;
    std::vector<Matrix6d> gains;  // from the error of X_PC to that of X_AB

    [[nodiscard]] bool has(const std::string& id) const {
      return std::any_of(edges.begin(), edges.end(),
                         [&](const EdgeFromFixed& edge) { return edge.id == id; });
    }
  };

  // Up to the first edge that may have another value, both ways are the same, and so is the error.
  void leave_out_beginning() {
    const auto is_same_edge = [&](const EdgeFromFixed& one, const EdgeFromFixed& other) {
      const bool still = same_instant_ || !(one.moving || other.moving);
      return one.id == other.id && one.up == other.up && still && is_same(one.X_PC, other.X_PC);
    };
    const auto [a, b] = std::mismatch(a_.edges.begin(), a_.edges.end(), b_.edges.begin(),
                                      b_.edges.end(), is_same_edge);
    a_.edges.erase(a_.edges.begin(), a);
    b_.edges.erase(b_.edges.begin(), b);
  }

  void join_lasting_sources() {
    std::vector<ErrorsOfEdge> all;
    for (Way* way : {&a_, &b_}) {
      for (EdgeFromFixed& edge : way->edges) {
        all.push_back({&edge.X_PC.common_errors, !edge.moving || edge.drifts});
      }
    }
    join_lasting(all);
  }

  // Those to the error at the end of the way. Returns the pose there.
  static Pose find_gains(Way& way) {
    Pose beyond;
    for (auto edge = way.edges.rbegin(); edge != way.edges.rend(); ++edge) {
      const Pose& X_PC = edge->X_PC.pose;
      const Matrix6d carry = adjoint(beyond.inverse());
      way.gains.push_back(edge->up ? Matrix6d(-carry * adjoint(X_PC)) : carry);
      beyond = (edge->up ? X_PC.inverse() : X_PC) * beyond;
    }
    std::reverse(way.gains.begin(), way.gains.end());
    return beyond;
  }

  // How the error at the later instant follows from that at the earlier one, if it does.
  [[nodiscard]] std::optional<Drift> drift_of(const EdgeFromFixed& earlier,
                                              const EdgeFromFixed& later) const {
    if (!is_free(earlier) && !is_free(later)) {
      // Of two states, the values may differ.
      return is_same(earlier.X_PC, later.X_PC) ? std::optional(Drift()) : std::nullopt;
    }
    const bool drifts = earlier.drifts && later.drifts && earlier.corrected == later.corrected;
    if (!drifts) return std::nullopt;
    return drift_between(earlier.X_PC, later.X_PC);
  }
  // Whether its error at the other instant may be another one.
  [[nodiscard]] bool is_free(const EdgeFromFixed& edge) const {
    return edge.moving && !same_instant_;
  }

  void relate_edge(std::size_t in_a, std::size_t in_b) {
    EdgeFromFixed& of_a = a_.edges[in_a];
    EdgeFromFixed& of_b = b_.edges[in_b];
    EdgeFromFixed& earlier = a_is_later_ ? of_b : of_a;
    EdgeFromFixed& later = a_is_later_ ? of_a : of_b;
    if (const auto drift = drift_of(earlier, later)) {
      share(earlier, later, *drift);
      lasting_.push_back(of_a.id);
      if (!is_free(of_a) && !is_free(of_b) && of_a.X_PC.unknown) {
        add_unknown(mapped(a_.gains[in_a] + b_.gains[in_b], *of_a.X_PC.unknown));
        of_a.X_PC.unknown.reset();
        of_b.X_PC.unknown.reset();
      }
      return;
    }
    const bool drifts = earlier.drifts && later.drifts;
    if (drifts && are_corrected_together(earlier.X_PC, later.X_PC)) {
      lasting_.push_back(of_a.id);
      return allow_any_own(in_a, in_b);
    }
    allow_any(in_a, in_b);
  }

  // The own error of the earlier value is a part of the later one.
  static void share(EdgeFromFixed& earlier, EdgeFromFixed& later, const Drift& drift) {
    Belief& X = earlier.X_PC;
    later.X_PC.own = drift.added;
    if (is_zero(X.own)) return;
    const SymmetricEigen eigen = symmetric_eigen(X.own.matrix());
    const Loading root = eigen.vectors * eigen.values.cwiseMax(0.0).cwiseSqrt().asDiagonal();
    X.common_errors.push_back({kOwn + earlier.id, false, root});
    later.X_PC.common_errors.push_back({kOwn + earlier.id, false, drift.F * root});
    X.own = {};
  }

  // The own errors at both instants may be correlated in any way. They are independent of all
  // others, unless an observation has tied them.
  void allow_any(std::size_t in_a, std::size_t in_b) {
    const Belief& of_a = a_.edges[in_a].X_PC;
    const Belief& of_b = b_.edges[in_b].X_PC;
    if (!is_tied(of_a) && !is_tied(of_b)) return allow_any_own(in_a, in_b);
    bound_ = true;
    // What the observation subtracts is of the own part, so one of both values stays whole.
    const bool keeps_a = is_tied(of_a);
    Way& other = keeps_a ? b_ : a_;
    const std::size_t i = keeps_a ? in_b : in_a;
    add_unknown(mapped(other.gains[i], take_whole(other.edges[i].X_PC)));
  }
  void allow_any_own(std::size_t in_a, std::size_t in_b) {
    Belief& of_a = a_.edges[in_a].X_PC;
    Belief& of_b = b_.edges[in_b].X_PC;
    if (is_zero(of_a.own) && is_zero(of_b.own)) return;
    bound_ = true;
    const Covariance A = mapped(a_.gains[in_a], of_a.own);
    const Covariance B = mapped(b_.gains[in_b], of_b.own);
    const BoundWeights weights = bound_weights(A, B);
    scale(of_a.own, weights.of_A);
    scale(of_b.own, weights.of_B);
  }
  // Beyond some columns, all of what observations have left adds, and no own part remains.
  static bool is_tied(const Belief& X) {
    return std::any_of(X.common_errors.begin(), X.common_errors.end(), ties);
  }

  void take_unknown(Way& way, std::size_t i) {
    std::optional<Covariance>& unknown = way.edges[i].X_PC.unknown;
    if (unknown) add_unknown(mapped(way.gains[i], *unknown));
    unknown.reset();
  }
  void add_unknown(const Covariance& more) { unknown_ = unknown_ ? bound(*unknown_, more) : more; }

  // A source of an edge that may have another error at the other instant may have one, too.
  void relate_source(const std::string& source) {
    const auto is_it = [&](const CommonError& one) {
      return one.source == source && !one.subtracts;
    };
    bool may_differ = false;
    const auto sum_of = [&](const Way& way) {
      Loading sum(6, 0);
      for (std::size_t i = 0; i < way.edges.size(); ++i) {
        const EdgeFromFixed& edge = way.edges[i];
        const bool lasts =
            !is_free(edge) || std::count(lasting_.begin(), lasting_.end(), edge.id) > 0;
        for (const CommonError& one : edge.X_PC.common_errors) {
          if (!is_it(one)) continue;
          may_differ = may_differ || !lasts;
          widen(sum, one.loading.cols());
          sum.leftCols(one.loading.cols()) += way.gains[i] * one.loading;
        }
      }
      return Covariance::trusted(Matrix6d(sum * sum.transpose()));
    };
    const Covariance A = sum_of(a_);
    const Covariance B = sum_of(b_);
    if (!may_differ || is_zero(A) || is_zero(B)) return;
    bound_ = true;
    const BoundWeights weights = bound_weights(A, B);
    for (Way* way : {&a_, &b_}) {
      const double by = std::sqrt(way == &a_ ? weights.of_A : weights.of_B);
      for (EdgeFromFixed& edge : way->edges) {
        for (CommonError& one : edge.X_PC.common_errors) {
          if (!is_it(one)) continue;
          one.loading *= by;
          if (way == &a_) one.source.insert(0, kAtA);
        }
      }
    }
  }

  Way a_;
  Way b_;
  const bool same_instant_;
  const bool a_is_later_;
  std::vector<std::string> lasting_;
  std::optional<Covariance> unknown_;
  bool bound_ = false;
};

void add_once(const std::vector<std::string>& more, std::vector<std::string>& names) {
  for (const std::string& one : more) {
    if (std::count(names.begin(), names.end(), one) == 0) names.push_back(one);
  }
}

std::vector<std::string> unspecified_of(const std::vector<EdgeFromFixed>& way) {
  std::vector<std::string> ids;
  for (const EdgeFromFixed& edge : way) {
    if (edge.X_PC.unspecified) ids.push_back(edge.id);
  }
  return ids;
}

}  // namespace

Result<std::vector<EdgeFromFixed>> edges_from_fixed(const Forest& forest, std::string_view fixed,
                                                    std::string_view frame, const Query& query) {
  const auto path = forest.edges(fixed, frame);
  if (!path) return tl::unexpected(path.error());
  if (path->empty()) return std::vector<EdgeFromFixed>();
  std::vector<PathEnds> segments;
  for (const FrameInfo& edge : *path) segments.push_back({edge.parent, edge.id});
  const auto found = forest.lookup_segments(segments, query, {}, true);
  if (!found) return tl::unexpected(found.error());
  std::vector<EdgeFromFixed> edges;
  std::string here(fixed);
  for (std::size_t i = 0; i < path->size(); ++i) {
    const FrameInfo& edge = (*path)[i];
    const bool up = edge.parent != here;
    here = up ? edge.parent : edge.id;
    const PathCorrelation& correlation = found->correlations[i];
    edges.push_back({edge.id, belief_of(found->values[i], correlation), up,
                     is_moving(edge.id, correlation), is_drifting(edge.id, correlation),
                     is_corrected(edge.id, correlation)});
  }
  return edges;
}

StampedTransform over_fixed(const StampedTransform& X_FA, const StampedTransform& X_FB,
                            std::vector<EdgeFromFixed> to_a, std::vector<EdgeFromFixed> to_b,
                            Order order) {
  StampedTransform X_AB{between(X_FA, X_FB), X_FB.stamp};
  Basis& basis = X_AB.basis;
  basis.order = order;
  if (to_a.empty() || to_b.empty()) {
    basis.unspecified.assign(X_FA.basis.unspecified.rbegin(), X_FA.basis.unspecified.rend());
    add_once(X_FB.basis.unspecified, basis.unspecified);
    basis.sources = X_FA.basis.sources;
    add_once(X_FB.basis.sources, basis.sources);
    basis.bound = X_FA.basis.bound || X_FB.basis.bound;
    basis.lost = X_FA.basis.lost;
    for (const LostOwner& one : X_FB.basis.lost) {
      const bool known = std::any_of(basis.lost.begin(), basis.lost.end(), [&](const auto& other) {
        return other.partition == one.partition;
      });
      if (!known) basis.lost.push_back(one);
    }
    return X_AB;
  }
  std::vector<std::string> unspecified = unspecified_of(to_a);
  std::reverse(unspecified.begin(), unspecified.end());
  add_once(unspecified_of(to_b), unspecified);
  const bool same_instant = X_FA.stamp && X_FA.stamp == X_FB.stamp;
  const bool a_is_later = X_FA.stamp && X_FB.stamp && *X_FA.stamp > *X_FB.stamp;
  TwoWays ways(std::move(to_a), std::move(to_b), same_instant, a_is_later);
  for (std::string& id : unspecified) {
    if (ways.has(id)) basis.unspecified.push_back(std::move(id));
  }
  for (const std::string& source : ways.sources()) {
    add_once({std::string(shown_source(source))}, basis.sources);
  }
  ways.relate();
  static_cast<Transform&>(X_AB) = ways.X_AB(order);
  if (!basis.unspecified.empty()) X_AB.covariance.set_complete(false);
  basis.bound = ways.is_bound();
  return X_AB;
}

}  // namespace tfdude
