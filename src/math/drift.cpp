#include "math/drift.hpp"

#include <algorithm>
#include <cmath>

#include "tfdude/math/perturbation.hpp"

#include "math/symmetric_eigen.hpp"

namespace tfdude {
namespace {

// Between two samples the noise since the first one has another lever than at the second one. The
// difference may have negative eigenvalues, which are small beside the whole.
constexpr double kLever = 1e-3;
constexpr double kRoundingOfSum = 1e-9;
constexpr double kNothing = 1e-13;  // of the variance, left by rounding

bool carries_on(const Matrix6d& F, const CommonError& a, const CommonError& b) {
  if (a.source != b.source || a.subtracts != b.subtracts) return false;
  if (a.loading.cols() != b.loading.cols()) return false;
  return (F * a.loading - b.loading).norm() <= kRoundingOfSum * b.loading.norm();
}

}  // namespace

std::optional<Drift> drift_between(const Belief& earlier, const Belief& later) {
  if (earlier.unknown || later.unknown) return std::nullopt;
  if (earlier.unspecified || later.unspecified) return std::nullopt;
  Drift drift;
  drift.F = adjoint(later.pose.inverse() * earlier.pose);
  const auto same = [&](const CommonError& a, const CommonError& b) {
    return carries_on(drift.F, a, b);
  };
  const auto& first = earlier.common_errors;
  const auto& second = later.common_errors;
  if (!std::equal(first.begin(), first.end(), second.begin(), second.end(), same)) {
    return std::nullopt;
  }
  const Matrix6d whole = later.own.matrix();
  const Matrix6d carried = drift.F * earlier.own.matrix() * drift.F.transpose();
  const Twist scale = (whole + carried).diagonal().cwiseMax(0.0).cwiseSqrt();
  const Twist inverse = scale.unaryExpr([](double one) { return one > 0 ? 1 / one : 0.0; });
  const SymmetricEigen eigen =
      symmetric_eigen(Matrix6d(inverse.asDiagonal() * (whole - carried) * inverse.asDiagonal()));
  if (eigen.values.minCoeff() < -kLever) return std::nullopt;
  const auto root_of = [](double one) { return one > kNothing ? std::sqrt(one) : 0.0; };
  const Twist roots = eigen.values.unaryExpr(root_of);
  const Matrix6d root = scale.asDiagonal() * eigen.vectors * roots.asDiagonal();
  drift.added = Covariance::trusted(Matrix6d(root * root.transpose()));
  return drift;
}

}  // namespace tfdude
