#include "tfdude/math/fusion.hpp"

#include <cmath>

#include "math/semidefinite.hpp"
#include "support/catch.hpp"
#include "support/pose_diff.hpp"
#include "support/random.hpp"
#include "support/sampling.hpp"

namespace tfdude {
namespace {

using testing::cholesky_root;
using testing::ContainsSubstring;
using testing::Gaussian;
using testing::kRounding;
using testing::Random;
using testing::transform_diff;

// An estimate of a true pose: X_true = X · Exp(ξ).
Transform estimate(const Pose& truth, const Covariance& covariance, Random& random) {
  const Twist xi = Gaussian(covariance)(random);
  return {truth * exp(xi).inverse(), covariance};
}

double nees(const Transform& X, const Pose& truth) {
  const Twist e = log(X.pose.inverse() * truth);
  return e.dot(pseudo_inverse(X.covariance.of_specified().matrix()) * e);
}

TEST_CASE("Fused estimates are consistent over 1,000 runs") {
  Random random(621);
  INFO("seed " << random.seed());
  double sum = 0;
  constexpr int kRuns = 1000;
  for (int run = 0; run < kRuns; ++run) {
    const Pose truth = random.pose();
    std::vector<Transform> estimates;
    for (int k = 0; k < 3; ++k) {
      estimates.push_back(estimate(truth, random.covariance(0.02, 0.02), random));
    }
    const auto fused = fuse(estimates);
    REQUIRE(fused);
    sum += nees(fused->X, truth);
  }
  // 99 % of all means of so many χ² with six degrees of freedom.
  const double low = chi_squared_quantile(0.005, 6 * kRuns) / kRuns;
  const double high = chi_squared_quantile(0.995, 6 * kRuns) / kRuns;
  CHECK(sum / kRuns > low);
  CHECK(sum / kRuns < high);
}

TEST_CASE("Fusion minimizes the sum of squared errors") {
  Random random(622);
  INFO("seed " << random.seed());
  for (int i = 0; i < 50; ++i) {
    const Pose truth = random.pose();
    std::vector<Transform> estimates;
    for (int k = 0; k < 3; ++k) {
      estimates.push_back(estimate(truth, random.covariance(0.3, 0.3), random));
    }
    const auto fused = fuse(estimates);
    REQUIRE(fused);
    const auto cost = [&](const Pose& X) {
      double total = 0;
      for (const Transform& one : estimates) total += nees(one, X);
      return total;
    };
    const double least = cost(fused->X.pose);
    for (int axis = 0; axis < 6; ++axis) {
      for (const double step : {-1e-4, 1e-4}) {
        CHECK(cost(fused->X.pose * exp(step * Twist::Unit(axis))) > least);
      }
    }
  }
}

TEST_CASE("Fusion of one estimate changes nothing and the order of estimates does not matter") {
  Random random(623);
  INFO("seed " << random.seed());
  const Transform A = random.transform();
  const auto alone = fuse({A});
  REQUIRE(alone);
  CHECK(transform_diff(alone->X, A, 1e-12) == "");
  const Transform B = estimate(A.pose, random.covariance(0.1, 0.1), random);
  const auto ab = fuse({A, B});
  const auto ba = fuse({B, A});
  REQUIRE(ab);
  REQUIRE(ba);
  CHECK(transform_diff(ab->X, ba->X, 1e-9) == "");
}

TEST_CASE("Exact estimates stay and contradicting ones are rejected") {
  Random random(624);
  const Transform exact = Transform::exact(random.pose());
  const auto fused = fuse({estimate(exact.pose, random.covariance(), random), exact});
  REQUIRE(fused);
  CHECK(testing::pose_diff(fused->X.pose, exact.pose, 1e-9) == "");
  CHECK(fused->X.covariance.of_specified().matrix().cwiseAbs().maxCoeff() < 1e-30);
  const auto both = fuse({exact, Transform::exact(exact.pose * exp(0.1 * Twist::Unit(2)))});
  REQUIRE_FALSE(both);
  CHECK_THAT(both.error().message, ContainsSubstring("contradicts"));
  CHECK_FALSE(fuse({}));
}

TEST_CASE("Covariance intersection dominates the error for any correlation") {
  Random random(625);
  INFO("seed " << random.seed());
  constexpr int kRuns = 20'000;
  const Pose truth = random.pose();
  const Covariance A = random.covariance(0.01, 0.01);
  const Covariance B = random.covariance(0.01, 0.01);
  const Matrix6d root_a = cholesky_root(A.matrix());
  const Matrix6d root_b = cholesky_root(B.matrix());
  for (const double correlation : {1.0, 0.7, -0.7}) {
    INFO("correlation " << correlation);
    Matrix6d intersected = Matrix6d::Zero();
    Matrix6d independent = Matrix6d::Zero();
    Transform X;
    Transform as_if;
    for (int run = 0; run < kRuns / 20; ++run) {
      Twist s;
      Twist t;
      for (int i = 0; i < 6; ++i) s[i] = random.normal();
      for (int i = 0; i < 6; ++i) t[i] = random.normal();
      const Twist e_a = root_a * s;
      const Twist e_b = root_b * (correlation * s + std::sqrt(1.0 - correlation * correlation) * t);
      const Transform X_a{truth * exp(e_a).inverse(), A};
      const Transform X_b{truth * exp(e_b).inverse(), B};
      const auto both = intersect(X_a, X_b);
      const auto fused = fuse({X_a, X_b});
      REQUIRE(both);
      REQUIRE(fused);
      X = both->X;
      as_if = fused->X;
      const Twist e = log(X.pose.inverse() * truth);
      const Twist f = log(as_if.pose.inverse() * truth);
      intersected += e * e.transpose() / (kRuns / 20.0);
      independent += f * f.transpose() / (kRuns / 20.0);
    }
    CHECK(testing::domination(X.covariance.of_specified().matrix(), intersected) > -0.15);
    if (correlation > 0) {
      CHECK(testing::domination(as_if.covariance.of_specified().matrix(), independent) < -0.3);
    }
  }
  const Transform small{truth, random.covariance(1e-4, 1e-4)};
  const auto kept = intersect(small, {truth, random.covariance(1.0, 1.0)});
  REQUIRE(kept);
  CHECK(transform_diff(kept->X, small, kRounding) == "");
}

TEST_CASE("Quantiles of the chi-squared distribution are those of published tables") {
  CHECK(chi_squared_quantile(0.95, 1) == testing::Approx(3.841).epsilon(1e-3));
  CHECK(chi_squared_quantile(0.99, 6) == testing::Approx(16.812).epsilon(1e-4));
  CHECK(chi_squared_quantile(0.999, 6) == testing::Approx(22.458).epsilon(1e-4));
}

}  // namespace
}  // namespace tfdude
