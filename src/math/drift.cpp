#include "math/drift.hpp"

#include <algorithm>
#include <cmath>

#include "tfdude/math/perturbation.hpp"

#include "math/symmetric_eigen.hpp"

namespace tfdude {
namespace {

// What the drift adds between two samples counts at the later instant, without the lever of the way
// since. So of two values between samples the difference may lack a lever, and have negative
// variances along axes to which nothing is added. They count that many times then, and what is
// positive a little more, which is enough for any correlation that was lost by it.
constexpr double kMoreOfPositive = 1.05;
constexpr double kMoreOfLacking = 20.0;
// So little of the whole may lack for any reason: counted so many times, it does no harm.
constexpr double kSmallBesideWhole = 0.1;
// More may lack along an axis that has had hardly any error but by this lever.
constexpr double kHardly = 0.05;
constexpr double kLeastTimes = 0.5;
constexpr double kMostTimes = 100;
constexpr double kRoundingOfSum = 1e-9;
constexpr double kNothing = 1e-12;  // of the variance, left by rounding

bool carries_on(const Matrix6d& F, const CommonError& a, const CommonError& b) {
  if (a.source != b.source || a.subtracts != b.subtracts) return false;
  if (a.loading.cols() != b.loading.cols()) return false;
  return (F * a.loading - b.loading).norm() <= kRoundingOfSum * b.loading.norm();
}

// A symmetric matrix as a difference of two covariances.
struct Parts {
  Matrix6d positive = Matrix6d::Zero();
  Matrix6d lacking = Matrix6d::Zero();
};

// By pivots, the largest first. Unlike the eigenvectors, they do not depend on the units of the
// axes: what is lacking along one is not mixed with what is added about another.
Parts parts_of(Matrix6d rest) {
  Parts parts;
  for (int k = 0; k < 6; ++k) {
    Eigen::Index pivot = 0;
    const double largest = rest.diagonal().maxCoeff(&pivot);
    if (largest <= kNothing) break;
    const Twist column = rest.col(pivot);
    const Matrix6d one = column * column.transpose() / largest;
    parts.positive += one;
    rest -= one;
    rest.row(pivot).setZero();
    rest.col(pivot).setZero();
  }
  const SymmetricEigen eigen = symmetric_eigen(rest);
  parts.lacking = eigen.of([](double one) { return std::abs(one) > kNothing ? std::abs(one) : 0; });
  return parts;
}

// Whether levers may be what is lacking. Otherwise an observation has corrected the later value.
// @param before  the own part of the earlier value, in the same units
// @param of_lever  what the lever of the way makes of it
bool may_lack(const Parts& parts, const Matrix6d& before, const Matrix6d& of_lever) {
  // What was added since the sample before is so many times what was added in between, at most.
  double times = 0;
  for (Eigen::Index k = 0; k < 6; ++k) {
    const double added = parts.positive(k, k);
    if (added > kNothing) times = std::max(times, std::min(before(k, k) / added, kMostTimes));
  }
  for (Eigen::Index k = 0; k < 6; ++k) {
    const bool by_lever = times > kLeastTimes && before(k, k) <= kHardly * of_lever(k, k);
    const double of_levers = by_lever ? 2 * (1 + times) * of_lever(k, k) : 0.0;
    if (parts.lacking(k, k) > kSmallBesideWhole + of_levers) return false;
  }
  return true;
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
  const auto scaled = [&](const Matrix6d& one) {
    return Matrix6d(inverse.asDiagonal() * one * inverse.asDiagonal());
  };
  const Parts parts = parts_of(scaled(whole - carried));
  const Matrix6d lever = drift.F - Matrix6d::Identity();
  const Matrix6d of_lever = scaled(lever * earlier.own.matrix() * lever.transpose());
  if (!may_lack(parts, scaled(earlier.own.matrix()), of_lever)) return std::nullopt;
  Matrix6d added = parts.positive;
  if (parts.lacking.trace() > kRoundingOfSum) {
    added = kMoreOfPositive * parts.positive + kMoreOfLacking * parts.lacking;
  }
  added = (scale.asDiagonal() * added * scale.asDiagonal()).eval();
  drift.added = Covariance::trusted(Matrix6d(0.5 * (added + added.transpose())));
  return drift;
}

}  // namespace tfdude
