#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "tfdude/math/perturbation.hpp"

#include "math/drift.hpp"
#include "support/catch.hpp"
#include "support/drifting.hpp"
#include "support/random.hpp"
#include "support/random_walk.hpp"
#include "support/sampling.hpp"

// The random walk of an edge that drifts and turns, beside its integration in small steps.
namespace tfdude {
namespace {

using testing::at;
using testing::Drifting;
using testing::kStep;
using testing::of_deviations;
using testing::Random;
using testing::when;

}  // namespace

// Beside the joint covariance of the errors at two instants, which knows nothing of samples.
TEST_CASE("drift: the errors at any two instants are those of one walk, whatever turns it makes") {
  Random random(4302);
  INFO("seed " << random.seed());
  for (const double turn : {0.0, 0.03, 0.3, 1.0, 3.1}) {
    for (int run = 0; run < 5; ++run) {
      INFO("turns of " << turn << " rad, run " << run);
      std::array<double, 6> noise{};
      for (double& one : noise) one = random.index(2) == 0 ? 0.0 : random.uniform(0.001, 0.1);
      Drifting robot(*Covariance::from_stddev(noise));
      const Matrix6d Q = robot.Q.matrix();
      std::vector<Twist> steps;
      robot.drive(0);
      for (int step = 1; step <= 5; ++step) {
        steps.push_back(Twist());
        steps.back() << random.vector(0.3), turn * random.direction();
        robot.G = robot.G * exp(steps.back());
        robot.drive(step);
      }
      const auto belief_at = [&](double t) {
        const Time stamp = at(0) + std::chrono::nanoseconds(std::llround(t * 1e8));
        const auto seen = robot.forest.lookup_segments({{"world", "base"}}, when(stamp), {}, true);
        REQUIRE(seen);
        return belief_of(seen->values[0], seen->correlations[0]);
      };
      const auto round = [](double t) { return std::round(t * 1e4) / 1e4; };
      const double from = round(random.uniform(0, 4));
      const double to = run == 0 ? 5 : round(random.uniform(from, 5));
      // From the start until then, in parts up to each sample.
      Matrix6d sigma = Matrix6d::Zero();
      Matrix6d added = Matrix6d::Zero();
      Matrix6d first = Matrix6d::Zero();
      double t = 0;
      for (const double next : {std::min(from, 1.0), std::min(from, 2.0), std::min(from, 3.0), from,
                                std::clamp(1.0, from, to), std::clamp(2.0, from, to),
                                std::clamp(3.0, from, to), std::clamp(4.0, from, to), to}) {
        if (next <= t) continue;
        const Twist xi = (next - t) * steps[static_cast<std::size_t>(t)];
        const Matrix6d A = testing::adjoint_of_exp(Twist(-xi));
        const Matrix6d more = testing::walked_in_steps(Q, xi, (next - t) * kStep);
        sigma = (A * sigma * A.transpose() + more).eval();
        if (next <= from) first = sigma;
        if (next > from) added = (A * added * A.transpose() + more).eval();
        t = next;
      }
      const Belief earlier = belief_at(from);
      const Belief later = belief_at(to);
      const Matrix6d unit = 1e-14 * Matrix6d::Identity();
      const auto is_same = [&](const Covariance& found, const Matrix6d& expected) {
        const Twist scale = (expected + unit).diagonal().cwiseSqrt().cwiseInverse();
        const Matrix6d off = scale.asDiagonal() * (found.matrix() - expected) * scale.asDiagonal();
        return off.cwiseAbs().maxCoeff() < 1e-5;
      };
      CHECK(is_same(earlier.own, first));
      CHECK(is_same(later.own, sigma));
      const auto drift = drift_between(earlier, later);
      REQUIRE(drift);
      CHECK(is_same(drift->added, added));
    }
  }
}

// The value between is interpolated between the two. Beside the errors of a dense filter.
TEST_CASE("drift: between a sample and a corrected one the bound holds for a base that turns") {
  Random random(4303);
  INFO("seed " << random.seed());
  for (const double turn : {0.0, 0.3, 1.0, 3.0}) {
    for (int run = 0; run < 10; ++run) {
      const double s = random.uniform(0.05, 0.95);
      INFO("turns of " << turn << " rad, run " << run << ", at " << s);
      Twist noise = Twist::Zero();
      for (const Eigen::Index axis : {0, 1, 5}) {
        if (axis == 5 || random.index(2) == 0) noise[axis] = random.uniform(0.01, 0.1);
      }
      const Matrix6d Q = noise.cwiseAbs2().asDiagonal();
      Drifting robot(Covariance::trusted(Q));
      REQUIRE(robot.forest.update("object", {Pose(), of_deviations(0.01, 0.01)}));
      Twist xi = Twist::Zero();
      xi[0] = random.uniform(0.1, 1);
      xi[5] = turn;
      for (int step = 0; step < 3; ++step) {
        robot.drive(step);
        if (step < 2) robot.G = robot.G * exp(xi);
      }
      const double size = random.uniform(1e-3, 0.1);
      const Pose X_BO = robot.G.inverse();
      REQUIRE(robot.see({X_BO, of_deviations(size, size)}, 2, "observed:1"));
      const Time then = at(1) + std::chrono::nanoseconds(std::llround(s * 1e8));
      const auto found = robot.forest.lookup("world", "base", when(then));
      REQUIRE(found);
      // At s, and what the rest of the way adds.
      const Matrix6d to = testing::adjoint_of_exp(Twist(-s * xi));
      const Matrix6d from = testing::adjoint_of_exp(Twist((s - 1) * xi));
      const Matrix6d at_s = to * testing::walked_in_steps(Q, xi, kStep) * to.transpose() +
                            testing::walked_in_steps(Q, Twist(s * xi), s * kStep);
      const Matrix6d newest = from * at_s * from.transpose() +
                              testing::walked_in_steps(Q, Twist((1 - s) * xi), (1 - s) * kStep);
      const Matrix6d H = -adjoint(X_BO.inverse());
      const Matrix6d of_others =
          of_deviations(0.01, 0.01).matrix() + of_deviations(size, size).matrix();
      const Matrix6d S = H * newest * H.transpose() + of_others;
      const Matrix6d share =
          s * right_jacobian(Twist(s * xi)) * testing::inverse_of(right_jacobian(xi));
      const Matrix6d gain = share * newest * H.transpose() * testing::inverse_of(S);
      const Matrix6d left = Matrix6d::Identity() - gain * H * from;
      const Matrix6d rest = newest - from * at_s * from.transpose();
      const Matrix6d expected = left * at_s * left.transpose() +
                                gain * (H * rest * H.transpose() + of_others) * gain.transpose();
      const Matrix6d unit = 1e-9 * expected.diagonal().maxCoeff() * Matrix6d::Identity();
      CHECK(testing::domination(found->covariance.of_specified().matrix() + unit, expected) >
            -1e-6);
    }
  }
}

}  // namespace tfdude
