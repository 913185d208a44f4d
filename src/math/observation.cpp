#include "tfdude/math/observation.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "tfdude/base/id.hpp"
#include "tfdude/base/number.hpp"
#include "tfdude/math/fusion.hpp"
#include "tfdude/math/perturbation.hpp"

#include "math/corrected_errors.hpp"
#include "math/joint_prior.hpp"
#include "math/minimum.hpp"
#include "math/semidefinite.hpp"

namespace tfdude {
namespace {

constexpr int kMostIterations = 100;
// In standard deviations of an edge: if a measurement is far more precise than the edges, no
// smaller step can be reached.
constexpr double kConverged = 1e-6;
constexpr double kSmallest = 1e-12;  // [m, rad]

// h(ξ) = Log(Z⁻¹ X_AB(ξ)) at the current path, and its derivative by each edge's ξ.
struct Linear {
  Twist h;
  std::vector<Matrix6d> H;
};

Linear linearize(const std::vector<ObservedEdge>& edges, const std::vector<Twist>& xi,
                 const Transform& Z_AB) {
  Linear linear{Twist::Zero(), std::vector<Matrix6d>(edges.size())};
  Pose X_FB;  // F: the frame reached, starting from the end of the path
  for (std::size_t k = edges.size(); k-- > 0;) {
    linear.H[k].setZero();
    if (edges[k].way == ObservedEdge::Way::kBeside) continue;
    const bool up = edges[k].way == ObservedEdge::Way::kUp;
    const Pose X_PC = edges[k].X_PC.pose * exp(xi[k]);
    const Pose X_CB = up ? X_PC.inverse() * X_FB : X_FB;
    linear.H[k] = (up ? -1.0 : 1.0) * adjoint(X_CB.inverse()) * right_jacobian(xi[k]);
    X_FB = up ? X_CB : X_PC * X_CB;
  }
  linear.h = log(Z_AB.pose.inverse() * X_FB);
  const Matrix6d outer = right_jacobian(linear.h).inverse();
  for (Matrix6d& H : linear.H) H = (outer * H).eval();
  return linear;
}

// An observation in progress.
class Update {
 public:
  Update(const std::vector<ObservedEdge>& edges, const Transform& Z_AB, const std::string& source,
         const ObserveOptions& options)
      : all_(edges),
        Z_AB_(Z_AB),
        source_(source),
        options_(options),
        prior_(edges),
        xi_(edges.size(), Twist::Zero()),
        linear_(linearize(edges, xi_, Z_AB)),
        R_(Z_AB.covariance.of_specified().matrix()),
        independent_(options.independent) {}

  Result<Observation> run() {
    if (auto ok = count_unknown(); !ok) return tl::unexpected(std::move(ok.error()));
    const Moments m = prior_.moments(linear_.H);
    const Innovation innovation = innovation_of(m);
    Observation observation;
    judge(innovation, observation);
    for (const ObservedEdge& edge : all_) {
      observation.edges.push_back({edge.X_PC, false, false, {}});
    }
    if (independent_) note_innovation(m, innovation, observation);
    if (!observation.accepted) return observation;
    if (!independent_ && !weigh(m)) return observation;
    if (auto ok = iterate(); !ok) return tl::unexpected(std::move(ok.error()));
    apply(observation);
    return observation;
  }

 private:
  // Parts of unknown correlation count as measurement error, unless nothing else can be corrected.
  Result<void> count_unknown() {
    std::vector<std::size_t> unknown;
    for (std::size_t k = 0; k < all_.size(); ++k) {
      if (all_[k].way == ObservedEdge::Way::kBeside) continue;
      if (all_[k].X_PC.unknown && !all_[k].X_PC.unknown->matrix().isZero(0)) unknown.push_back(k);
    }
    if (!prior_.edges().empty()) {
      Covariance R = Z_AB_.covariance.of_specified();
      for (const std::size_t k : unknown) {
        const Matrix6d& H = linear_.H[k];
        R = bound(
            R, Covariance::trusted(Matrix6d(H * all_[k].X_PC.unknown->matrix() * H.transpose())));
      }
      R_ = R.matrix();
    } else if (unknown.size() == 1) {
      prior_.take_unknown(unknown.front());
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

  // The known part of the covariance of h.
  struct Innovation {
    Matrix6d S;
    Matrix6d inverse;
    int dimensions = 0;
  };

  [[nodiscard]] Innovation innovation_of(const Moments& m) const {
    Innovation found;
    found.S = independent_
                  ? Matrix6d(m.of_path + R_)
                  : bound(Covariance::trusted(m.of_path), Covariance::trusted(R_)).matrix();
    found.inverse = pseudo_inverse(found.S, &found.dimensions);
    return found;
  }

  void judge(const Innovation& innovation, Observation& observation) const {
    const bool impossible = !is_possible(linear_.h, innovation.S, innovation.inverse);
    observation.dimensions = innovation.dimensions;
    observation.distance_squared = impossible ? std::numeric_limits<double>::infinity()
                                              : linear_.h.dot(innovation.inverse * linear_.h);
    const bool gated = options_.gate < 1 && observation.dimensions > 0;
    observation.limit = gated ? chi_squared_quantile(options_.gate, observation.dimensions)
                              : std::numeric_limits<double>::infinity();
    observation.accepted = !impossible && observation.distance_squared <= observation.limit;
  }

  // Records the corrections that this observation alone would make.
  void note_innovation(const Moments& m, const Innovation& innovation,
                       Observation& observation) const {
    for (std::size_t i = 0; i < prior_.edges().size(); ++i) {
      if (all_[prior_.edges()[i]].way == ObservedEdge::Way::kBeside) continue;
      const Matrix6d gain = m.with_edge[i] * innovation.inverse;
      const Matrix6d weight = gain.transpose() * pseudo_inverse(prior_.marginal(i)) * gain;
      const Matrix6d share = weight * innovation.S;
      observation.edges[prior_.edges()[i]].innovation = {
          linear_.h.dot(weight * linear_.h), share.trace(), 2.0 * (share * share).trace()};
    }
  }

  // Covariance intersection: inflates both sides, with the weight from which the edges gain most.
  // False if they gain nothing.
  bool weigh(const Moments& m) {
    const std::vector<Twist> variances = variances_of_edges();
    double before = 0;
    for (const Twist& one : variances) before += units_of(one).dot(one);
    const auto size_at = [&](double omega) {
      const Matrix6d inverse = pseudo_inverse(m.of_path / omega + R_ / (1.0 - omega));
      double sum = 0;
      for (std::size_t i = 0; i < variances.size(); ++i) {
        const Twist taken =
            (m.with_edge[i] * inverse * m.with_edge[i].transpose()).diagonal() / omega;
        sum += units_of(variances[i]).dot(variances[i] - taken) / omega;
      }
      return sum;
    };
    const double omega = minimum_within_unit(size_at);
    if (size_at(omega) >= before) return false;
    prior_.widen(1.0 / omega);
    R_ /= 1.0 - omega;
    return true;
  }

  [[nodiscard]] std::vector<Twist> variances_of_edges() const {
    std::vector<Twist> variances;
    for (std::size_t i = 0; i < prior_.edges().size(); ++i) {
      variances.emplace_back(prior_.marginal(i).diagonal());
    }
    return variances;
  }

  Result<void> iterate() {
    const auto& edges = prior_.edges();
    const std::vector<Twist> variances = variances_of_edges();
    for (int iteration = 0; iteration < kMostIterations; ++iteration) {
      const Moments m = prior_.moments(linear_.H);
      Twist seen = -linear_.h;
      for (const std::size_t k : edges) seen += linear_.H[k] * xi_[k];
      const Twist weighted = pseudo_inverse(m.of_path + R_) * seen;
      double change = 0;
      for (std::size_t i = 0; i < edges.size(); ++i) {
        const Twist next = m.with_edge[i] * weighted;
        const Twist step = (next - xi_[edges[i]]).cwiseAbs();
        const Twist deviations = variances[i].cwiseMax(0.0).cwiseSqrt();
        for (int axis = 0; axis < 6; ++axis) {
          if (step[axis] > kSmallest) change = std::max(change, step[axis] / deviations[axis]);
        }
        xi_[edges[i]] = next;
      }
      linear_ = linearize(all_, xi_, Z_AB_);
      if (change <= kConverged) return {};
    }
    return fail(Errc::kInvalidInput,
                "the measurement lies too far from where the path is, towards half a turn");
  }

  void apply(Observation& observation) {
    const auto corrected = corrected_errors(prior_, linear_.H, R_, source_);
    for (std::size_t i = 0; i < prior_.edges().size(); ++i) {
      const std::size_t k = prior_.edges()[i];
      ObservedResult& result = observation.edges[k];
      // The error now refers to another pose.
      const Matrix6d J = right_jacobian(xi_[k]);
      const Covariance own =
          Covariance::trusted(nearest_semidefinite(J * corrected[i].own * J.transpose()));
      (prior_.is_of_unknown() ? result.X_PC.unknown.emplace() : result.X_PC.own) = own;
      result.X_PC.pose = result.X_PC.pose * exp(xi_[k]);
      result.X_PC.common_errors = corrected[i].common_errors;
      for (CommonError& error : result.X_PC.common_errors)
        error.loading = (J * error.loading).eval();
      result.corrected = true;
      result.forgotten = corrected[i].forgotten;
    }
  }

  const std::vector<ObservedEdge>& all_;
  const Transform& Z_AB_;
  const std::string& source_;
  const ObserveOptions& options_;
  JointPrior prior_;
  std::vector<Twist> xi_;
  Linear linear_;
  Matrix6d R_;
  bool independent_;
};

// The only unspecified edge of a path. It takes what the measurement says: the pose with which the
// path agrees with it, and an error that follows from those of the measurement and of the other
// edges, whatever its value was before.
class Unspecified {
 public:
  Unspecified(const std::vector<ObservedEdge>& edges, std::size_t index, const Transform& Z_AB,
              const ObserveOptions& options)
      : edges_(edges), index_(index), Z_AB_(Z_AB), options_(options) {
    Belief& X_PC = edges_[index].X_PC;
    independent_ = options.independent && !X_PC.unknown;
    X_PC.pose = agreeing();
    X_PC.unknown.reset();
    X_PC.own = {};
    X_PC.unspecified = false;
  }

  Result<Observation> run(const std::string& source) {
    const Linear linear =
        linearize(edges_, std::vector<Twist>(edges_.size(), Twist::Zero()), Z_AB_);
    const JointPrior others(edges_);
    Covariance S = Z_AB_.covariance.of_specified();
    const auto add = [&](const Covariance& more) { S = independent_ ? S + more : bound(S, more); };
    for (std::size_t k = 0; k < edges_.size(); ++k) {
      if (edges_[k].way == ObservedEdge::Way::kBeside || !edges_[k].X_PC.unknown) continue;
      independent_ = false;
      add(seen(linear.H[k], edges_[k].X_PC.unknown->matrix()));
    }
    if (!others.edges().empty()) add(Covariance::trusted(others.moments(linear.H).of_path));
    const Matrix6d from_path = linear.H[index_].inverse();
    if (independent_ && !others.edges().empty()) {
      edges_[index_].X_PC.own = seen(kWide * from_path, S.matrix());
      auto found = Update(edges_, Z_AB_, source, options_).run();
      if (found) compared_with_nothing(*found);
      return found;
    }
    Observation found;
    compared_with_nothing(found);
    for (const ObservedEdge& edge : edges_) found.edges.push_back({edge.X_PC, false, false, {}});
    ObservedResult& result = found.edges[index_];
    result.corrected = true;
    (independent_ ? result.X_PC.own : result.X_PC.unknown.emplace()) = seen(from_path, S.matrix());
    return found;
  }

 private:
  // The standard deviations of the error before the measurement, by those after it: so wide that it
  // hardly matters (a millionth of the variance), and narrow enough for the correlation between the
  // edges to be exact.
  static constexpr double kWide = 1e3;

  static Covariance seen(const Matrix6d& H, const Matrix6d& sigma) {
    return Covariance::trusted(nearest_semidefinite(H * sigma * H.transpose()));
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

  static void compared_with_nothing(Observation& found) {
    found.distance_squared = 0;
    found.dimensions = 0;
    found.limit = std::numeric_limits<double>::infinity();
    found.accepted = true;
    for (ObservedResult& result : found.edges) result.innovation = {};
  }

  std::vector<ObservedEdge> edges_;
  std::size_t index_;
  const Transform& Z_AB_;
  const ObserveOptions& options_;
  bool independent_ = true;
};

}  // namespace

Result<Observation> observe(const std::vector<ObservedEdge>& edges, const Transform& Z_AB,
                            const std::string& source, const ObserveOptions& options) {
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
  if (unspecified.empty()) return Update(edges, Z_AB, source, options).run();
  if (unspecified.size() == 1) {
    return Unspecified(edges, unspecified.front(), Z_AB, options).run(source);
  }
  return fail(Errc::kInvalidInput, "the covariance of " + std::to_string(unspecified.size()) +
                                       " edges of the path is unspecified: it is undetermined "
                                       "which of them to correct");
}

}  // namespace tfdude
