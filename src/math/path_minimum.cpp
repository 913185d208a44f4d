#include "math/path_minimum.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "tfdude/math/perturbation.hpp"

#include "math/decompositions.hpp"

namespace tfdude {
namespace {

constexpr int kMostIterations = 100;
constexpr int kMostHalvings = 20;
// In standard deviations of an edge.
constexpr double kConverged = 1e-6;
// Of the cost, which is in squared standard deviations: no smaller gain is worth a step.
constexpr double kNoGain = 1e-9;
// If part of the measurement is exact, the cost would be infinite beside the minimum. So costs are
// compared as if it had this share of the path's deviation.
constexpr double kComparedAs = 1e-6;

// Times the dimensions: a cost that right measurements seldom exceed.
constexpr double kDoubtful = 2.0;
constexpr int kIterationsAtOnce = 10;

// Errors of the edges.
struct EdgeErrors {
  Deviations deviations;
  std::vector<Twist> xi;  // of all edges
};

Deviations between(const Deviations& from, const Deviations& to, double share) {
  Deviations at = to;
  for (std::size_t i = 0; i < to.own.size(); ++i) {
    at.own[i] = from.own[i] + share * (to.own[i] - from.own[i]);
  }
  for (std::size_t k = 0; k < to.of_source.size(); ++k) {
    at.of_source[k] = from.of_source[k] + share * (to.of_source[k] - from.of_source[k]);
  }
  return at;
}

// Tells rounding from an error of a path whose covariance is a difference of large ones.
class Remainder {
 public:
  Remainder(const JointPrior& prior, const std::vector<Matrix6d>& H)
      : prior_(prior), H_(H), size_(prior.size_on_path(H)) {}

  /// How much of the path's error may be rounding [m, rad].
  [[nodiscard]] Twist within() const { return size_ / kDeep; }
  /// @param w  the direction, as a row by which the path's error there has a variance of one
  [[nodiscard]] bool is_rounding(const Eigen::Matrix<double, 1, 6>& w) const {
    const double cancelled = w.transpose().cwiseProduct(size_).norm();
    if (!(cancelled > kDeep)) return false;
    // What remains of a real error of the path is a small part of the edges' errors, and tells of
    // an edge no more than such a part. Rounding is correlated with all of them by chance.
    const auto with_path = prior_.with_path(H_, Whitening(w));
    for (std::size_t i = 0; i < with_path.size(); ++i) {
      const Twist told = with_path[i].col(0).cwiseAbs();
      const Twist most = kMostTold * prior_.deviations(i);
      if ((cancelled * told.array() > most.array()).any()) return true;
    }
    return false;
  }

 private:
  // If less cancels, what rounding changes is below a hundredth of a variance.
  static constexpr double kDeep = 1e5;
  static constexpr double kMostTold = 3;

  const JointPrior& prior_;
  const std::vector<Matrix6d>& H_;
  const Twist size_;
};

class Descent {
 public:
  Descent(const std::vector<ObservedEdge>& edges, const JointPrior& prior, const Pose& Z_AB,
          const Loading& R)
      : all_(edges), prior_(prior), Z_AB_(Z_AB), R_(R) {}

  PathMinimum run() {
    if (prior_.is_tied()) {
      auto found = with_first_derivatives();
      if (found && found->cost() <= kDoubtful * found->S.rank()) return *std::move(found);
    }
    start();
    const PathMinimum at_start = here();
    path_ = prior_.path(linear_.H);
    PathMinimum found = approach(R_, kMostIterations);
    if (found.converged && found.cost() <= kDoubtful * found.S.rank()) return found;
    // Perhaps not the least minimum. Another way to it: from less precise measurements to this one.
    start();
    double share = 1.0;
    while (share > kComparedAs) {
      (void)approach(joined(R_, share * path_), kIterationsAtOnce);
      share *= 0.25;
    }
    PathMinimum other = approach(R_, kMostIterations);
    if (other.converged && !(found.converged && found.cost() <= other.cost())) return other;
    return found.converged ? found : at_start;
  }

 private:
  enum class Step { kMore, kLast, kStuck };

  // An earlier observation has tied the errors of edges as its derivatives say. The minimum follows
  // the bend of the path along what was never measured, and would take that for information. So it
  // is found with the derivatives at the estimate, as in a filter with first-estimates Jacobians
  // (Huang, Mourikis & Roumeliotis 2010). What the measurement ties follows those where it ends.
  std::optional<PathMinimum> with_first_derivatives() {
    constexpr int kMostSteps = 30;
    start();
    const std::vector<Matrix6d> H = linear_.H;
    PathMinimum now = here();
    for (int i = 0; i < kMostSteps; ++i) {
      EdgeErrors next = best(now);
      const bool converged = is_small(next);
      at_ = std::move(next);
      linear_ = linearize(all_, at_.xi, Z_AB_);
      if (converged) {
        now = here();
        now.converged = true;
        return now;
      }
      linear_.H = H;
      now = here();
    }
    return std::nullopt;
  }

  void start() {
    linear_ = linearize(all_, std::vector<Twist>(all_.size(), Twist::Zero()), Z_AB_);
    at_ = of(prior_.most_probable(linear_.H, Whitening::Zero(0, 6), Eigen::VectorXd(0)));
    noise_ = R_;
  }

  // From where it is, as if the measurement had that noise.
  PathMinimum approach(const Loading& noise, int iterations) {
    noise_ = noise;
    compared_.emplace(joined(noise, kComparedAs * path_), rounding_of_pose(linear_.reach));
    PathMinimum now = here();
    for (int iteration = 0; iteration < iterations; ++iteration) {
      const Step step = descend(now);
      if (step == Step::kStuck) break;
      now = here();
      now.converged = step == Step::kLast;
      if (now.converged) break;
    }
    return now;
  }

  [[nodiscard]] PathMinimum here() const {
    Twist seen = -linear_.h;
    for (const std::size_t k : prior_.edges()) seen += linear_.H[k] * at_.xi[k];
    return {at_.xi, linear_, measured(prior_, linear_, noise_), seen, false};
  }

  [[nodiscard]] double cost(const EdgeErrors& errors, const Twist& h) const {
    return prior_.cost(errors.deviations) + compared_->distance_squared(h);
  }

  [[nodiscard]] EdgeErrors of(Deviations deviations) const {
    EdgeErrors errors{std::move(deviations), std::vector<Twist>(all_.size(), Twist::Zero())};
    const auto xi = prior_.errors(errors.deviations);
    for (std::size_t i = 0; i < xi.size(); ++i) errors.xi[prior_.edges()[i]] = xi[i];
    return errors;
  }

  // Where the cost of the linear problem is least.
  [[nodiscard]] EdgeErrors best(const PathMinimum& now) const {
    const Whitening& W = now.S.whitening();
    return of(prior_.most_probable(now.linear.H, W, W * now.seen));
  }

  Step descend(const PathMinimum& now) {
    const EdgeErrors whole = best(now);
    const double before = cost(at_, linear_.h);
    const double gain = before - cost(whole, expected(whole, now));
    const bool last = is_small(whole) || gain <= hidden_gain(before);
    double share = 1.0;
    for (int halving = 0; halving < kMostHalvings; ++halving) {
      EdgeErrors next = of(between(at_.deviations, whole.deviations, share));
      share *= 0.5;
      LinearPath linear = linearize(all_, next.xi, Z_AB_);
      if (!last && !(cost(next, linear.h) < before)) continue;
      at_ = std::move(next);
      linear_ = std::move(linear);
      return last ? Step::kLast : Step::kMore;
    }
    return Step::kStuck;
  }

  // h after a step, if the path were linear.
  [[nodiscard]] Twist expected(const EdgeErrors& next, const PathMinimum& now) const {
    Twist h = -now.seen;
    for (const std::size_t k : prior_.edges()) h += now.linear.H[k] * next.xi[k];
    return h;
  }

  // By how much rounding of h moves a cost.
  [[nodiscard]] double hidden_gain(double cost) const {
    const Twist rounding = rounding_of_pose(linear_.reach);
    const double by = (compared_->whitening().cwiseAbs() * rounding).norm();
    return by * (2.0 * std::sqrt(cost) + by) + kNoGain * (1.0 + cost);
  }

  // Whether the step is below a millionth of the edges' deviations, or of what rounding hides.
  [[nodiscard]] bool is_small(const EdgeErrors& next) {
    if (deviations_.empty()) {
      for (std::size_t i = 0; i < prior_.edges().size(); ++i) {
        deviations_.push_back(prior_.deviations(i));
      }
    }
    const Twist hidden = rounding_of_pose(linear_.reach);
    for (std::size_t i = 0; i < prior_.edges().size(); ++i) {
      const std::size_t k = prior_.edges()[i];
      const Twist step = (next.xi[k] - at_.xi[k]).cwiseAbs();
      const Twist enough = (kConverged * deviations_[i]).cwiseMax(hidden);
      if (!(step.array() <= enough.array()).all()) return false;
    }
    return true;
  }

  const std::vector<ObservedEdge>& all_;
  const JointPrior& prior_;
  const Pose& Z_AB_;
  const Loading& R_;
  Loading noise_;
  Loading path_;  // a root of the path's covariance at ξ = 0
  EdgeErrors at_;
  LinearPath linear_;
  std::optional<Factor> compared_;
  std::vector<Twist> deviations_;
};

}  // namespace

LinearPath linearize(const std::vector<ObservedEdge>& edges, const std::vector<Twist>& xi,
                     const Pose& Z_AB) {
  LinearPath linear{
      Twist::Zero(), std::vector<Matrix6d>(edges.size()), Z_AB.translation().norm(), {}};
  Pose X_FB;  // F: the frame reached, starting from the end of the path
  for (std::size_t k = edges.size(); k-- > 0;) {
    linear.H[k].setZero();
    if (edges[k].way == ObservedEdge::Way::kBeside) continue;
    const bool up = edges[k].way == ObservedEdge::Way::kUp;
    const Pose X_PC = edges[k].X_PC.pose * exp(xi[k]);
    const Pose X_CB = up ? X_PC.inverse() * X_FB : X_FB;
    linear.H[k] = (up ? -1.0 : 1.0) * adjoint(X_CB.inverse()) * right_jacobian(xi[k]);
    X_FB = up ? X_CB : X_PC * X_CB;
    linear.reach += X_PC.translation().norm();
  }
  linear.X_AB = X_FB;
  linear.h = log(Z_AB.inverse() * X_FB);
  const Matrix6d outer = inverse_of(right_jacobian(linear.h));
  for (Matrix6d& H : linear.H) H = (outer * H).eval();
  return linear;
}

Factor measured(const JointPrior& prior, const LinearPath& linear, const Loading& R) {
  Loading all = joined(prior.path(linear.H), R);
  Twist rounding = rounding_of_pose(linear.reach);
  if (!prior.is_tied()) return Factor(all, rounding);
  const Remainder remainder(prior, linear.H);
  // First by axis: beside rounding alone, scaled to one, other axes would seem correlated with it.
  for (Eigen::Index axis = 0; axis < 6; ++axis) {
    const double deviation = all.row(axis).norm();
    if (deviation == 0) continue;
    if (!remainder.is_rounding(Twist::Unit(axis).transpose() / deviation)) continue;
    all.row(axis).setZero();
    rounding[axis] = 0;
  }
  Factor S(all, rounding);
  std::vector<bool> hidden;
  for (Eigen::Index k = 0; k < S.root().cols(); ++k) {
    hidden.push_back(remainder.is_rounding(S.whitening().row(k)));
  }
  S.leave_out(hidden, remainder.within());
  return S;
}

PathMinimum minimize(const std::vector<ObservedEdge>& edges, const JointPrior& prior,
                     const Pose& Z_AB, const Loading& R) {
  return Descent(edges, prior, Z_AB, R).run();
}

}  // namespace tfdude
