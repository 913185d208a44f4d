#include "tfdude/math/transform.hpp"

#include <type_traits>
#include <vector>

#include "math/path_accumulation.hpp"
#include "support/catch.hpp"
#include "support/jacobian.hpp"
#include "support/pose_diff.hpp"
#include "support/random.hpp"
#include "support/sampling.hpp"

namespace tfdude {
namespace {

using testing::covariance_diff;
using testing::eigenvalues;
using testing::kRounding;
using testing::numeric_jacobian;
using testing::pose_diff;
using testing::Random;
using testing::transform_diff;

constexpr double kPi = 3.14159265358979323846;

static_assert(std::is_trivially_copyable_v<Transform>);
static_assert(sizeof(Transform) == 29 * sizeof(double));

Matrix6d propagated(const Matrix6d& jacobian, const StatedCovariance& sigma) {
  return jacobian * sigma.of_specified().matrix() * jacobian.transpose();
}

// Poses whose Jacobians differ in kind: identity, tiny, half turns, anything.
std::vector<Pose> poses(Random& random) {
  std::vector<Pose> all{Pose()};
  for (const double angle : {0.0, 1e-8, kPi - 1e-9, kPi}) all.push_back(exp(random.twist(angle)));
  for (int i = 0; i < 5; ++i) all.push_back(random.pose());
  return all;
}

// ---- against numeric Jacobians

TEST_CASE("compose propagates by the Jacobians of the product") {
  Random random(201);
  INFO("seed " << random.seed());
  for (const Pose& X_AB : poses(random)) {
    for (const Pose& X_BC : poses(random)) {
      const Matrix6d J_AB =
          numeric_jacobian([&](const Twist& xi) { return X_AB * exp(xi) * X_BC; });
      const Matrix6d J_BC =
          numeric_jacobian([&](const Twist& xi) { return X_AB * X_BC * exp(xi); });
      CHECK((J_AB - adjoint(X_BC.inverse())).norm() < 1e-10);
      CHECK((J_BC - Matrix6d::Identity()).norm() < 1e-10);
      const Covariance sigma_AB = random.covariance();
      const Covariance sigma_BC = random.covariance();
      const Matrix6d sigma = propagated(J_AB, sigma_AB) + propagated(J_BC, sigma_BC);
      const Transform X_AC = compose({X_AB, sigma_AB}, {X_BC, sigma_BC});
      CHECK(transform_diff(X_AC, {X_AB * X_BC, Covariance::trusted(sigma)}, 1e-14, 1e-9) == "");
    }
  }
}

TEST_CASE("inverse propagates by the Jacobian of the inverse") {
  Random random(202);
  INFO("seed " << random.seed());
  for (const Pose& X_AB : poses(random)) {
    const Matrix6d J =
        numeric_jacobian([&](const Twist& xi) { return (X_AB * exp(xi)).inverse(); });
    CHECK((J + adjoint(X_AB)).norm() < 1e-10);
    const Covariance sigma_AB = random.covariance();
    const Covariance sigma_BA = Covariance::trusted(propagated(J, sigma_AB));
    CHECK(transform_diff(inverse(Transform{X_AB, sigma_AB}), {X_AB.inverse(), sigma_BA}, 1e-15,
                         1e-9) == "");
  }
}

TEST_CASE("between propagates by the Jacobians of the difference") {
  Random random(203);
  INFO("seed " << random.seed());
  for (const Pose& X_WA : poses(random)) {
    for (const Pose& X_WB : poses(random)) {
      const Matrix6d J_WA =
          numeric_jacobian([&](const Twist& xi) { return (X_WA * exp(xi)).inverse() * X_WB; });
      const Covariance sigma_WA = random.covariance();
      const Covariance sigma_WB = random.covariance();
      const Matrix6d sigma = propagated(J_WA, sigma_WA) + sigma_WB.matrix();
      const Transform expected{X_WA.inverse() * X_WB, Covariance::trusted(sigma)};
      CHECK(transform_diff(between({X_WA, sigma_WA}, {X_WB, sigma_WB}), expected, 1e-14, 1e-9) ==
            "");
    }
  }
}

// ---- against dense formulas

TEST_CASE("compose and inverse and between equal the dense formulas") {
  Random random(211);
  INFO("seed " << random.seed());
  for (int i = 0; i < 100; ++i) {
    const Transform a = random.transform(5.0, 0.1, 0.02);
    const Transform b = random.transform(5.0, 0.01, 0.1);
    const Matrix6d to_b = adjoint(b.pose.inverse());
    const Matrix6d composed = propagated(to_b, a.covariance) + b.covariance.of_specified().matrix();
    CHECK(transform_diff(compose(a, b), {a.pose * b.pose, Covariance::trusted(composed)}, 1e-14) ==
          "");
    const Matrix6d inverted = propagated(adjoint(a.pose), a.covariance);
    CHECK(transform_diff(inverse(a), {a.pose.inverse(), Covariance::trusted(inverted)}, 1e-14) ==
          "");
    const Matrix6d to_b_from_a = adjoint(b.pose.inverse() * a.pose);
    const Matrix6d both =
        propagated(to_b_from_a, a.covariance) + b.covariance.of_specified().matrix();
    const Transform expected{a.pose.inverse() * b.pose, Covariance::trusted(both)};
    CHECK(transform_diff(between(a, b), expected, 1e-14, 1e-12) == "");
  }
}

TEST_CASE("exact transforms stay exact") {
  Random random(212);
  INFO("seed " << random.seed());
  const Transform a = Transform::exact(random.pose());
  const Transform b = Transform::exact(random.pose());
  CHECK(compose(a, b).covariance.of_specified().matrix() == Matrix6d::Zero());
  CHECK(inverse(a).covariance.of_specified().matrix() == Matrix6d::Zero());
  CHECK(between(a, b).covariance.of_specified().matrix() == Matrix6d::Zero());
}

// ---- laws

TEST_CASE("compose is associative with its covariance") {
  Random random(221);
  INFO("seed " << random.seed());
  for (int i = 0; i < 100; ++i) {
    const Transform a = random.transform();
    const Transform b = random.transform();
    const Transform c = random.transform();
    CHECK(transform_diff(compose(compose(a, b), c), compose(a, compose(b, c)), 1e-13) == "");
  }
}

TEST_CASE("the identity is neutral") {
  Random random(222);
  INFO("seed " << random.seed());
  const Transform a = random.transform();
  CHECK(transform_diff(compose(a, Transform::exact({})), a, 1e-15) == "");
  CHECK(transform_diff(compose(Transform::exact({}), a), a, 1e-15) == "");
}

TEST_CASE("inverse is its own inverse") {
  Random random(223);
  INFO("seed " << random.seed());
  for (int i = 0; i < 100; ++i) {
    const Transform a = random.transform();
    CHECK(transform_diff(inverse(inverse(a)), a, 1e-14, 1e-13) == "");
  }
}

TEST_CASE("the inverse of a product is the product of the inverses") {
  Random random(224);
  INFO("seed " << random.seed());
  for (int i = 0; i < 100; ++i) {
    const Transform a = random.transform();
    const Transform b = random.transform();
    CHECK(transform_diff(inverse(compose(a, b)), compose(inverse(b), inverse(a)), 1e-13) == "");
  }
}

TEST_CASE("between a transform and itself is the identity with twice the error") {
  // Two independent measurements that happen to agree, not one measurement used twice.
  Random random(225);
  INFO("seed " << random.seed());
  for (int i = 0; i < 100; ++i) {
    const Transform a = random.transform();
    CHECK(transform_diff(between(a, a), {Pose(), a.covariance + a.covariance}, 1e-14, 1e-12) == "");
  }
}

// ---- PathAccumulation and join

struct Path {
  std::vector<Transform> edges;  // from the start upwards, each X_PC
};

Path random_path(Random& random, std::size_t depth) {
  Path path;
  for (std::size_t i = 0; i < depth; ++i) path.edges.push_back(random.transform());
  return path;
}

PathAccumulation<Transform> accumulated(const Path& path) {
  PathAccumulation<Transform> sum;
  for (const Transform& X_PC : path.edges) sum.up(X_PC);
  return sum;
}

// Up from A edge by edge and down to B, with compose and inverse only.
Transform walked(const Path& from_a, const Path& from_b) {
  Transform X_AH = Transform::exact({});
  for (const Transform& X_PC : from_a.edges) X_AH = compose(X_AH, inverse(X_PC));
  Transform X_HB = Transform::exact({});
  for (const Transform& X_PC : from_b.edges) X_HB = compose(X_PC, X_HB);
  return compose(X_AH, X_HB);
}

TEST_CASE("join equals compose over every path up and down") {
  Random random(231);
  INFO("seed " << random.seed());
  for (std::size_t up = 0; up <= 10; ++up) {
    for (std::size_t down = 0; down <= 10; ++down) {
      CAPTURE(up, down);
      const Path a = random_path(random, up);
      const Path b = random_path(random, down);
      const Transform X_AB = join(accumulated(a), accumulated(b));
      CHECK(transform_diff(X_AB, walked(a, b), 1e-13, 1e-11) == "");
      // Asked the other way round the answer is the inverse.
      CHECK(transform_diff(join(accumulated(b), accumulated(a)), inverse(X_AB), 1e-13, 1e-11) ==
            "");
    }
  }
}

TEST_CASE("poses accumulate to the pose of the accumulated transforms") {
  Random random(232);
  INFO("seed " << random.seed());
  const Path a = random_path(random, 20);
  const Path b = random_path(random, 40);
  const auto poses = [](const Path& path) {
    PathAccumulation<Pose> sum;
    for (const Transform& X_PC : path.edges) sum.up(X_PC.pose);
    return sum;
  };
  CHECK(pose_diff(join(poses(a), poses(b)), join(accumulated(a), accumulated(b)).pose, kRounding) ==
        "");
  CHECK(pose_diff(join(PathAccumulation<Pose>(), PathAccumulation<Pose>()), Pose(), 0.0) == "");
}

TEST_CASE("a join of empty paths is the identity known exactly") {
  CHECK(transform_diff(join(PathAccumulation<Transform>(), PathAccumulation<Transform>()),
                       Transform::exact({}), 0.0) == "");
}

// ---- long chains

double relative_smallest_eigenvalue(const StatedCovariance& sigma) {
  const Eigen::VectorXd values = eigenvalues(sigma.of_specified().matrix());
  return values[0] / values[5];
}

TEST_CASE("a chain of 1000 edges stays symmetric and positive semi-definite") {
  Random random(241);
  INFO("seed " << random.seed());
  // Errors in all axes, and in one axis only: there the smallest eigenvalues are zero but for
  // rounding.
  const bool singular = GENERATE(false, true);
  CAPTURE(singular);
  const auto one_axis = Covariance::from_stddev({0, 0, 0, 0, 0, 1e-3});
  REQUIRE(one_axis);
  Path path = random_path(random, 1000);
  if (singular) {
    for (Transform& edge : path.edges) edge.covariance = Covariance();
    path.edges[0].covariance = path.edges[999].covariance = *one_axis;
  }
  Transform X_RS = Transform::exact({});
  for (const Transform& X_PC : path.edges) X_RS = compose(X_PC, X_RS);
  const Transform X_SR = join(accumulated(path), PathAccumulation<Transform>());
  for (const Transform& X : {X_RS, X_SR}) {
    CHECK(X.covariance.of_specified().matrix() == X.covariance.of_specified().matrix().transpose());
    CHECK(relative_smallest_eigenvalue(X.covariance) >= -1e-12);
    CHECK(std::abs(X.pose.rotation().norm() - 1.0) < 1e-15);
  }
  CHECK(transform_diff(join(PathAccumulation<Transform>(), accumulated(path)), X_RS, 1e-10, 1e-9) ==
        "");
}

// ---- back in again

// Errors along some axes only, and mounts at right angles: as robots are built, and as rounding
// leaves variances of 1e-33 where zero was meant.
Transform planar_edge(Random& random, bool right_angles) {
  const auto quarter = [&] { return kPi / 2 * static_cast<double>(random.index(4)); };
  const Pose X = right_angles
                     ? Pose::trusted(from_rpy(quarter(), quarter(), quarter()).normalized(),
                                     random.vector(2.0))
                     : random.pose();
  std::array<double, 6> stddev{};
  if (random.index(2) == 0) {
    stddev[random.index(6)] = 0.01;
  } else {
    stddev[0] = stddev[1] = stddev[5] = 0.01;
  }
  return {X, Covariance::from_stddev(stddev).value()};
}

TEST_CASE("every result is accepted as an input") {
  // Answers travel and become edges elsewhere: the checks at the door must not reject them.
  Random random(251);
  INFO("seed " << random.seed());
  const bool right_angles = GENERATE(true, false);
  CAPTURE(right_angles);
  for (int i = 0; i < 2000; ++i) {
    Transform X = planar_edge(random, right_angles);
    for (std::size_t depth = random.index(6); depth > 0; --depth) {
      const Transform edge = planar_edge(random, right_angles);
      X = random.index(2) == 0 ? compose(X, edge) : between(edge, X);
    }
    const auto again = Covariance::from_upper(X.covariance.of_specified().upper());
    if (!again)
      FAIL(again.error().message << "\n" << testing::describe(X.covariance.of_specified()));
    if (covariance_diff(*again, X.covariance, 1e-12) != "") {
      FAIL(covariance_diff(*again, X.covariance, 1e-12));
    }
  }
  SUCCEED();
}

}  // namespace
}  // namespace tfdude
