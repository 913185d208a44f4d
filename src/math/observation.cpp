#include "tfdude/math/observation.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include "tfdude/base/id.hpp"
#include "tfdude/base/number.hpp"
#include "tfdude/math/fusion.hpp"
#include "tfdude/math/perturbation.hpp"

#include "math/bound_weights.hpp"
#include "math/corrected_errors.hpp"
#include "math/decompositions.hpp"
#include "math/minimum.hpp"
#include "math/not_exact.hpp"
#include "math/observe_beside.hpp"
#include "math/path_minimum.hpp"
#include "math/semidefinite.hpp"
#include "math/square_root.hpp"
#include "math/unknown_rotation.hpp"

namespace tfdude {
namespace {

Covariance seen(const Matrix6d& H, const Matrix6d& sigma) {
  return Covariance::trusted(nearest_semidefinite(H * sigma * H.transpose()));
}

// Of a part of unknown correlation, which counts as measurement error.
Covariance unknown_seen(const Matrix6d& H, const Belief& edge) {
  return seen(H, with_bounded_rotations(edge.unknown->matrix()));
}

void forget(const CorrectedError& error, ObservedResult& result) {
  result.forgotten = error.forgotten;
  if (error.depends) result.X_PC.unknown = std::exchange(result.X_PC.own, {});
}

// An observation in progress.
class Update {
 public:
  Update(const std::vector<ObservedEdge>& edges, const Transform& Z_AB, const std::string& source,
         const ObserveOptions& options, bool merge)
      : all_(edges),
        Z_AB_(Z_AB.pose),
        source_(source),
        options_(options),
        prior_(edges),
        root_(root_of(Z_AB.covariance.of_specified().matrix())),
        unknown_rotations_(tfdude::unknown_rotations(root_)),
        independent_(options.independent),
        merge_(merge) {}

  Result<Observation> run() {
    if (unknown_rotations_ > 0) turn_to(at_start().X_AB);
    if (auto ok = count_unknown(); !ok) return tl::unexpected(std::move(ok.error()));
    root_ = not_exact(root_, prior_, at_start().H, false);
    // Parts that may be correlated are judged by their bound.
    PathMinimum found = first_minimum();
    for (int i = 1; i < kMostTurns && turns(found); ++i) {
      turn_to(found.linear.X_AB);
      found = first_minimum();
    }
    Observation observation;
    judge(found, observation);
    observation.edges.resize(all_.size());
    if (independent_) note_innovation(found, observation);
    if (!observation.accepted) return with_unchanged(std::move(observation));
    BoundWeights weights{1.0, 1.0};
    if (!independent_) {
      const auto omega = weight();
      if (!omega) return with_unchanged(std::move(observation));
      weights = {1.0 / *omega, 1.0 / (1.0 - *omega)};
      found = minimum(weights);
    }
    if (!found.converged) {
      return fail(Errc::kInvalidInput,
                  "the measurement lies too far from where the path is, towards half a turn");
    }
    apply(found, weights, observation);
    return with_unchanged(std::move(observation));
  }

 private:
  // As often as the rotation of the path may be found anew, about axes of which the measurement
  // says nothing.
  static constexpr int kMostTurns = 5;

  // Edges that are not corrected stay as they are.
  [[nodiscard]] Observation with_unchanged(Observation observation) const {
    for (std::size_t k = 0; k < all_.size(); ++k) {
      if (!observation.edges[k].corrected) observation.edges[k].X_PC = all_[k].X_PC;
    }
    return observation;
  }

  [[nodiscard]] PathMinimum first_minimum() const {
    return independent_ ? minimum({1.0, 1.0}) : minimum(bound_weights(path(), R()));
  }
  void turn_to(const Pose& X_AB) {
    Measured turned = with_unknown_rotation_of(X_AB, {Z_AB_, root_});
    Z_AB_ = turned.X_AB;
    root_ = std::move(turned.root);
  }
  // Whether the path has turned about them since.
  [[nodiscard]] bool turns(const PathMinimum& found) const {
    constexpr double kEnough = 1e-3;  // [rad]
    if (unknown_rotations_ == 0 || !found.converged) return false;
    const Pose turned = with_unknown_rotation_of(found.linear.X_AB, {Z_AB_, root_}).X_AB;
    return turned.rotation().angularDistance(Z_AB_.rotation()) > kEnough;
  }

  // Parts of unknown correlation count as measurement error, unless nothing else can be corrected.
  Result<void> count_unknown() {
    std::vector<std::size_t> unknown;
    for (std::size_t k = 0; k < all_.size(); ++k) {
      if (all_[k].way == ObservedEdge::Way::kBeside) continue;
      if (all_[k].X_PC.unknown && !all_[k].X_PC.unknown->matrix().isZero(0)) unknown.push_back(k);
    }
    if (unknown.size() == 1 && !prior_.has_path()) {
      prior_.take_unknown(unknown.front());
    } else if (prior_.has_path()) {
      const auto H = at_start().H;
      for (const std::size_t k : unknown) {
        root_ = root_of(bound(R(), unknown_seen(H[k], all_[k].X_PC)).matrix());
      }
    } else if (unknown.empty()) {
      return fail(Errc::kInvalidInput,
                  "all edges of the path are known exactly: none can be corrected");
    } else {
      return fail(Errc::kInvalidInput,
                  "all " + std::to_string(unknown.size()) +
                      " uncertain edges of the path have unknown correlation: it is undetermined "
                      "which of them to correct");
    }
    independent_ = independent_ && unknown.empty();
    return {};
  }

  [[nodiscard]] LinearPath at_start() const {
    return linearize(all_, std::vector<Twist>(all_.size(), Twist::Zero()), Z_AB_);
  }

  // The covariance of the path as the edges have it.
  [[nodiscard]] Covariance path() const {
    const Loading root = prior_.path(at_start().H);
    return Covariance::trusted(square_of(root));
  }

  // The covariance of the measurement.
  [[nodiscard]] Covariance R() const { return Covariance::trusted(square_of(root_)); }

  // With P and R by these factors.
  [[nodiscard]] PathMinimum minimum(const BoundWeights& weights) const {
    if (weights.of_A == 1.0) return minimize(all_, prior_, Z_AB_, noise(weights));
    JointPrior prior = prior_;
    prior.widen(weights.of_A);
    return minimize(all_, prior, Z_AB_, noise(weights));
  }
  [[nodiscard]] Loading noise(const BoundWeights& weights) const {
    return std::sqrt(weights.of_B) * root_;
  }

  // By the cost at the minimum. That at the estimate is larger if the path is curved.
  void judge(const PathMinimum& found, Observation& observation) const {
    const bool impossible = !found.is_possible();
    observation.dimensions = std::max(found.S.rank() - unknown_rotations_, 0);
    observation.distance_squared =
        impossible ? std::numeric_limits<double>::infinity() : found.cost();
    const bool gated = options_.gate < 1 && observation.dimensions > 0;
    observation.limit = gated ? chi_squared_quantile(options_.gate, observation.dimensions)
                              : std::numeric_limits<double>::infinity();
    observation.accepted = !impossible && observation.distance_squared <= observation.limit;
  }

  // Records the corrections that this observation alone would make.
  void note_innovation(const PathMinimum& found, Observation& observation) const {
    const Whitening& W = found.S.whitening();
    const Eigen::VectorXd seen = W * found.seen;
    for (std::size_t i = 0; i < prior_.edges().size(); ++i) {
      if (all_[prior_.edges()[i]].way == ObservedEdge::Way::kBeside) continue;
      // In deviations of the edge, by those of the innovation.
      const Factor edge(prior_.marginal(i));
      const Eigen::MatrixXd gain = edge.whitening() * prior_.with_path(found.linear.H, W, i);
      const Eigen::MatrixXd share = gain.transpose() * gain;
      observation.edges[prior_.edges()[i]].innovation = {(gain * seen).squaredNorm(), share.trace(),
                                                         2.0 * share.squaredNorm()};
    }
  }

  // Covariance intersection: the weight from which the edges gain most. None if they gain nothing.
  [[nodiscard]] std::optional<double> weight() const {
    const LinearPath linear = at_start();
    const Loading path = prior_.path(linear.H);
    const Loading R = noise({1.0, 1.0});
    std::vector<Twist> variances;
    double before = 0;
    for (std::size_t i = 0; i < prior_.edges().size(); ++i) {
      variances.emplace_back(prior_.marginal(i).rowwise().squaredNorm());
      before += units_of(variances[i]).dot(variances[i]);
    }
    const auto size_at = [&](double omega) {
      const Factor S(joined(path / std::sqrt(omega), R / std::sqrt(1.0 - omega)),
                     rounding_of_pose(linear.reach));
      const auto gains = prior_.with_path(linear.H, S.whitening());
      double sum = 0;
      for (std::size_t i = 0; i < variances.size(); ++i) {
        const Twist taken = gains[i].rowwise().squaredNorm() / omega;
        sum += units_of(variances[i]).dot(variances[i] - taken) / omega;
      }
      return sum;
    };
    const double omega = minimum_within_unit(size_at);
    if (size_at(omega) >= before) return std::nullopt;
    return omega;
  }

  void apply(const PathMinimum& found, const BoundWeights& weights, Observation& observation) {
    prior_.widen(weights.of_A);
    auto corrected = corrected_errors(prior_, found, noise(weights), source_, merge_);
    for (std::size_t i = 0; i < prior_.edges().size(); ++i) {
      const std::size_t k = prior_.edges()[i];
      ObservedResult& result = observation.edges[k];
      // The error now refers to another pose.
      const Matrix6d J = right_jacobian(found.xi[k]);
      const Covariance own = seen(J, corrected[i].own);
      const Belief& before = all_[k].X_PC;
      result.X_PC = {
          before.pose * exp(found.xi[k]), before.own, before.unknown, {}, before.unspecified};
      (prior_.is_of_unknown() ? result.X_PC.unknown.emplace() : result.X_PC.own) = own;
      result.X_PC.common_errors = std::move(corrected[i].common_errors);
      for (CommonError& error : result.X_PC.common_errors)
        error.loading = (J * error.loading).eval();
      result.corrected = true;
      forget(corrected[i], result);
    }
  }

  const std::vector<ObservedEdge>& all_;
  Pose Z_AB_;
  const std::string& source_;
  const ObserveOptions& options_;
  JointPrior prior_;
  Loading root_;                 // of the covariance of the measurement
  const int unknown_rotations_;  // axes
  bool independent_;
  const bool merge_;  // the sources of earlier observations
};

// The only unspecified edge of a path. It takes what the measurement says: the pose with which the
// path agrees with it, and an error that follows from those of the measurement and of the other
// edges, whatever its value was before.
class Unspecified {
 public:
  Unspecified(const std::vector<ObservedEdge>& edges, std::size_t index, const Transform& Z_AB,
              const ObserveOptions& options, bool merge)
      : edges_(edges), index_(index), Z_AB_(Z_AB), merge_(merge) {
    Belief& X_PC = edges_[index].X_PC;
    independent_ = options.independent && !X_PC.unknown;
    // What it had in common with others is part of an error that is not known.
    X_PC = {agreeing(), {}, std::nullopt, {}};
  }

  [[nodiscard]] Observation run(const std::string& source) {
    const LinearPath linear =
        linearize(edges_, std::vector<Twist>(edges_.size(), Twist::Zero()), Z_AB_.pose);
    std::vector<std::size_t> unknown;
    for (std::size_t k = 0; k < edges_.size(); ++k) {
      if (edges_[k].way == ObservedEdge::Way::kBeside || !edges_[k].X_PC.unknown) continue;
      unknown.push_back(k);
    }
    independent_ = independent_ && unknown.empty();
    Observation found = compared_with_nothing();
    for (const ObservedEdge& edge : edges_) found.edges.push_back({edge.X_PC, false, false, {}});
    const JointPrior others(edges_);
    if (independent_) {
      correlate(others, linear, source, found);
      return found;
    }
    Covariance S = Z_AB_.covariance.of_specified();
    for (const std::size_t k : unknown) {
      S = bound(S, unknown_seen(linear.H[k], edges_[k].X_PC));
    }
    const Loading path = others.path(linear.H);
    S = bound(S, Covariance::trusted(square_of(path)));
    Belief& X_PC = found.edges[index_].X_PC;
    X_PC.unknown = seen(inverse_of(linear.H[index_]), S.matrix());
    X_PC.common_errors.clear();
    found.edges[index_].corrected = true;
    return found;
  }

 private:
  void correlate(const JointPrior& others, const LinearPath& linear, const std::string& source,
                 Observation& found) const {
    const Loading root =
        not_exact(root_of(Z_AB_.covariance.of_specified().matrix()), others, linear.H, true);
    const auto determined = determined_errors(others, index_, linear, root, source, merge_);
    const auto put = [&](std::size_t k, const CorrectedError& error) {
      found.edges[k].X_PC.own = Covariance::trusted(nearest_semidefinite(error.own));
      found.edges[k].X_PC.common_errors = error.common_errors;
      found.edges[k].corrected = true;
      forget(error, found.edges[k]);
    };
    put(index_, determined.back());
    for (std::size_t i = 0; i < others.edges().size(); ++i) {
      const std::size_t k = others.edges()[i];
      if (!(determined[i].common_errors == edges_[k].X_PC.common_errors)) put(k, determined[i]);
    }
  }

  // The edge's pose with which the path is Z_AB.
  [[nodiscard]] Pose agreeing() const {
    Pose before;
    Pose after;
    for (std::size_t k = 0; k < edges_.size(); ++k) {
      if (k == index_ || edges_[k].way == ObservedEdge::Way::kBeside) continue;
      const Pose& X_PC = edges_[k].X_PC.pose;
      Pose& side = k < index_ ? before : after;
      side = side * (edges_[k].way == ObservedEdge::Way::kUp ? X_PC.inverse() : X_PC);
    }
    const Pose along = before.inverse() * Z_AB_.pose * after.inverse();
    return edges_[index_].way == ObservedEdge::Way::kUp ? along.inverse() : along;
  }

  [[nodiscard]] static Observation compared_with_nothing() {
    Observation found;
    found.limit = std::numeric_limits<double>::infinity();
    found.accepted = true;
    return found;
  }

  std::vector<ObservedEdge> edges_;
  std::size_t index_;
  const Transform& Z_AB_;
  const bool merge_;
  bool independent_ = true;
};

Result<Observation> observed(const std::vector<ObservedEdge>& edges, const Transform& Z_AB,
                             const std::string& source, const ObserveOptions& options, bool merge) {
  if (!(options.gate > 0 && options.gate <= 1)) {
    return fail(Errc::kInvalidInput,
                "gate must be above 0 and no more than 1, not " + number_text(options.gate));
  }
  if (!Z_AB.covariance.complete()) {
    return fail(Errc::kInvalidInput,
                "the covariance of the measurement is unspecified: it cannot be weighed");
  }
  std::vector<std::size_t> unspecified;
  for (std::size_t k = 0; k < edges.size(); ++k) {
    const bool on_path = edges[k].way != ObservedEdge::Way::kBeside;
    if (on_path && edges[k].X_PC.unspecified) unspecified.push_back(k);
  }
  if (unspecified.empty()) return Update(edges, Z_AB, source, options, merge).run();
  if (unspecified.size() == 1) {
    return Unspecified(edges, unspecified.front(), Z_AB, options, merge).run(source);
  }
  return fail(Errc::kInvalidInput, "the covariance of " + std::to_string(unspecified.size()) +
                                       " edges of the path is unspecified: it is undetermined "
                                       "which of them to correct");
}

}  // namespace

Result<Observation> observe(const std::vector<ObservedEdge>& edges, const Transform& Z_AB,
                            const std::string& source, const ObserveOptions& options) {
  return observed(edges, Z_AB, source, options, true);
}

bool is_better_anew(const std::vector<ObservedEdge>& edges, std::size_t index,
                    const Transform& Z_AB) {
  // How many times its variance it may have then, as it is tied to the rest of the path again.
  constexpr double kMost = 4.0;
  std::vector<ObservedEdge> others = edges;
  others[index].X_PC = {edges[index].X_PC.pose, {}, std::nullopt, {}};
  const LinearPath linear =
      linearize(others, std::vector<Twist>(others.size(), Twist::Zero()), Z_AB.pose);
  const Loading seen =
      joined(JointPrior(others).path(linear.H), root_of(Z_AB.covariance.of_specified().matrix()));
  const Twist anew = (inverse_of(linear.H[index]) * seen).rowwise().squaredNorm();
  const Twist before = edges[index].X_PC.unknown.value_or(Covariance()).matrix().diagonal();
  return units_of(before).dot(anew) <= kMost * units_of(before).dot(before);
}

Result<Observation> observe_beside_others(const std::vector<ObservedEdge>& edges,
                                          const Transform& Z_AB, const std::string& source,
                                          const ObserveOptions& options) {
  return observed(edges, Z_AB, source, options, false);
}

}  // namespace tfdude
