#include "tfdude/math/fusion.hpp"

#include <cmath>
#include <limits>
#include <string>
#include <utility>

#include <boost/math/distributions/chi_squared.hpp>

#include "tfdude/math/perturbation.hpp"

#include "math/minimum.hpp"
#include "math/semidefinite.hpp"

namespace tfdude {
namespace {

constexpr int kMostIterations = 100;
constexpr double kConverged = 1e-12;

// N(mean, covariance) of a pose's perturbation.
struct Gaussian {
  Twist mean;
  Matrix6d covariance;
};

// The information of an estimate about δ in X_true = X Exp(δ): Log(Xₖ⁻¹ X Exp(δ)) = e + Jr⁻¹(e) δ
// has mean zero, and Jr(e) e = e.
Gaussian seen_from(const Pose& X, const Transform& estimate) {
  const Twist e = log(estimate.pose.inverse() * X);
  const Matrix6d J = right_jacobian(e);
  return {-e, J * estimate.covariance.of_specified().matrix() * J.transpose()};
}

// Product of two Gaussians by the gain, which needs no inverse of either. False if they contradict
// each other.
bool merge(Gaussian& sum, const Gaussian& more) {
  const Matrix6d S = sum.covariance + more.covariance;
  const Matrix6d inverse = pseudo_inverse(S);
  const Twist innovation = more.mean - sum.mean;
  if (!is_possible(innovation, S, inverse)) return false;
  const Matrix6d gain = sum.covariance * inverse;
  const Matrix6d rest = Matrix6d::Identity() - gain;
  sum.mean += gain * innovation;
  sum.covariance =
      rest * sum.covariance * rest.transpose() + gain * more.covariance * gain.transpose();
  return true;
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

Result<Fused> fuse(const std::vector<Transform>& estimates) {
  if (estimates.empty()) return fail(Errc::kInvalidInput, "no estimate to fuse");
  if (auto ok = check_complete(estimates); !ok) return tl::unexpected(std::move(ok.error()));
  Pose X = estimates.front().pose;
  for (int iteration = 1; iteration <= kMostIterations; ++iteration) {
    Gaussian sum = seen_from(X, estimates.front());
    for (std::size_t k = 1; k < estimates.size(); ++k) {
      if (!merge(sum, seen_from(X, estimates[k]))) {
        return fail(Errc::kInvalidInput,
                    "estimate " + std::to_string(k) +
                        " contradicts earlier ones in an axis with zero variance");
      }
    }
    X = X * exp(sum.mean);
    // Translations are rounded in proportion to their size.
    const double scale = 1.0 + X.translation().cwiseAbs().maxCoeff();
    if (sum.mean.cwiseAbs().maxCoeff() <= kConverged * scale) {
      return Fused{{X, Covariance::trusted(nearest_semidefinite(sum.covariance))}, iteration};
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
