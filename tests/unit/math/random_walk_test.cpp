// What a random walk adds to the error of a moving pose, beside its integration in small steps.

#include "math/random_walk.hpp"

#include <cmath>

#include <Eigen/LU>

#include "tfdude/math/perturbation.hpp"

#include "support/catch.hpp"
#include "support/random.hpp"
#include "support/random_walk.hpp"
#include "support/sampling.hpp"

namespace tfdude {
namespace {

using testing::Random;
using testing::walked_in_steps;

constexpr double kPi = 3.14159265358979323846;

Twist motion(Random& random, double angle) {
  Twist xi;
  xi << random.vector(std::pow(10.0, random.uniform(-3, 1))), angle * random.direction();
  return xi;
}

// On some axes only.
Covariance some_noise(Random& random) {
  Matrix6d Q = random.covariance(0.1, 0.1).matrix();
  for (Eigen::Index k = 0; k < 6; ++k) {
    if (random.index(2) == 0) continue;
    Q.row(k).setZero();
    Q.col(k).setZero();
  }
  return Covariance::trusted(Q);
}

// In units of the deviations along the axes; of those that have hardly any, beside others.
double difference(const Matrix6d& found, const Matrix6d& expected) {
  Twist variances = expected.diagonal();
  for (const Eigen::Index half : {0, 3}) {
    auto of_unit = variances.segment<3>(half);
    of_unit = of_unit.cwiseMax(1e-9 * of_unit.maxCoeff()).eval();
  }
  const Twist scale =
      variances.unaryExpr([](double one) { return one > 0 ? 1 / std::sqrt(one) : 0.0; });
  return (scale.asDiagonal() * (found - expected) * scale.asDiagonal()).cwiseAbs().maxCoeff();
}

constexpr double kAngles[] = {0,    1e-9, 1e-6, 1e-3, 0.0099, 0.011, 0.1,
                              0.19, 0.21, 0.5,  1.0,  2.0,    3.0,   kPi - 1e-6};

}  // namespace

TEST_CASE("random walk: it adds the integral over the way") {
  Random random(8201);
  INFO("seed " << random.seed());
  for (const double angle : kAngles) {
    for (int k = 0; k < 40; ++k) {
      const Twist xi = motion(random, angle);
      const Covariance Q = some_noise(random);
      INFO("xi " << xi.transpose() << ", Q\n" << Q.matrix());
      const Matrix6d expected = walked_in_steps(Q.matrix(), xi, 0.3);
      const Matrix6d found = walked(Q, exp(xi), 0.3).matrix();
      CHECK(difference(found, expected) < 1e-7);
      CHECK((expected.diagonal().array() > 0 || found.diagonal().array() <= 0).all());
    }
  }
}

TEST_CASE("random walk: two parts of a way add as much as the whole") {
  Random random(8202);
  INFO("seed " << random.seed());
  for (const double angle : kAngles) {
    for (int k = 0; k < 40; ++k) {
      const Twist xi = motion(random, angle);
      const Covariance Q = some_noise(random);
      const double s = random.uniform(0, 1);
      INFO("xi " << xi.transpose() << ", s " << s << ", Q\n" << Q.matrix());
      const Pose second = exp(Twist((1 - s) * xi));
      const Covariance parts =
          walked(Q, exp(Twist(s * xi)), s).transported(second.inverse()) + walked(Q, second, 1 - s);
      CHECK(difference(parts.matrix(), walked(Q, exp(xi), 1).matrix()) < 1e-7);
    }
  }
}

TEST_CASE("random walk: without a motion it adds Q dt, and without noise nothing") {
  Random random(8203);
  INFO("seed " << random.seed());
  const Covariance Q = random.covariance(0.1, 0.1);
  CHECK(walked(Q, Pose(), 2).upper() == (Q + Q).upper());
  CHECK(walked(Q, random.pose(), 0).upper() == Covariance::Upper{});
  CHECK(walked(Covariance(), random.pose(), 2).upper() == Covariance::Upper{});
}

TEST_CASE("random walk: noise in yaw alone goes sideways on the way ahead") {
  Matrix6d Q = Matrix6d::Zero();
  Q(5, 5) = 0.04;
  Twist ahead = Twist::Zero();
  ahead[0] = 3;
  const Matrix6d added = walked(Covariance::trusted(Q), exp(ahead), 0.5).matrix();
  CHECK(added(5, 5) == testing::Approx(0.02));
  CHECK(added(1, 1) == testing::Approx(0.02 * 9 / 3));
  CHECK(added(1, 5) == testing::Approx(0.02 * 3 / 2));
  CHECK(added(0, 0) == 0);
  CHECK(added(2, 2) == 0);
}

TEST_CASE("random walk: between two instants it is bridged as by a joint Gaussian") {
  Random random(8204);
  INFO("seed " << random.seed());
  for (int k = 0; k < 100; ++k) {
    const Matrix6d until = random.covariance(0.1, 0.1).matrix();
    const Matrix6d since = random.covariance(0.1, 0.1).matrix();
    const Matrix6d F = adjoint(random.pose());
    const Bridge bridge = bridged(until, F, since);
    const Matrix6d later = F * until * F.transpose() + since;
    const Matrix6d K = until * F.transpose() * testing::inverse_of(later);
    CHECK((bridge.K - K).norm() < 1e-8 * (1 + K.norm()));
    CHECK(difference(bridge.rest, until - K * F * until) < 1e-8);
  }
  // Where nothing is added at all, the value is that before.
  const Bridge none = bridged(Matrix6d::Zero(), Matrix6d::Identity(), Matrix6d::Zero());
  CHECK(none.K.isZero(0));
  CHECK(none.rest.isZero(0));
}

}  // namespace tfdude
