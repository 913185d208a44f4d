#include "tfdude/math/interpolate.hpp"

#include <cmath>
#include <vector>

#include "tfdude/math/perturbation.hpp"

#include "support/catch.hpp"
#include "support/jacobian.hpp"
#include "support/pose_diff.hpp"
#include "support/random.hpp"
#include "support/sampling.hpp"

namespace tfdude {
namespace {

using testing::cholesky_root;
using testing::covariance_diff;
using testing::eigenvalues;
using testing::numeric_jacobian;
using testing::pose_diff;
using testing::Random;
using testing::transform_diff;

constexpr double kPi = 3.14159265358979323846;

// Both the series and the closed forms, and where one takes over from the other.
const std::vector<double> kAngles{0.0, 1e-9, 1e-3, 0.0999, 0.1001, 1.0, 2.5, kPi - 1e-6};
const std::vector<double> kParts{0.0, 1e-6, 0.25, 0.5, 0.9, 1.0};

struct Samples {
  Transform X0;
  Transform X1;
};

Samples samples(Random& random, double angle, double reach = 2.0) {
  const Pose X0 = random.pose(reach);
  return {{X0, random.covariance()}, {X0 * exp(random.twist(angle, reach)), random.covariance()}};
}

Covariance propagated(const Matrix6d& J, const StatedCovariance& sigma) {
  return Covariance::trusted(Matrix6d(J * sigma.of_specified().matrix() * J.transpose()));
}

// The largest ratio of variances in any direction.
double largest_ratio(const Matrix6d& sampled, const Matrix6d& given) {
  const Matrix6d root = cholesky_root(given);
  const Matrix6d half = root.triangularView<Eigen::Lower>().solve(sampled);
  return eigenvalues(root.triangularView<Eigen::Lower>().solve(half.transpose()))[5];
}

}  // namespace

TEST_CASE("interpolation begins at one sample and ends at the other") {
  Random random(501);
  INFO("seed " << random.seed());
  for (const double angle : kAngles) {
    INFO("angle " << angle);
    const auto [X0, X1] = samples(random, angle);
    CHECK(transform_diff(interpolate(X0, X1, 0.0), X0, 1e-9) == "");
    CHECK(transform_diff(interpolate(X0, X1, 1.0), X1, 1e-9) == "");
    CHECK(pose_diff(extrapolate(X0, X1, 1.0).pose, X1.pose, 1e-9) == "");
    CHECK(covariance_diff(extrapolate(X0, X1, 1.0).covariance, X1.covariance, 1e-9) == "");
  }
}

TEST_CASE("interpolation is the same from either end") {
  Random random(502);
  INFO("seed " << random.seed());
  for (const double angle : kAngles) {
    for (const double s : kParts) {
      INFO("angle " << angle << ", part " << s);
      const auto [X0, X1] = samples(random, angle);
      CHECK(transform_diff(interpolate(X0, X1, s), interpolate(X1, X0, 1.0 - s), 1e-8) == "");
    }
  }
}

TEST_CASE("motion with a constant twist is interpolated exactly") {
  Random random(503);
  INFO("seed " << random.seed());
  for (const double angle : kAngles) {
    const Pose start = random.pose();
    const Twist xi = random.twist(angle);
    const auto at = [&](double t) { return Transform::exact(start * exp(t * xi)); };
    for (const double s : kParts) {
      INFO("angle " << angle << ", part " << s);
      CHECK(pose_diff(interpolate(at(0), at(1), s).pose, at(s).pose, 1e-8) == "");
      CHECK(pose_diff(extrapolate(at(0), at(0.25), 1 + s).pose, at(0.25 + 0.25 * s).pose, 1e-8) ==
            "");
    }
  }
}

TEST_CASE("the covariance weights each sample's Jacobian as a mean does") {
  Random random(504);
  INFO("seed " << random.seed());
  for (const double angle : kAngles) {
    if (angle > 3.0) continue;  // where a small step may go round the other way
    const auto [X0, X1] = samples(random, angle);
    const Pose a = X0.pose;
    const Pose b = X1.pose;
    for (const double s : {0.25, 0.5, 0.9}) {
      INFO("angle " << angle << ", part " << s);
      const Matrix6d J0 = numeric_jacobian([&, s = s](const Twist& e) {
        return interpolate(Transform::exact(a * exp(e)), Transform::exact(b), s).pose;
      });
      const Matrix6d J1 = numeric_jacobian([&, s = s](const Twist& e) {
        return interpolate(Transform::exact(a), Transform::exact(b * exp(e)), s).pose;
      });
      const StatedCovariance from0 = interpolate(X0, Transform::exact(b), s).covariance;
      const StatedCovariance from1 = interpolate(Transform::exact(a), X1, s).covariance;
      CHECK(covariance_diff(Covariance::trusted(Matrix6d((1 - s) * from0.of_specified().matrix())),
                            propagated(J0, X0.covariance), 1e-6) == "");
      CHECK(covariance_diff(Covariance::trusted(Matrix6d(s * from1.of_specified().matrix())),
                            propagated(J1, X1.covariance), 1e-6) == "");
    }
  }
}

// B = Jr(s ξ) Jr⁻¹(ξ) by s = n + r: s Jr(s ξ) = Σ_{k<n} Ad(Exp(-k ξ)) Jr(ξ) + r Ad(Exp(-n ξ)) Jr(r
// ξ), all of them sums of what is of the size of one.
Matrix6d carrying(const Twist& xi, double s) {
  const int n = static_cast<int>(std::floor(s));
  const double r = s - n;
  Matrix6d sum = Matrix6d::Zero();
  for (int k = 0; k < n; ++k) sum += adjoint(exp(-static_cast<double>(k) * xi));
  const Matrix6d rest = adjoint(exp(-static_cast<double>(n) * xi)) * right_jacobian(r * xi);
  sum += r * rest * testing::inverse_of(right_jacobian(xi));
  return sum / s;
}

TEST_CASE("extrapolation is right for every angle and distance") {
  Random random(506);
  INFO("seed " << random.seed());
  for (const double angle : {0.0, 1e-12, 1e-8, 1e-6, 1e-5, 1e-4, 0.99e-3, 1.01e-3, 0.01, 0.05,
                             0.0999, 0.1001, 0.5, 1.0, 2.5, kPi - 1e-6}) {
    for (const double s : {1.0, 1.000001, 1.5, 2.0, 9.9, 60.0, 100.0, 333.3, 999.9, 1000.0}) {
      INFO("angle " << angle << ", s " << s);
      const auto [X0, X1] = samples(random, angle);
      const Twist xi = log(X0.pose.inverse() * X1.pose);
      const double beyond = s - 1.0;
      const Matrix6d B1 = carrying(xi, s);
      // Jl((1-s) ξ) Jl⁻¹(ξ) of negative parts: Jr((s-1) ξ) Jl⁻¹(ξ) = Jr((s-1) ξ) Jr⁻¹(ξ)
      // Ad(Exp(-ξ)).
      Matrix6d B0 = Matrix6d::Zero();
      if (beyond > 0) B0 = carrying(xi, beyond) * adjoint(exp(-xi));
      const Matrix6d expected =
          beyond * (s + beyond) * B0 * X0.covariance.of_specified().matrix() * B0.transpose() +
          s * (s + beyond) * B1 * X1.covariance.of_specified().matrix() * B1.transpose();
      const Matrix6d given = extrapolate(X0, X1, s).covariance.of_specified().matrix();
      // Relative in all directions, so that no variance is too small either.
      const Matrix6d root = cholesky_root(expected);
      const Matrix6d whitened =
          root.triangularView<Eigen::Lower>().solve(given - expected).transpose().eval();
      const Matrix6d relative = root.triangularView<Eigen::Lower>().solve(whitened);
      CHECK((given - expected).norm() <= 1e-9 * expected.norm());
      CHECK(relative.cwiseAbs().maxCoeff() < 1e-6);
    }
  }
}

// Ten standard errors of a sample variance, √(2 / N), are 0.045.
TEST_CASE("the covariance is no less than the sampled one for any correlation of the samples") {
  constexpr int kSamples = 100'000;
  Random random(505);
  INFO("seed " << random.seed());
  for (const double correlation : {0.0, 0.5, 1.0}) {
    const auto [X0, X1] = samples(random, 0.7);
    const Matrix6d root0 = cholesky_root(X0.covariance.of_specified().matrix());
    const Matrix6d root1 = cholesky_root(X1.covariance.of_specified().matrix());
    const double s = random.uniform(0.3, 0.7);
    const double beyond = random.uniform(1.1, 2.0);
    const Transform between = interpolate(X0, X1, s);
    const Transform after = extrapolate(X0, X1, beyond);
    const Pose between_inverse = between.pose.inverse();
    const Pose after_inverse = after.pose.inverse();
    Matrix6d sampled = Matrix6d::Zero();
    Matrix6d sampled_after = Matrix6d::Zero();
    for (int i = 0; i < kSamples; ++i) {
      Twist first;
      Twist second;
      for (int k = 0; k < 6; ++k) first[k] = random.normal();
      for (int k = 0; k < 6; ++k) second[k] = random.normal();
      second = correlation * first + std::sqrt(1.0 - correlation * correlation) * second;
      // Small, so that the neglected second order is smaller than the sampling error.
      const Transform Y0 = Transform::exact(X0.pose * exp(0.1 * root0 * first));
      const Transform Y1 = Transform::exact(X1.pose * exp(0.1 * root1 * second));
      const Twist e = 10.0 * log(between_inverse * interpolate(Y0, Y1, s).pose);
      const Twist e_after = 10.0 * log(after_inverse * extrapolate(Y0, Y1, beyond).pose);
      sampled += e * e.transpose() / kSamples;
      sampled_after += e_after * e_after.transpose() / kSamples;
    }
    INFO("correlation " << correlation << ", part " << s << " and " << beyond);
    CHECK(largest_ratio(sampled, between.covariance.of_specified().matrix()) < 1.045);
    CHECK(largest_ratio(sampled_after, after.covariance.of_specified().matrix()) < 1.045);
    // As if the samples were independent.
    const Matrix6d naive =
        (1 - s) * interpolate(X0, Transform::exact(X1.pose), s).covariance.of_specified().matrix() +
        s * interpolate(Transform::exact(X0.pose), X1, s).covariance.of_specified().matrix();
    CHECK((largest_ratio(sampled, naive) < 1.045) == (correlation == 0.0));
  }
}

}  // namespace tfdude
