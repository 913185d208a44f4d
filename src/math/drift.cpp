#include "math/drift.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include "tfdude/math/perturbation.hpp"

#include "math/instant_sources.hpp"
#include "math/symmetric_eigen.hpp"

namespace tfdude {
namespace {

// If both values follow the model, the difference of their covariances is one, up to rounding. A
// pose that came late, when the later value was known, tells another way between them, by which a
// little may be missing. It counts so many times then, which is enough for any correlation.
constexpr double kTimesMissing = 20.0;
// Of the whole. If more is missing, an observation has corrected the later value alone. Less of it
// does no harm.
constexpr double kMostMissing = 1e-2;
constexpr double kRoundingOfSum = 1e-9;

bool carries_on(const Matrix6d& F, const CommonError& a, const CommonError& b) {
  if (a.source != b.source || a.subtracts != b.subtracts) return false;
  if (a.loading.cols() != b.loading.cols()) return false;
  return (F * a.loading - b.loading).norm() <= kRoundingOfSum * b.loading.norm();
}

// Whether a value has all sources of observations that another one has. It has none of further
// columns of an observation in which it has no share, but always the first source.
bool has_all(const Belief& X, const Belief& other) {
  const auto has = [&](const CommonError& one) {
    const std::string first = one.source.substr(0, one.source.find('+'));
    return std::any_of(X.common_errors.begin(), X.common_errors.end(),
                       [&](const CommonError& own) { return own.source == first; });
  };
  return std::all_of(other.common_errors.begin(), other.common_errors.end(),
                     [&](const CommonError& one) { return !is_observed(one) || has(one); });
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
  const Matrix6d rest = inverse.asDiagonal() * (whole - carried) * inverse.asDiagonal();
  const SymmetricEigen eigen = symmetric_eigen(rest);
  if (eigen.values[0] < -kMostMissing) return std::nullopt;
  const Matrix6d added = scale.asDiagonal() * eigen.of([](double one) {
    if (one >= 0) return one;
    return one < -kRoundingOfSum ? -kTimesMissing * one : 0.0;
  }) * scale.asDiagonal();
  drift.added = Covariance::trusted(Matrix6d(0.5 * (added + added.transpose())));
  return drift;
}

bool are_corrected_together(const Belief& a, const Belief& b) {
  if (a.unknown || b.unknown || a.unspecified || b.unspecified) return false;
  const auto was_observed = [](const Belief& X) {
    return std::any_of(X.common_errors.begin(), X.common_errors.end(), is_observed);
  };
  return was_observed(a) && was_observed(b) && has_all(a, b) && has_all(b, a);
}

bool ties(const CommonError& common_error) {
  return is_observed(common_error) && said_source(common_error.source).empty() &&
         !common_error.loading.isZero(0);
}

Covariance take_whole(Belief& X) {
  Matrix6d sigma = X.own.matrix();
  for (const CommonError& one : X.common_errors) {
    if (is_observed(one) && !one.subtracts) sigma += one.loading * one.loading.transpose();
  }
  X.own = {};
  X.common_errors.erase(std::remove_if(X.common_errors.begin(), X.common_errors.end(), is_observed),
                        X.common_errors.end());
  return Covariance::trusted(sigma);
}

}  // namespace tfdude
