#include "math/mean_velocity.hpp"

#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include "tfdude/math/perturbation.hpp"

#include "support/catch.hpp"
#include "support/random.hpp"
#include "support/sampling.hpp"

namespace tfdude {
namespace {

using testing::Approx;
using testing::Gaussian;
using testing::Random;
using Way = ObservedEdge::Way;

constexpr int kSamples = 40'000;

Belief belief(const Pose& X, const Covariance& own = {}) { return {X, own, {}, {}, false}; }

EdgeAtEnds moving(const Pose& before, const Pose& after, const Covariance& own = {},
                  Way way = Way::kDown) {
  return {belief(before, own), belief(after, own), way, false};
}

EdgeAtEnds fixed(const Transform& X, Way way = Way::kDown) {
  const Belief value = belief(X.pose, X.covariance.of_specified());
  return {value, value, way, true};
}

Twist together(const MeanVelocity& velocity) {
  Twist both;
  both << velocity.linear, velocity.angular;
  return both;
}

// The errors of one edge at both ends.
struct Errors {
  Twist before;
  Twist after;
};

// The second moment of the velocity's error, over sampled errors of the edges.
Matrix6d sampled(const std::vector<EdgeAtEnds>& path, double seconds,
                 const std::function<std::vector<Errors>()>& errors) {
  const Twist mean = together(mean_velocity(path, seconds));
  return testing::second_moment(kSamples, [&]() -> Twist {
    std::vector<EdgeAtEnds> wrong = path;
    const std::vector<Errors> all = errors();
    for (std::size_t k = 0; k < wrong.size(); ++k) {
      wrong[k].before.pose = wrong[k].before.pose * exp(all[k].before);
      wrong[k].after.pose = wrong[k].after.pose * exp(all[k].after);
    }
    return together(mean_velocity(wrong, seconds)) - mean;
  });
}

// A motion with changing velocity, of which position and rotation are known in closed form.
Pose swing(double t) {
  const Eigen::Vector3d p(std::sin(2 * t), 0.5 * t * t, std::cos(t));
  const Eigen::Quaterniond q(Eigen::AngleAxisd(1.5 * t, Eigen::Vector3d::UnitZ()) *
                             Eigen::AngleAxisd(0.7 * t * t, Eigen::Vector3d::UnitX()));
  return Pose::trusted(q, p);
}

TEST_CASE("mean velocity: a rotation about a fixed axis is that of the rim") {
  // B turns about A's z-axis at 2 rad/s, 0.5 m away, and points along the radius.
  const auto rim = [](double t) {
    const Eigen::Quaterniond q(Eigen::AngleAxisd(2 * t, Eigen::Vector3d::UnitZ()));
    return Pose::trusted(q, q * Eigen::Vector3d(0.5, 0, 0));
  };
  constexpr double kHalf = 1e-4;
  const double quarter = std::acos(-1) / 4;  // [s]: it points along A's y-axis
  const MeanVelocity velocity =
      mean_velocity({moving(rim(quarter - kHalf), rim(quarter + kHalf))}, 2 * kHalf);
  CHECK((velocity.linear - Eigen::Vector3d(-1, 0, 0)).norm() < 1e-7);
  CHECK((velocity.angular - Eigen::Vector3d(0, 0, 2)).norm() < 1e-9);
  CHECK_FALSE(velocity.bound);
  // Over a long interval it is the chord, and still the whole angle.
  const MeanVelocity half_turn = mean_velocity({moving(rim(0), rim(1.5))}, 1.5);
  CHECK((half_turn.angular - Eigen::Vector3d(0, 0, 2)).norm() < 1e-12);
  CHECK((half_turn.linear - (rim(1.5).translation() - rim(0).translation()) / 1.5).norm() < 1e-12);
}

TEST_CASE("mean velocity: it agrees with finite differences of a known motion") {
  for (const double t : {0.3, 1.0, 2.2}) {
    constexpr double kStep = 1e-5;
    const Pose before = swing(t - kStep);
    const Pose after = swing(t + kStep);
    const Eigen::Vector3d v = (after.translation() - before.translation()) / (2 * kStep);
    // W = R' Rᵀ
    const Eigen::Matrix3d R = swing(t).rotation().toRotationMatrix();
    const Eigen::Matrix3d W =
        (after.rotation().toRotationMatrix() - before.rotation().toRotationMatrix()) / (2 * kStep) *
        R.transpose();
    const Eigen::Vector3d w(W(2, 1), W(0, 2), W(1, 0));
    double last = 1;
    for (const double over : {0.1, 0.05, 0.025}) {
      const MeanVelocity mean =
          mean_velocity({moving(swing(t - over / 2), swing(t + over / 2))}, over);
      const double error = (mean.linear - v).norm() + (mean.angular - w).norm();
      CHECK(error < 3 * over * over);  // of second order in the interval
      CHECK(error < last / 3);
      last = error;
    }
  }
}

TEST_CASE("mean velocity: a path moves as its composition") {
  Random random(701);
  INFO("seed " << random.seed());
  const Pose X_DA = random.pose();
  const Pose X_BE = random.pose();
  const Transform X_EF = random.transform();
  // A <- D (up), D -> B moves, E <- ... (up), E -> F
  const Pose before = X_DA.inverse() * swing(0.2) * X_BE.inverse() * X_EF.pose;
  const Pose after = X_DA.inverse() * swing(0.5) * X_BE.inverse() * X_EF.pose;
  const MeanVelocity whole = mean_velocity({moving(before, after)}, 0.3);
  const MeanVelocity path =
      mean_velocity({fixed({X_DA, {}}, Way::kUp), moving(swing(0.2), swing(0.5)),
                     fixed({X_BE, {}}, Way::kUp), fixed(X_EF)},
                    0.3);
  CHECK((together(whole) - together(path)).norm() < 1e-12);
}

TEST_CASE("mean velocity: the error of a static edge is common to both ends") {
  Random random(702);
  INFO("seed " << random.seed());
  const std::vector<EdgeAtEnds> path{
      fixed(random.transform(1, 1e-3, 1e-3), Way::kUp), moving(swing(0.2), swing(0.5)),
      fixed(random.transform(1, 1e-3, 1e-3)), moving(swing(0.9), swing(1.0), {}, Way::kUp),
      fixed(random.transform(1, 1e-3, 1e-3), Way::kUp)};
  const MeanVelocity velocity = mean_velocity(path, 0.1);
  CHECK_FALSE(velocity.bound);
  std::vector<Gaussian> gaussians;
  for (const EdgeAtEnds& edge : path) {
    gaussians.emplace_back(Eigen::MatrixXd(edge.before.own.matrix()));
  }
  const Matrix6d S = sampled(path, 0.1, [&] {
    std::vector<Errors> errors;
    for (const Gaussian& gaussian : gaussians) {
      const Twist xi = gaussian(random);
      errors.push_back({xi, xi});
    }
    return errors;
  });
  const Matrix6d sigma = velocity.covariance.matrix();
  CHECK(testing::moment_diff(S, sigma, kSamples, 0.01) == "");
  CHECK(testing::moment_diff(S, Matrix6d(1.2 * sigma), kSamples, 0.01) != "");

  // If nothing turns, all of it cancels, however large it is.
  const Pose start = Pose::trusted(Eigen::Quaterniond::Identity(), {0, 0, 0});
  const Pose further = Pose::trusted(Eigen::Quaterniond::Identity(), {0.1, 0, 0});
  const MeanVelocity straight = mean_velocity(
      {fixed(random.transform(1, 10, 0)), moving(start, further), fixed({{}, Covariance()})}, 0.1);
  CHECK(straight.covariance.matrix().norm() < 1e-9);
}

TEST_CASE("mean velocity: that of a dynamic edge covers any correlation of the ends") {
  Random random(703);
  INFO("seed " << random.seed());
  const Covariance own = random.covariance(1e-4, 1e-4);
  const std::vector<EdgeAtEnds> path{moving(swing(0.2), swing(0.3), own),
                                     fixed(random.transform(1, 1e-4, 1e-4)),
                                     moving(swing(1.2), swing(1.1), own, Way::kUp)};
  const MeanVelocity velocity = mean_velocity(path, 0.1);
  CHECK(velocity.bound);
  const Matrix6d sigma = velocity.covariance.matrix();
  const Gaussian gaussian{Eigen::MatrixXd(own.matrix())};
  const Gaussian of_fixed{Eigen::MatrixXd(path[1].before.own.matrix())};
  for (const double correlation : {-1.0, -0.5, 0.0, 0.5, 1.0}) {
    INFO("correlation " << correlation);
    const Matrix6d S = sampled(path, 0.1, [&] {
      std::vector<Errors> errors;
      for (int k = 0; k < 3; ++k) {
        if (k == 1) {
          const Twist xi = of_fixed(random);
          errors.push_back({xi, xi});
          continue;
        }
        const Twist before = gaussian(random);
        const Twist fresh = gaussian(random);
        errors.push_back(
            {before, correlation * before + std::sqrt(1 - correlation * correlation) * fresh});
      }
      return errors;
    });
    CHECK(testing::domination(sigma, S) > -0.03);
  }
}

TEST_CASE("mean velocity: the bound is reached when the ends are opposed") {
  Random random(704);
  INFO("seed " << random.seed());
  const Covariance own = random.covariance(1e-4, 1e-4);
  const Pose start = Pose::trusted(Eigen::Quaterniond::Identity(), {0, 0, 0});
  const Pose further = Pose::trusted(Eigen::Quaterniond::Identity(), {0.1, 0, 0});
  const std::vector<EdgeAtEnds> path{moving(start, further, own)};
  const Matrix6d sigma = mean_velocity(path, 0.1).covariance.matrix();
  CHECK((sigma - 4 * own.matrix() / 0.01).norm() < 1e-9 * sigma.norm());
  const Gaussian gaussian{Eigen::MatrixXd(own.matrix())};
  const Matrix6d S = sampled(path, 0.1, [&]() -> std::vector<Errors> {
    const Twist xi = gaussian(random);
    return {{xi, -xi}};
  });
  CHECK(testing::moment_diff(S, sigma, kSamples, 0.01) == "");
}

// e0 = s and m = -s; the velocity is that of e1 + m - e0 - m, and e1 may be -s.
TEST_CASE("mean velocity: what an observation has left of one end may be that of the other") {
  const auto along = [](double size) {
    Loading F = Loading::Zero(6, 1);
    F(0, 0) = size;
    return std::vector<CommonError>{{"observed:1", false, F}};
  };
  for (const bool first : {true, false}) {
    Belief seen;
    seen.common_errors = along(1);
    Belief alone;
    alone.own = *Covariance::from_stddev({1, 0, 0, 0, 0, 0});
    Belief mount;
    mount.common_errors = along(-1);
    const MeanVelocity velocity =
        mean_velocity({{first ? seen : alone, first ? alone : seen, Way::kDown, false, false},
                       {mount, mount, Way::kDown, true, false}},
                      1);
    CHECK(velocity.bound);
    CHECK(velocity.covariance.upper()[0] > 4 - 1e-9);
  }
}

TEST_CASE("mean velocity: the error of an edge that drifts goes on, and grows") {
  Random random(706);
  INFO("seed " << random.seed());
  const Pose X0 = swing(0.2);
  const Pose X1 = swing(0.5);
  const Matrix6d carry = adjoint(X1.inverse() * X0);
  const Loading loading = 1e-3 * Loading::Random(6, 2);
  const Covariance own = random.covariance(1e-3, 1e-3);
  const Covariance walk = random.covariance(1e-4, 1e-4);
  EdgeAtEnds drifting = moving(X0, X1);
  drifting.drifts = true;
  drifting.before.own = own;
  drifting.after.own =
      Covariance::trusted(Matrix6d(carry * own.matrix() * carry.transpose() + walk.matrix()));
  drifting.before.common_errors = {{"map", false, loading}};
  drifting.after.common_errors = {{"map", false, carry * loading}};
  std::vector<EdgeAtEnds> path{fixed({random.pose(), {}}, Way::kUp), drifting};
  const MeanVelocity velocity = mean_velocity(path, 0.3);
  CHECK_FALSE(velocity.bound);
  const Gaussian of_own{Eigen::MatrixXd(own.matrix())};
  const Gaussian of_walk{Eigen::MatrixXd(walk.matrix())};
  const Matrix6d S = sampled(path, 0.3, [&]() -> std::vector<Errors> {
    const Eigen::Vector2d source(random.normal(), random.normal());
    const Twist before = of_own(random) + loading * source;
    return {{Twist::Zero(), Twist::Zero()}, {before, carry * before + of_walk(random)}};
  });
  const Matrix6d sigma = velocity.covariance.matrix();
  CHECK(testing::moment_diff(S, sigma, kSamples, 0.01) == "");
  CHECK(testing::moment_diff(S, Matrix6d(1.2 * sigma), kSamples, 0.01) != "");
  // An observation that has corrected the later value alone leaves nothing but a bound.
  path[1].after.common_errors.push_back({"observed:1", true, 1e-4 * Loading::Random(6, 2)});
  CHECK(mean_velocity(path, 0.3).bound);
  path[1] = drifting;
  path[1].after.own = {};
  CHECK(mean_velocity(path, 0.3).bound);
}

TEST_CASE("mean velocity: shared sources and unknown correlation are covered, too") {
  Random random(705);
  INFO("seed " << random.seed());
  const Loading loading = 1e-4 * Loading::Random(6, 2);
  EdgeAtEnds still = fixed({random.pose(), {}});
  EdgeAtEnds turning = moving(swing(0.2), swing(0.3));
  EdgeAtEnds vague = moving(swing(1.2), swing(1.1), {}, Way::kUp);
  for (EdgeAtEnds* edge : {&still, &turning}) {
    edge->before.common_errors = edge->after.common_errors = {{"supply", false, loading}};
  }
  vague.before.unknown = vague.after.unknown = random.covariance(1e-4, 1e-4);
  const std::vector<EdgeAtEnds> path{still, turning, vague};
  const MeanVelocity velocity = mean_velocity(path, 0.1);
  CHECK(velocity.bound);
  CHECK(velocity.sources == std::vector<std::string>{"supply"});
  const Gaussian of_vague{Eigen::MatrixXd(vague.before.unknown->matrix())};
  for (const double sign : {-1.0, 1.0}) {
    const Matrix6d S = sampled(path, 0.1, [&]() -> std::vector<Errors> {
      const Eigen::Vector2d source(random.normal(), random.normal());
      const Twist supply = loading * source;
      const Twist xi = of_vague(random);
      return {{supply, supply}, {supply, sign * supply}, {xi, -sign * xi}};
    });
    // The sampled second moment has the rank of the sources.
    const Matrix6d spare = 1e-6 * velocity.covariance.matrix().trace() * Matrix6d::Identity();
    CHECK(testing::domination(velocity.covariance.matrix() + spare, S) > -0.03);
  }
  // A source of static edges only is common to both ends.
  EdgeAtEnds still_too = still;
  const MeanVelocity common =
      mean_velocity({still, moving(swing(0.2), swing(0.3)), still_too}, 0.1);
  CHECK_FALSE(common.bound);
  const Matrix6d S = sampled(
      {still, moving(swing(0.2), swing(0.3)), still_too}, 0.1, [&]() -> std::vector<Errors> {
        const Eigen::Vector2d source(random.normal(), random.normal());
        const Twist supply = loading * source;
        return {{supply, supply}, {Twist::Zero(), Twist::Zero()}, {supply, supply}};
      });
  CHECK(testing::moment_diff(S, common.covariance.matrix(), kSamples, 0.01) == "");
}

}  // namespace
}  // namespace tfdude
