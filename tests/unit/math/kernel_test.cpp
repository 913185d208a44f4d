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

TEST_CASE("the portable kernel and that of this processor accumulate alike") {
  Random random(250);
  INFO("seed " << random.seed());
  std::vector<Transform> path;
  std::vector<kernel::Edge> edges;
  path.reserve(50);
  for (int i = 0; i < 50; ++i) {
    edges.push_back(reinterpret_cast<kernel::Edge>(&path.emplace_back(random.transform())));
  }
  const auto accumulated = [&](const kernel::Functions& functions) {
    kernel::Columns X_SH;
    kernel::Blocks sum;
    functions.accumulate_with_covariance(X_SH, sum, edges.data(), edges.size());
    functions.add_transported(functions.quotient(X_SH, kernel::Columns()),
                              path[0].covariance.of_specified().upper().data(), sum);
    return Transform{kernel::pose_of(X_SH), Covariance::trusted(kernel::upper_of(sum))};
  };
  const Transform here = accumulated(kernel::functions());
  const Transform portable = accumulated(kernel::kPortable);
  CHECK(pose_diff(here.pose, portable.pose, 1e-12) == "");
  CHECK(covariance_diff(here.covariance, portable.covariance, 1e-12) == "");
}

TEST_CASE("the portable kernel and that of this processor interpolate alike") {
  Random random(251);
  INFO("seed " << random.seed());
  for (int i = 0; i < 100; ++i) {
    const Transform X0 = random.transform();
    const Transform X1{X0.pose * exp(random.twist(random.uniform(0, 0.12), 0.3)),
                       i % 2 == 0 ? X0.covariance : random.covariance()};
    const auto blended = [&](const kernel::Functions& functions, Transform& X) {
      const auto numbers = [](auto& value) { return reinterpret_cast<const double*>(&value); };
      kernel::Blend one{numbers(X0),
                        numbers(X1),
                        numbers(X0.covariance),
                        numbers(X1.covariance),
                        0.01 * i,
                        reinterpret_cast<double*>(&X)};
      functions.blend_with_covariance(&one, 1);
      return one.near;
    };
    Transform here;
    Transform portable;
    REQUIRE(blended(kernel::functions(), here) == blended(kernel::kPortable, portable));
    CHECK(pose_diff(here.pose, portable.pose, 1e-13) == "");
    CHECK(covariance_diff(here.covariance, portable.covariance, 1e-12) == "");
  }
}

TEST_CASE("columns preserve the pose") {
  Random random(251);
  INFO("seed " << random.seed());
  for (int i = 0; i < 100; ++i) {
    const Pose X = random.pose();
    CHECK(pose_diff(kernel::pose_of(kernel::columns_of(X)), X, 1e-14) == "");
  }
}

}  // namespace
}  // namespace tfdude
