#include "tfdude/math/fusion.hpp"

#include <algorithm>
#include <limits>
#include <string>
#include <utility>

#include <boost/math/distributions/chi_squared.hpp>

#include "tfdude/math/perturbation.hpp"

#include "math/minimum.hpp"
#include "math/square_root.hpp"
#include "math/unknown_rotation.hpp"

namespace tfdude {
namespace {

constexpr int kMostFusions = 100;
constexpr double kFusionConverged = 1e-12;

// N(mean, root rootᵀ) of a pose's perturbation.
struct Gaussian {
  Twist mean;
  Loading root;
};

// The information of an estimate about δ in X_true = X Exp(δ): Log(Xₖ⁻¹ X Exp(δ)) = e + Jr⁻¹(e) δ
// has mean zero, and Jr(e) e = e.
Gaussian seen_from(const Pose& X, const Measured& stated) {
  const Measured estimate = with_unknown_rotation_of(X, stated);
  const Twist e = log(estimate.X_AB.inverse() * X);
  return {-e, right_jacobian(e) * estimate.root};
}

// Product of two Gaussians by the gain, which needs no inverse of either. False if they contradict
// each other.
bool merge(Gaussian& sum, const Gaussian& more, double reach) {
  const Factor S(joined(sum.root, more.root), rounding_of_pose(reach));
  const Twist innovation = more.mean - sum.mean;
  if (!S.can_cause(innovation, tolerance_of_pose(reach))) return false;
  sum.mean += sum.root * (S.whitening() * sum.root).transpose() * (S.whitening() * innovation);
  sum.root = updated_root(sum.root, sum.root, more.root, S);
  return true;
}

std::vector<Measured> with_roots(const std::vector<Transform>& estimates) {
  std::vector<Measured> all;
  for (const Transform& one : estimates) {
    all.push_back({one.pose, root_of(one.covariance.of_specified().matrix())});
  }
  return all;
}

double reach_of(const std::vector<Measured>& estimates) {
  double reach = 0;
  for (const Measured& one : estimates) reach = std::max(reach, one.X_AB.translation().norm());
  return reach;
}

// What rounding hides of a step. A deviation of kilometres costs the other axes of an estimate that
// is turned their last digits.
Twist rounding_of(const std::vector<Measured>& estimates, double reach) {
  constexpr double kDigits = 4 * std::numeric_limits<double>::epsilon();
  double widest = 0;
  for (const Measured& one : estimates) {
    widest = std::max(widest, one.root.topRows<3>().rowwise().norm().maxCoeff());
  }
  Twist hidden;
  hidden << Eigen::Vector3d::Constant(kFusionConverged * reach + kDigits * widest),
      Eigen::Vector3d::Constant(kFusionConverged);
  return hidden;
}

// Whether the last step was below rounding, or a billionth of the deviations.
bool is_small(const Gaussian& step, const Twist& hidden) {
  constexpr double kEnough = 1e-9;
  const Twist enough = hidden.cwiseMax(kEnough * step.root.rowwise().norm());
  return (step.mean.cwiseAbs().array() <= enough.array()).all();
}

Transform weighted(const Transform& X, double weight) {
  return {X.pose, Covariance::trusted(Matrix6d(X.covariance.of_specified().matrix() / weight))};
}

Result<void> check_complete(const std::vector<Transform>& estimates) {
  for (std::size_t k = 0; k < estimates.size(); ++k) {
    if (estimates[k].covariance.complete()) continue;
    return fail(Errc::kInvalidInput, "the covariance of estimate " + std::to_string(k) +
                                         " is unspecified: it cannot be weighed");
  }
  return {};
}

}  // namespace

Result<Fused> fuse(const std::vector<Transform>& stated) {
  if (stated.empty()) return fail(Errc::kInvalidInput, "no estimate to fuse");
  if (auto ok = check_complete(stated); !ok) return tl::unexpected(std::move(ok.error()));
  const std::vector<Measured> estimates = with_roots(stated);
  const double reach = reach_of(estimates);
  const Twist hidden = rounding_of(estimates, reach);
  // What knows nothing of a rotation would cost the others their digits.
  std::size_t first = 0;
  for (std::size_t k = estimates.size(); k-- > 0;) {
    if (unknown_rotations(estimates[k].root) == 0) first = k;
  }
  Pose X = estimates[first].X_AB;
  for (int iteration = 1; iteration <= kMostFusions; ++iteration) {
    Gaussian sum = seen_from(X, estimates[first]);
    for (std::size_t k = 0; k < estimates.size(); ++k) {
      if (k == first) continue;
      if (!merge(sum, seen_from(X, estimates[k]), reach)) {
        return fail(Errc::kInvalidInput,
                    "estimate " + std::to_string(k) +
                        " contradicts earlier ones in an axis with zero variance");
      }
    }
    X = X * exp(sum.mean);
    if (is_small(sum, hidden)) {
      return Fused{{X, Covariance::trusted(square_of(sum.root))}, iteration};
    }
  }
  return fail(Errc::kInvalidInput, "the estimates lie too far apart to be fused");
}

Result<Fused> intersect(const Transform& A, const Transform& B) {
  if (auto ok = check_complete({A, B}); !ok) return tl::unexpected(std::move(ok.error()));
  const auto variances = [](const Transform& X) -> Twist {
    return X.covariance.of_specified().matrix().diagonal();
  };
  const Twist unit = units_of(variances(A) + variances(B));
  const auto size_of = [&](const Transform& X) { return unit.dot(variances(X)); };
  const auto fused_at = [&](double omega) {
    return fuse({weighted(A, omega), weighted(B, 1.0 - omega)});
  };
  const double omega = minimum_within_unit([&](double at) {
    const auto fused = fused_at(at);
    return fused ? size_of(fused->X) : std::numeric_limits<double>::infinity();
  });
  auto best = fused_at(omega);
  const double size = best ? size_of(best->X) : std::numeric_limits<double>::infinity();
  if (size_of(A) <= size) return Fused{A, 0};
  if (size_of(B) <= size) return Fused{B, 0};
  return best;
}

double chi_squared_quantile(double probability, int dimensions) {
  return boost::math::quantile(boost::math::chi_squared(dimensions), probability);
}

}  // namespace tfdude
