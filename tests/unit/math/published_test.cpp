// Experiments of the literature, as far as their parameters are known to us, with the numbers that
// docs/accuracy.md shows. A tolerance is at least five standard errors of the samples, so that
// any seed passes.

#include "support/published.hpp"

#include <array>
#include <cmath>
#include <vector>

#include "tfdude/math/fusion.hpp"

#include "support/catch.hpp"

namespace tfdude {
namespace {

using testing::Approx;
using testing::composed;
using testing::Random;
using testing::TwoPoses;

constexpr int kSamples = 200'000;

// ---- Barfoot & Furgale 2014, section III: the formulas once more, as printed there

using Matrix3d = Eigen::Matrix3d;

// The operators of one and of two matrices that the fourth-order terms are made of.
Matrix3d angled(const Matrix3d& A) { return A - A.trace() * Matrix3d::Identity(); }
Matrix3d angled(const Matrix3d& A, const Matrix3d& B) {
  return angled(A) * angled(B) + angled(B * A);
}

struct Blocks {
  Matrix3d rr;  // of ρ with ρ
  Matrix3d rp;  // of ρ with φ
  Matrix3d pp;  // of φ with φ
};

Blocks blocks(const Matrix6d& m) {
  return {m.topLeftCorner<3, 3>(), m.topRightCorner<3, 3>(), m.bottomRightCorner<3, 3>()};
}

Matrix6d cubic_operator(const Matrix6d& sigma) {
  const Blocks s = blocks(sigma);
  Matrix6d A = Matrix6d::Zero();
  A.topLeftCorner<3, 3>() = A.bottomRightCorner<3, 3>() = angled(s.pp);
  A.topRightCorner<3, 3>() = angled(s.rp + s.rp.transpose());
  return A;
}

Matrix6d brackets(const Matrix6d& sigma_1, const Matrix6d& sigma_2) {
  const Blocks a = blocks(sigma_1);
  const Blocks b = blocks(sigma_2);
  const Matrix3d a_pr = a.rp.transpose();
  const Matrix3d b_pr = b.rp.transpose();
  const Matrix3d rp = angled(a.pp, b_pr) + angled(a_pr, b.pp);
  Matrix6d B;
  B.topLeftCorner<3, 3>() =
      angled(a.pp, b.rr) + angled(a_pr, b.rp) + angled(a.rp, b_pr) + angled(a.rr, b.pp);
  B.topRightCorner<3, 3>() = rp;
  B.bottomLeftCorner<3, 3>() = rp.transpose();
  B.bottomRightCorner<3, 3>() = angled(a.pp, b.pp);
  return B;
}

Matrix6d left_of_product(const testing::SharedPair& pair, Order order) {
  return left_covariance(collapse(compose(pair.first, pair.second, order))).of_specified().matrix();
}

// Of the left perturbation of X1 X2, to fourth order.
Matrix6d as_printed(const TwoPoses& poses) {
  const Matrix6d S_1 = poses.first.covariance.matrix();
  const Matrix6d Ad = adjoint(poses.first.mean);
  const Matrix6d S_2 = Ad * poses.second.covariance.matrix() * Ad.transpose();
  const Matrix6d cubic = cubic_operator(S_1) * S_2 + cubic_operator(S_2) * S_1;
  return S_1 + S_2 + brackets(S_1, S_2) / 4.0 + (cubic + cubic.transpose()) / 12.0;
}

TEST_CASE("Two poses compose to fourth order by the formulas of Barfoot and Furgale") {
  for (const double alpha : {1e-3, 0.2, 1.0}) {
    INFO("alpha " << alpha);
    const TwoPoses poses = testing::two_poses(alpha);
    const Matrix6d expected = as_printed(poses);
    CHECK((composed(poses, Order::kFourth) - expected).norm() < 1e-12 * expected.norm());
    CHECK((composed(poses, Order::kSecond) - expected).norm() > 0.1 * alpha * expected.norm());
  }
}

TEST_CASE("Two poses of Barfoot and Furgale: both orders have the errors of the reference run") {
  Random random(701);
  INFO("seed " << random.seed());
  const auto errors = [&](double alpha) {
    const TwoPoses poses = testing::two_poses(alpha);
    const Matrix6d sampled = testing::sampled_product(poses, 0, random, kSamples);
    return std::array<double, 3>{sampled.norm(), (composed(poses, Order::kSecond) - sampled).norm(),
                                 (composed(poses, Order::kFourth) - sampled).norm()};
  };
  const auto [norm, second, fourth] = errors(1.0);
  CAPTURE(norm, second, fourth);
  CHECK(norm == Approx(29.8).margin(0.3));
  CHECK(second == Approx(3.63).margin(0.25));
  CHECK(fourth == Approx(0.43).margin(0.25));
  const auto [norm_s, second_s, fourth_s] = errors(0.2);
  CAPTURE(norm_s, second_s, fourth_s);
  CHECK(norm_s == Approx(5.54).margin(0.03));
  CHECK(second_s == Approx(0.144).margin(0.02));
  CHECK(fourth_s < 0.04);
}

TEST_CASE("Fourth order is no better than second beyond a radian or at one if correlated") {
  Random random(702);
  INFO("seed " << random.seed());
  const auto poses = testing::two_poses(3.0);
  const Matrix6d sampled = testing::sampled_product(poses, 0, random, kSamples);
  const double second = (composed(poses, Order::kSecond) - sampled).norm();
  const double fourth = (composed(poses, Order::kFourth) - sampled).norm();
  CAPTURE(second, fourth);
  CHECK(fourth > second);

  const testing::SharedPair pair = testing::shared_pair(testing::two_poses(1.0), 1.0);
  const Matrix6d twice = testing::sampled_product(testing::two_poses(1.0), 1.0, random, kSamples);
  const double second_twice = (left_of_product(pair, Order::kSecond) - twice).norm();
  const double fourth_twice = (left_of_product(pair, Order::kFourth) - twice).norm();
  CAPTURE(second_twice, fourth_twice);
  CHECK(fourth_twice > second_twice);
}

// ---- The chain

TEST_CASE("A chain of steps has the covariance of the closed form and of the paper") {
  const double variance = testing::kChainYaw * testing::kChainYaw;
  for (const int K : {1, 2, 10, 100}) {
    CAPTURE(K);
    const Matrix6d second =
        left_covariance(testing::chain(K, Order::kSecond)).of_specified().matrix();
    CHECK(second(0, 0) == 0);
    CHECK(second(1, 1) == Approx(variance * K * (K - 1) * (2 * K - 1) / 6));
    CHECK(second(1, 5) == Approx(-variance * K * (K - 1) / 2));
    CHECK(second(5, 5) == Approx(variance * K));
  }
  const Matrix6d fourth =
      left_covariance(testing::chain(100, Order::kFourth)).of_specified().matrix();
  CHECK(fourth(0, 0) == Approx(1.678).margin(0.001));
  CHECK(fourth(1, 1) == Approx(294.4).margin(0.05));
  CHECK(fourth(1, 5) == Approx(-4.455));
  CHECK(fourth(5, 5) == Approx(0.09));
}

TEST_CASE("A sampled chain spreads along its path as only fourth order predicts") {
  constexpr int kChains = 30'000;
  Random random(703);
  INFO("seed " << random.seed());
  const Pose back = testing::chain(testing::kChainSteps, Order::kSecond).pose.inverse();
  const Matrix6d sampled = testing::second_moment(
      kChains, [&] { return log(testing::sampled_chain(testing::kChainSteps, random) * back); });
  // Beside the terms of sixth order, 2 % here, that of xx has a standard error of about 2 %.
  CHECK(sampled(0, 0) == Approx(1.678).epsilon(0.15));
  CHECK(sampled(1, 1) == Approx(294.4).epsilon(0.05));
  CHECK(sampled(1, 5) == Approx(-4.455).epsilon(0.05));
  CHECK(sampled(5, 5) == Approx(0.09).epsilon(0.05));
}

// ---- Barfoot & Furgale 2014, section IV: three estimates of one pose

struct Trials {
  double cost = 0;   // mean of Σ eᵀ Σₖ⁻¹ e: of 18 numbers, 6 of them spent
  double error = 0;  // root of the mean square of the result's error
  double nees = 0;   // mean of e' Σ⁻¹ e of the result
};

// Estimates whose errors are `spread` times as large as they say.
Trials fuse_often(double alpha, double spread, int trials, Random& random) {
  Trials mean;
  int fused = 0;
  for (int i = 0; i < trials; ++i) {
    std::vector<Transform> estimates = testing::drawn_estimates(alpha * spread * spread, random);
    for (Transform& X : estimates) {
      X.covariance =
          Covariance::trusted(Matrix6d(X.covariance.of_specified().matrix() / (spread * spread)));
    }
    const auto result = fuse(estimates);
    if (!result) continue;
    ++fused;
    const Transform& X = result->X;
    for (const Transform& one : estimates) mean.cost += testing::squared_distance(one, X.pose);
    mean.nees += testing::squared_distance(X, testing::fused_truth());
    mean.error += log(testing::fused_truth() * X.pose.inverse()).squaredNorm();
  }
  REQUIRE(fused > 0.98 * trials);
  return {mean.cost / fused, std::sqrt(mean.error / fused), mean.nees / fused};
}

TEST_CASE("Three fused estimates have the expected cost and the claimed error") {
  constexpr int kTrials = 1500;
  Random random(704);
  INFO("seed " << random.seed());
  const double allowed_cost = 5.0 * std::sqrt(2.0 * 12 / kTrials);
  const double allowed_nees = 5.0 * std::sqrt(2.0 * 6 / kTrials);
  const Trials right = fuse_often(0.01, 1, kTrials, random);
  CHECK(right.cost == Approx(12).margin(allowed_cost));
  CHECK(right.nees == Approx(6).margin(allowed_nees));
  const Trials overconfident = fuse_often(0.01, 1.3, kTrials, random);
  CHECK(overconfident.cost > 12 + 2 * allowed_cost);
  CHECK(overconfident.nees > 6 + 2 * allowed_nees);
}

TEST_CASE("The error of fused estimates grows with theirs and is too small beyond half a radian") {
  constexpr int kTrials = 1500;
  Random random(705);
  INFO("seed " << random.seed());
  const double small = fuse_often(0.01, 1, kTrials, random).error;
  const Trials half = fuse_often(0.25, 1, kTrials, random);
  const Trials large = fuse_often(1.0, 1, kTrials, random);
  CAPTURE(small, half.error, half.nees, large.error, large.nees);
  CHECK(half.error == Approx(5 * small).epsilon(0.1));
  CHECK(large.error > 1.5 * half.error);
  CHECK(half.nees == Approx(6.25).margin(0.7));
  CHECK(large.nees > 7.5);
}

// ---- Correlated poses, after the idea of Mangelson et al. 2020

TEST_CASE("Correlated poses: a shared source agrees with samples and independence does not") {
  Random random(706);
  INFO("seed " << random.seed());
  const TwoPoses poses = testing::two_poses(0.2);
  for (const double correlation : {-0.9, -0.5, 0.5, 0.9}) {
    const Matrix6d sampled = testing::sampled_product(poses, correlation, random, kSamples);
    const testing::SharedPair pair = testing::shared_pair(poses, correlation);
    const double independent = (composed(poses, Order::kFourth) - sampled).norm();
    const double second = (left_of_product(pair, Order::kSecond) - sampled).norm();
    const double fourth = (left_of_product(pair, Order::kFourth) - sampled).norm();
    CAPTURE(correlation, sampled.norm(), independent, second, fourth);
    CHECK(independent > 10 * second);
    CHECK(fourth < 0.6 * second);
    // The bound is one of the linear part; what it leaves out is 3 % here.
    const Matrix6d bounded = left_of_product(testing::unknown_pair(poses), Order::kSecond);
    CHECK(testing::domination(bounded, sampled) > -0.04);
    if (correlation > 0)
      CHECK(testing::domination(composed(poses, Order::kFourth), sampled) < -0.2);
  }
}

TEST_CASE("Two poses of one trajectory: a known common error cancels") {
  const testing::Trajectory t = testing::trajectory(100);
  const Transform way = collapse(compose(inverse(t.A()), t.B(), Order::kSecond));
  const Matrix6d right = t.X_AB.covariance.of_specified().matrix();
  CHECK((way.covariance.of_specified().matrix() - right).norm() < 1e-9 * right.norm());
  const auto position = [](const StatedCovariance& sigma) {
    return std::sqrt(sigma.of_specified().matrix().topLeftCorner<3, 3>().trace());
  };
  const Transform independent = between(collapse(t.A()), collapse(t.B()));
  CHECK(position(independent.covariance) > 30 * position(t.X_AB.covariance));
}

TEST_CASE("Two poses jointly Gaussian in their tangent spaces need fourth order") {
  Random random(707);
  INFO("seed " << random.seed());
  const testing::Trajectory t = testing::trajectory(100);
  const Matrix6d sampled = testing::sampled_way(t, random, kSamples);
  const auto error = [&](Order order) {
    const StatedCovariance sigma = collapse(compose(inverse(t.A()), t.B(), order)).covariance;
    return (sigma.of_specified().matrix() - sampled).norm() / sampled.norm();
  };
  const double second = error(Order::kSecond);
  const double fourth = error(Order::kFourth);
  CAPTURE(second, fourth);
  CHECK(second > 0.2);
  CHECK(fourth < 0.05);
}

}  // namespace
}  // namespace tfdude
