#include "math/kernel.hpp"

#include <cmath>
#include <vector>

#include "math/columns.hpp"
#include "support/catch.hpp"
#include "support/pose_diff.hpp"
#include "support/random.hpp"

namespace tfdude {
namespace {

using testing::covariance_diff;
using testing::pose_diff;
using testing::Random;

constexpr double kPi = 3.14159265358979323846;

TEST_CASE("the portable kernel and that of this processor accumulate alike") {
  Random random(250);
  INFO("seed " << random.seed());
  std::vector<Transform> path;
  std::vector<kernel::Edge> edges;
  path.reserve(50);
  for (int i = 0; i < 50; ++i) {
    edges.push_back(kernel::edge_of(path.emplace_back(random.transform())));
  }
  const auto accumulated = [&](const kernel::Functions& functions) {
    kernel::Climb a;
    kernel::Climb b;
    functions.climb_with_covariance(a, {&edges[0], 10});
    functions.climb_with_covariance(b, {&edges[10], 10});
    functions.climb_with_covariance(b, {&edges[20], 10});
    Transform X_AB;
    functions.join_with_covariance(a, {&edges[30], 10}, b, {&edges[40], 10},
                                   kernel::numbers_of(X_AB));
    return X_AB;
  };
  const Transform here = accumulated(kernel::functions());
  const Transform portable = accumulated(kernel::kPortable);
  CHECK(pose_diff(here.pose, portable.pose, 1e-12) == "");
  CHECK(covariance_diff(here.covariance.of_specified(), portable.covariance.of_specified(),
                        1e-12) == "");
}

TEST_CASE("the portable kernel and that of this processor transport alike") {
  Random random(252);
  INFO("seed " << random.seed());
  for (int i = 0; i < 100; ++i) {
    const Pose X = random.pose();
    const Covariance sigma = random.covariance();
    const auto transported = [&](const kernel::Functions& functions) {
      Covariance::Upper upper{};
      functions.transport(kernel::columns_of(X), sigma.upper().data(), upper.data());
      return Covariance::trusted(upper);
    };
    const Covariance here = transported(kernel::functions());
    CHECK(covariance_diff(here, transported(kernel::kPortable), 1e-13) == "");
    const Matrix6d Ad = adjoint(X);
    CHECK(covariance_diff(here, Covariance::trusted(Matrix6d(Ad * sigma.matrix() * Ad.transpose())),
                          1e-13) == "");
  }
}

TEST_CASE("the portable kernel and that of this processor add columns alike") {
  Random random(253);
  INFO("seed " << random.seed());
  for (int i = 0; i < 100; ++i) {
    const Pose X = random.pose();
    const Loading F = Loading::Random(6, i % 7);
    const Loading before = Loading::Random(6, i % 7);
    for (const auto* functions : {&kernel::functions(), &kernel::kPortable}) {
      Loading sum = before;
      functions->add_columns(kernel::columns_of(X), F.data(), static_cast<std::size_t>(F.cols()),
                             sum.data());
      CHECK((sum - before - adjoint(X) * F).norm() < 1e-12);
    }
  }
}

TEST_CASE("the portable kernel and that of this processor interpolate alike") {
  Random random(251);
  INFO("seed " << random.seed());
  for (int i = 0; i < 100; ++i) {
    const Transform X0 = random.transform();
    const Transform X1{X0.pose * exp(random.twist(random.uniform(0, 0.12), 0.3)),
                       i % 2 == 0 ? X0.covariance : random.covariance()};
    const auto blended = [&](const kernel::Functions& functions, Transform& X) {
      kernel::Edge edge{};
      kernel::Blend one{kernel::edge_of(X0), kernel::edge_of(X1), 0.01 * i, kernel::numbers_of(X),
                        &edge};
      kernel::Blend* const all[] = {&one};
      functions.blend_with_covariance(all, 1);
      if (one.near) X = kernel::transform_of(edge);
      return one.near;
    };
    Transform here;
    Transform portable;
    REQUIRE(blended(kernel::functions(), here) == blended(kernel::kPortable, portable));
    CHECK(pose_diff(here.pose, portable.pose, 1e-13) == "");
    CHECK(covariance_diff(here.covariance, portable.covariance, 1e-12) == "");
  }
}

TEST_CASE("a pose that passes the kernel is the same") {
  Random random(251);
  INFO("seed " << random.seed());
  for (int i = 0; i < 100; ++i) {
    // Also half turns about each axis, whose quaternion has no real part.
    const Pose X = i < 3 ? exp(Twist(Twist::Unit(3 + i) * kPi)) : random.pose();
    const kernel::Edge edge = kernel::edge_of(X);
    Pose up;
    Pose down;
    kernel::functions().join({}, {}, {}, {&edge, 1}, kernel::numbers_of(up));
    kernel::functions().join({}, {&edge, 1}, {}, {}, kernel::numbers_of(down));
    CHECK(pose_diff(up, X, 1e-14) == "");
    CHECK(pose_diff(down, X.inverse(), 1e-14) == "");
  }
}

}  // namespace
}  // namespace tfdude
