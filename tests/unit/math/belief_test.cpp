#include "tfdude/math/belief.hpp"

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
using testing::covariance_diff;
using testing::Gaussian;
using testing::Random;
using testing::transform_diff;

constexpr int kSamples = 100'000;

Belief belief(const Transform& X, std::vector<CommonError> common_errors = {}) {
  return {X.pose, X.covariance.of_specified(), std::nullopt, std::move(common_errors)};
}

Loading random_loading(Random& random, Eigen::Index columns, double metres, double radians) {
  Loading loading(6, columns);
  for (Eigen::Index j = 0; j < columns; ++j) {
    for (Eigen::Index i = 0; i < 6; ++i) {
      loading(i, j) = random.normal() * (i < 3 ? metres : radians);
    }
  }
  return loading;
}

TEST_CASE("Beliefs without common errors compose as transforms do") {
  Random random(611);
  INFO("seed " << random.seed());
  for (int i = 0; i < 200; ++i) {
    const Transform X_AB = random.transform();
    const Transform X_BC = random.transform();
    const Transform sum = collapse(compose(belief(X_AB), belief(X_BC), Order::kSecond));
    CHECK(transform_diff(sum, compose(X_AB, X_BC), 1e-12) == "");
    CHECK(transform_diff(collapse(inverse(belief(X_AB))), inverse(X_AB), 1e-12) == "");
  }
}

TEST_CASE("A shared source cancels on the way back and doubles on the way on") {
  Random random(612);
  INFO("seed " << random.seed());
  for (const Order order : {Order::kSecond, Order::kFourth}) {
    const CommonError common_error{"calibration", false, random_loading(random, 2, 0.1, 0.1)};
    const Transform exact{random.pose(), {}};
    const Belief X_AB = belief(exact, {common_error});
    const Transform there_and_back = collapse(compose(X_AB, inverse(X_AB), order));
    CHECK(testing::pose_diff(there_and_back.pose, {}, 1e-12) == "");
    // To fourth order the terms cancel up to rounding, which is made a valid covariance.
    const double rounding = order == Order::kSecond ? 1e-18 : 1e-11;
    CHECK(there_and_back.covariance.of_specified().matrix().cwiseAbs().maxCoeff() < rounding);
    const Belief still{Pose(), {}, std::nullopt, {common_error}};
    const Transform twice = collapse(compose(still, still, Order::kSecond));
    const Matrix6d expected = 4.0 * common_error.loading * common_error.loading.transpose();
    CHECK(covariance_diff(twice.covariance, Covariance::trusted(expected), 1e-12) == "");
  }
}

TEST_CASE("A source with fewer columns on one edge counts as if the others were zero") {
  Random random(613);
  CommonError two{"s", false, random_loading(random, 2, 0.1, 0.1)};
  CommonError one{"s", false, two.loading.leftCols(1)};
  const Transform sum = collapse(compose(belief({}, {one}), belief({}, {two}), Order::kSecond));
  Loading total = two.loading;
  total.leftCols(1) *= 2.0;
  CHECK(covariance_diff(sum.covariance, Covariance::trusted(Matrix6d(total * total.transpose())),
                        1e-12) == "");
}

// The second moment of the errors of X_AB X_BC, where both have own errors and common errors of a
// source.
Matrix6d sampled_product(const Belief& X_AB, const Belief& X_BC, Random& random, int samples) {
  const Gaussian own_1(X_AB.own);
  const Gaussian own_2(X_BC.own);
  const Pose mean_inverse = (X_AB.pose * X_BC.pose).inverse();
  return testing::second_moment(samples, [&] {
    Twist e_1 = own_1(random);
    Twist e_2 = own_2(random);
    Eigen::VectorXd s(6);
    for (Eigen::Index i = 0; i < 6; ++i) s[i] = random.normal();
    for (const CommonError& common_error : X_AB.common_errors)
      e_1 += common_error.loading * s.head(common_error.loading.cols());
    for (const CommonError& common_error : X_BC.common_errors)
      e_2 += common_error.loading * s.head(common_error.loading.cols());
    return log(mean_inverse * (X_AB.pose * exp(e_1)) * (X_BC.pose * exp(e_2)));
  });
}

TEST_CASE("Common errors propagate as samples show but independent ones would not") {
  Random random(614);
  INFO("seed " << random.seed());
  for (int i = 0; i < 3; ++i) {
    const Belief X_AB = belief(random.transform(2.0, 0.003, 0.003),
                               {{"s", false, random_loading(random, 3, 0.01, 0.01)}});
    const Belief X_BC = belief(random.transform(2.0, 0.003, 0.003),
                               {{"s", false, random_loading(random, 2, 0.01, 0.01)}});
    const Matrix6d sampled = sampled_product(X_AB, X_BC, random, kSamples);
    const Transform shared = collapse(compose(X_AB, X_BC, Order::kSecond));
    CHECK(testing::moment_diff(sampled, shared.covariance.of_specified().matrix(), kSamples,
                               5e-3) == "");
    const Transform as_if = compose(collapse(X_AB), collapse(X_BC));
    CHECK(testing::moment_diff(sampled, as_if.covariance.of_specified().matrix(), kSamples, 5e-3) !=
          "");
  }
}

TEST_CASE("Fourth order is closer to samples than second for independent and common errors") {
  Random random(615);
  INFO("seed " << random.seed());
  for (const double shared : {0.0, 0.15}) {
    INFO("shared " << shared);
    double second = 0;
    double fourth = 0;
    for (int i = 0; i < 5; ++i) {
      Belief X_AB = belief(random.transform(0.5, 0.15, 0.15));
      Belief X_BC = belief(random.transform(0.5, 0.15, 0.15));
      if (shared > 0) {
        X_AB.common_errors = {{"s", false, random_loading(random, 3, shared, shared)}};
        X_BC.common_errors = {{"s", false, random_loading(random, 3, shared, shared)}};
      }
      const Matrix6d sampled = sampled_product(X_AB, X_BC, random, 400'000);
      const auto error = [&](Order order) {
        return (collapse(compose(X_AB, X_BC, order)).covariance.of_specified().matrix() - sampled)
                   .norm() /
               sampled.norm();
      };
      second += error(Order::kSecond);
      fourth += error(Order::kFourth);
    }
    INFO("mean relative errors " << second / 5 << " and " << fourth / 5);
    CHECK(fourth < 0.4 * second);
  }
}

TEST_CASE("The bound for unknown correlation covers any correlation") {
  Random random(616);
  INFO("seed " << random.seed());
  for (int i = 0; i < 200; ++i) {
    const Covariance A = random.covariance(1.0, 0.01);
    const Covariance B = random.covariance(0.1, 0.3);
    const Matrix6d sum = bound(A, B).matrix();
    // Any cross-covariance is A^{1/2} M B^{1/2} with |M| ≤ 1, the worst are turns.
    const Matrix6d M = testing::random_orthogonal(random);
    const Matrix6d root_a = cholesky_root(A.matrix());
    const Matrix6d root_b = cholesky_root(B.matrix());
    const Matrix6d cross = root_a * M * root_b.transpose();
    const Matrix6d worst = A.matrix() + B.matrix() + cross + cross.transpose();
    CHECK(testing::domination(sum, worst) > -1e-12);
  }
  const Covariance A = random.covariance();
  CHECK(covariance_diff(bound(A, {}), A, 0) == "");
  // The same error twice: reached.
  CHECK(covariance_diff(bound(A, A), Covariance::trusted(Matrix6d(4.0 * A.matrix())), 1e-12) == "");
}

TEST_CASE("A path with unknown parts dominates samples and the independent sum does not") {
  Random random(617);
  INFO("seed " << random.seed());
  for (const double correlation : {1.0, 0.5, -0.5, -1.0}) {
    INFO("correlation " << correlation);
    Belief X_AB{random.pose(), {}, random.covariance(0.01, 0.01), {}};
    Belief X_BC{random.pose(), {}, random.covariance(0.01, 0.01), {}};
    const Matrix6d root_1 = cholesky_root(X_AB.unknown->matrix());
    const Matrix6d root_2 = cholesky_root(X_BC.unknown->matrix());
    const Pose mean_inverse = (X_AB.pose * X_BC.pose).inverse();
    const Matrix6d sampled = testing::second_moment(kSamples, [&] {
      Twist s;
      Twist t;
      for (int i = 0; i < 6; ++i) s[i] = random.normal();
      for (int i = 0; i < 6; ++i) t[i] = random.normal();
      const Twist e_2 = root_2 * (correlation * s + std::sqrt(1 - correlation * correlation) * t);
      return log(mean_inverse * (X_AB.pose * exp(root_1 * s)) * (X_BC.pose * exp(e_2)));
    });
    const Transform bounded = collapse(compose(X_AB, X_BC, Order::kSecond));
    CHECK(testing::domination(bounded.covariance.of_specified().matrix(), sampled) > -0.01);
    const Transform independent =
        compose(Transform{X_AB.pose, *X_AB.unknown}, Transform{X_BC.pose, *X_BC.unknown});
    CHECK(testing::domination(independent.covariance.of_specified().matrix(), sampled) < -0.05);
  }
}

TEST_CASE("Composed beliefs stay positive semi-definite to fourth order and for a radian") {
  Random random(618);
  INFO("seed " << random.seed());
  for (const double size : {0.01, 0.3, 1.0}) {
    for (int i = 0; i < 200; ++i) {
      Belief X = belief({});
      for (int k = 0; k < 10; ++k) {
        X = compose(X, belief(random.transform(1.0, size, size)), Order::kFourth);
      }
      CHECK(is_semidefinite(collapse(X).covariance.of_specified()));
    }
  }
}

TEST_CASE("Invalid common errors are rejected by name") {
  Random random(619);
  const CommonError good{"s", false, random_loading(random, 2, 1, 1)};
  CHECK(check_common_errors({good}));
  const auto refusal = [](const std::vector<CommonError>& common_errors) {
    const auto ok = check_common_errors(common_errors);
    REQUIRE_FALSE(ok);
    CHECK(ok.error().code == Errc::kInvalidInput);
    return ok.error().message;
  };
  CHECK_THAT(refusal({good, good}), ContainsSubstring("'s'") && ContainsSubstring("twice"));
  CHECK_THAT(refusal({{"", false, good.loading}}), ContainsSubstring("source"));
  CHECK_THAT(refusal({{"s", false, Loading(6, 0)}}), ContainsSubstring("columns"));
  CHECK_THAT(refusal({{"s", false, Loading::Zero(6, 37)}}), ContainsSubstring("37"));
  Loading bad = good.loading;
  bad(3, 1) = std::nan("");
  CHECK_THAT(refusal({{"s", false, bad}}), ContainsSubstring("not a number"));
}

TEST_CASE("Nothing is left of an exact error of which something is subtracted") {
  Belief X;
  X.common_errors = {{"observed:1", true, Loading::Identity(6, 2)}};
  CHECK(collapse(X).covariance.of_specified().matrix().isZero(0));
}

}  // namespace
}  // namespace tfdude
