// Transforms whose covariance is unspecified, for some or all of their edges.

#include <vector>

#include "tfdude/math/belief.hpp"
#include "tfdude/math/fusion.hpp"
#include "tfdude/math/interpolate.hpp"
#include "tfdude/math/joint.hpp"
#include "tfdude/math/observation.hpp"
#include "tfdude/math/perturbation.hpp"

#include "support/catch.hpp"
#include "support/observed_chain.hpp"
#include "support/pose_diff.hpp"
#include "support/random.hpp"
#include "support/sampling.hpp"

namespace tfdude {
namespace {

using testing::ContainsSubstring;
using testing::covariance_diff;
using testing::pose_diff;
using testing::Random;
using testing::transform_diff;

constexpr auto kDown = ObservedEdge::Way::kDown;
constexpr auto kUp = ObservedEdge::Way::kUp;
const std::string kSource = "observed:once";

Transform unspecified(const Pose& X) { return {X, StatedCovariance::unspecified()}; }

Transform exact(const Pose& X) { return {X, Covariance()}; }

// The same transform, of which a part is left out.
Transform incomplete(Transform X) {
  X.covariance.set_complete(false);
  return X;
}

ObservedEdge edge_of(const Transform& X, ObservedEdge::Way way) {
  return {{X.pose, X.covariance.of_specified(), std::nullopt, {}, !X.covariance.complete()}, way};
}

TEST_CASE("a covariance that is not complete gives none where all of it is needed") {
  const StatedCovariance nothing = StatedCovariance::unspecified();
  CHECK_FALSE(nothing.complete());
  CHECK(nothing.if_complete() == nullptr);
  CHECK(nothing.of_specified().upper() == Covariance::Upper{});
  const StatedCovariance zero = Covariance();
  CHECK(zero.complete());
  REQUIRE(zero.if_complete() != nullptr);
  CHECK(zero != nothing);
  CHECK_FALSE((zero + nothing).complete());
  CHECK_FALSE((nothing + zero).complete());
  CHECK_FALSE(nothing.transported(Pose()).complete());
  CHECK((zero + zero).complete());
}

TEST_CASE("a product with an unspecified transform has the covariance of the other one") {
  Random random(811);
  INFO("seed " << random.seed());
  for (int i = 0; i < 20; ++i) {
    const Transform X = random.transform();
    const Transform U = unspecified(random.pose());
    const Transform as_if = exact(U.pose);
    CHECK(transform_diff(compose(X, U), incomplete(compose(X, as_if)), 1e-14) == "");
    CHECK(transform_diff(compose(U, X), incomplete(compose(as_if, X)), 1e-14) == "");
    CHECK(transform_diff(between(U, X), incomplete(between(as_if, X)), 1e-14) == "");
    CHECK_FALSE(inverse(U).covariance.complete());
    CHECK_FALSE(left_covariance(U).complete());
    CHECK_FALSE(ros_covariance(U).complete());
    CHECK(compose(X, as_if).covariance.complete());
    for (const Order order : {Order::kSecond, Order::kFourth}) {
      const Belief a{X.pose, X.covariance.of_specified(), std::nullopt, {}};
      const Belief b{U.pose, {}, std::nullopt, {}, true};
      const Belief b_as_if{U.pose, {}, std::nullopt, {}};
      CHECK(transform_diff(collapse(inverse(compose(a, b, order))),
                           incomplete(collapse(inverse(compose(a, b_as_if, order)))), 1e-14) == "");
    }
  }
}

TEST_CASE("between two samples of which one is unspecified nothing is claimed") {
  Random random(812);
  INFO("seed " << random.seed());
  for (const double angle : {0.01, 1.0}) {  // by the kernel's series, and by closed forms
    const Transform X0 = random.transform();
    const Transform X1{X0.pose * exp(random.twist(angle, 0.1)), random.covariance()};
    for (const double s : {0.25, 1.5}) {
      const auto at = [&](const Transform& a, const Transform& b) {
        return s < 1 ? interpolate(a, b, s) : extrapolate(a, b, s);
      };
      const Transform expected = unspecified(at(X0, X1).pose);
      CHECK(transform_diff(at(unspecified(X0.pose), X1), expected, 1e-12) == "");
      CHECK(transform_diff(at(X0, unspecified(X1.pose)), expected, 1e-12) == "");
      CHECK(transform_diff(at(unspecified(X0.pose), unspecified(X1.pose)), expected, 1e-12) == "");
      CHECK(at(X0, X1).covariance.complete());
    }
  }
}

TEST_CASE("a joint whose origin is unspecified moves an unspecified edge") {
  const Joint joint = revolute_joint(unspecified(Pose()), Eigen::Vector3d::UnitZ());
  CHECK(joint_transform(joint, 0.5, 0.01).covariance == StatedCovariance::unspecified());
}

TEST_CASE("unspecified estimates and measurements are rejected") {
  const Transform known{Pose(), *Covariance::from_stddev({1, 1, 1, 1, 1, 1})};
  const auto fused = fuse({known, unspecified(Pose())});
  REQUIRE_FALSE(fused);
  CHECK_THAT(fused.error().message, ContainsSubstring("estimate 1 is unspecified"));
  CHECK_FALSE(intersect(unspecified(Pose()), known));
  const auto observed = observe({edge_of(known, kDown)}, unspecified(Pose()), kSource);
  REQUIRE_FALSE(observed);
  CHECK_THAT(observed.error().message, ContainsSubstring("measurement is unspecified"));
}

TEST_CASE("an unspecified edge takes what the measurement says") {
  Random random(813);
  INFO("seed " << random.seed());
  for (const auto way : {kDown, kUp}) {
    const Transform before = exact(random.pose());
    const Transform U = unspecified(random.pose());
    const Transform after = exact(random.pose());
    const Transform Z = random.transform();
    const auto found =
        observe({edge_of(before, kDown), edge_of(U, way), edge_of(after, kDown)}, Z, kSource);
    REQUIRE(found);
    CHECK(found->accepted);
    CHECK(found->dimensions == 0);
    CHECK(found->distance_squared == 0);
    CHECK_FALSE(found->edges[0].corrected);
    CHECK_FALSE(found->edges[2].corrected);
    REQUIRE(found->edges[1].corrected);
    const Transform X = collapse(found->edges[1].X_PC);
    const Transform path = compose(compose(before, way == kUp ? inverse(X) : X), after);
    CHECK(path.covariance.complete());
    CHECK(transform_diff(path, Z, 1e-9) == "");
  }
}

TEST_CASE("an unspecified edge between uncertain ones agrees with a filter without prior") {
  Random random(814);
  INFO("seed " << random.seed());
  const Transform a = random.transform(1.0, 0.05, 0.02);
  const Transform b = random.transform(1.0, 0.05, 0.02);
  const Transform U = unspecified(random.pose());
  const Transform Z{random.pose(), random.covariance(0.01, 0.01)};
  const auto found = observe({edge_of(a, kDown), edge_of(U, kDown), edge_of(b, kUp)}, Z, kSource);
  REQUIRE(found);
  // The other edges are as before: one path between them tells nothing of them.
  CHECK(transform_diff(collapse(found->edges[0].X_PC), a, 1e-9, 1e-5) == "");
  CHECK(transform_diff(collapse(found->edges[2].X_PC), b, 1e-9, 1e-5) == "");
  // The path is as certain as the measurement, and the edge is as uncertain as all three together.
  const Belief path = compose(compose(found->edges[0].X_PC, found->edges[1].X_PC, Order::kSecond),
                              inverse(found->edges[2].X_PC), Order::kSecond);
  CHECK(transform_diff(collapse(path), Z, 1e-9, 1e-4) == "");
  const Transform of_all = compose(compose(inverse(a), Z), b);
  CHECK(transform_diff(collapse(found->edges[1].X_PC), of_all, 1e-9, 1e-4) == "");
}

TEST_CASE("an unspecified edge is of unknown correlation if the measurement is") {
  Random random(815);
  const Transform a = random.transform(1.0, 0.05, 0.02);
  const Transform Z = random.transform(1.0, 0.01, 0.01);
  const auto found = observe({edge_of(a, kDown), edge_of(unspecified(random.pose()), kDown)}, Z,
                             kSource, {0.999, false});
  REQUIRE(found);
  CHECK_FALSE(found->edges[0].corrected);
  const Belief& X = found->edges[1].X_PC;
  REQUIRE(X.unknown);
  const Belief path = compose(found->edges[0].X_PC, X, Order::kSecond);
  CHECK(pose_diff(path.pose, Z.pose, 1e-9) == "");
  CHECK(testing::domination(collapse(path).covariance.of_specified().matrix(),
                            Z.covariance.of_specified().matrix()) > -1e-9);
}

TEST_CASE("of two unspecified edges none can be corrected") {
  const ObservedEdge edge = edge_of(unspecified(Pose()), kDown);
  const auto found =
      observe({edge, edge}, {Pose(), *Covariance::from_stddev({1, 1, 1, 1, 1, 1})}, kSource);
  REQUIRE_FALSE(found);
  CHECK(found.error().code == Errc::kInvalidInput);
  CHECK_THAT(found.error().message,
             ContainsSubstring("the covariance of 2 edges of the path is unspecified"));
}

}  // namespace
}  // namespace tfdude
