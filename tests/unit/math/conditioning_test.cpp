// Observations whose numbers lie far apart: long levers, exact axes, great and small deviations.

#include <algorithm>
#include <cmath>

#include <Eigen/LU>

#include "tfdude/math/fusion.hpp"
#include "tfdude/math/observation.hpp"
#include "tfdude/math/point.hpp"

#include "support/catch.hpp"
#include "support/pose_diff.hpp"
#include "support/random.hpp"
#include "support/sampling.hpp"

namespace tfdude {
namespace {

using testing::Gaussian;
using testing::Random;
using Matrix6r = Eigen::Matrix<long double, 6, 6>;

constexpr auto kDown = ObservedEdge::Way::kDown;
const std::string kSource = "observed:once";

ObservedEdge edge_of(const Transform& X) {
  return {{X.pose, X.covariance.of_specified(), std::nullopt, {}, !X.covariance.complete()}, kDown};
}

Covariance of_deviations(const Twist& sigma) {
  return Covariance::trusted(Matrix6d(sigma.cwiseAbs2().asDiagonal()));
}

Twist deviations(double metres, double radians) {
  Twist sigma;
  sigma << Eigen::Vector3d::Constant(metres), Eigen::Vector3d::Constant(radians);
  return sigma;
}

Covariance isotropic(double metres, double radians) {
  return of_deviations(deviations(metres, radians));
}

Covariance planar(double metres, double radians) {
  Twist sigma = Twist::Zero();
  sigma.head<2>().setConstant(metres);
  sigma[5] = radians;
  return of_deviations(sigma);
}

Matrix6r path_before(const std::vector<ObservedEdge>& edges) {
  Matrix6r sum = Matrix6r::Zero();
  Pose X_CB;
  for (auto edge = edges.rbegin(); edge != edges.rend(); ++edge) {
    const Matrix6r H = adjoint(X_CB.inverse()).cast<long double>();
    sum += H * edge->X_PC.own.matrix().cast<long double>() * H.transpose();
    X_CB = edge->X_PC.pose * X_CB;
  }
  return sum;
}

// (S⁻¹ + R⁻¹)⁻¹ with 64 bits of mantissa, each axis scaled.
Matrix6d after(const Matrix6r& S, const Matrix6d& R) {
  const Matrix6r noise = R.cast<long double>();
  const Eigen::Matrix<long double, 6, 1> unit = (S + noise).diagonal().cwiseSqrt().cwiseInverse();
  const Matrix6r scaled = unit.asDiagonal() * (S + noise) * unit.asDiagonal();
  const Matrix6r inverse = unit.asDiagonal() * Matrix6r(scaled.inverse()) * unit.asDiagonal();
  return (noise - noise * inverse * noise).cast<double>();
}

Matrix6d observed_path(const Observation& observed) {
  Belief X;
  for (const ObservedResult& edge : observed.edges) X = compose(X, edge.X_PC, Order::kSecond);
  const Transform path = collapse(X);
  CHECK(path.covariance.complete());
  return path.covariance.of_specified().matrix();
}

// How far claimed variances are from the right ones, along the worst direction.
double worst_ratio(const Matrix6d& claimed, const Matrix6d& right) {
  const Matrix6d W = testing::inverse_of(testing::cholesky_root(right));
  const Eigen::VectorXd values = testing::eigenvalues(W * claimed * W.transpose());
  return std::max(values[5], 1.0 / values[0]);
}

TEST_CASE("conditioning: an observed path over a lever of up to 7000 km has its covariance") {
  Random random(901);
  INFO("seed " << random.seed());
  const double lever = GENERATE(1.0, 100.0, 1e4, 1e5, 1e6, 7e6);
  const double radians = GENERATE(1e-3, 0.05);
  CAPTURE(lever, radians);
  const Covariance R = isotropic(0.02, 0.001);
  // The variance of the path is a difference of what the edges make of it, and loses its digits.
  // Beyond ten digits, the edge with the lever is tied to the other one instead.
  const double lost = std::min(std::pow(lever * radians / 0.02, 2) * 2e-14, 0.02);
  for (int run = 0; run < 20; ++run) {
    const std::vector<ObservedEdge> edges = {
        edge_of({random.pose(1.0), isotropic(0.1, radians)}),
        edge_of({Pose::trusted(random.pose().rotation(), lever * random.direction()),
                 isotropic(0.1, radians)})};
    const Pose X = edges[0].X_PC.pose * edges[1].X_PC.pose;
    // Where it is thought to be, as the right answer is that of a linear problem.
    const auto observed = observe(edges, {X, R}, kSource, {1.0, true});
    REQUIRE(observed);
    CHECK(observed->distance_squared < 1e-6);
    CHECK(observed->dimensions == 6);
    CHECK(worst_ratio(observed_path(*observed), after(path_before(edges), R.matrix())) <
          1.0 + 1e-6 + lost);
  }
}

TEST_CASE("conditioning: right measurements are as likely over any lever") {
  // Two joints, of covariance of rank one, and a measurement of full rank.
  Random random(902);
  INFO("seed " << random.seed());
  const double lever = GENERATE(1.0, 30.0, 300.0, 1e4, 7e6);
  CAPTURE(lever);
  double sum = 0;
  constexpr int kRuns = 300;
  const Covariance R = isotropic(0.004, 0.004);
  for (int run = 0; run < kRuns; ++run) {
    std::vector<ObservedEdge> edges;
    Pose Z;
    for (int i = 0; i < 2; ++i) {
      const Pose X = random.pose(lever);
      const Twist v = 0.05 * Gaussian(isotropic(1, 1))(random);
      edges.push_back(edge_of({X, Covariance::trusted(Matrix6d(v * v.transpose()))}));
      Z = Z * X * exp(v * random.normal());
    }
    const auto observed = observe(edges, {Z * exp(Gaussian(R)(random)), R}, kSource, {1.0, true});
    REQUIRE(observed);
    CHECK(observed->accepted);
    CHECK(observed->dimensions == 6);
    sum += observed->distance_squared;
  }
  INFO("mean distance " << sum / kRuns);
  CHECK(sum > chi_squared_quantile(0.001, 6 * kRuns));
  CHECK(sum < chi_squared_quantile(0.999, 6 * kRuns));
}

TEST_CASE("conditioning: a planar robot is measured wherever it is, and out of its plane never") {
  Random random(903);
  INFO("seed " << random.seed());
  const double reach = GENERATE(0.0, 1.0, 1e3, 1e6, 7e6, 1e8);
  CAPTURE(reach);
  double sum = 0;
  constexpr int kRuns = 200;
  for (int run = 0; run < kRuns; ++run) {
    const Pose X = exp(Twist(random.uniform(-3, 3) * Twist::Unit(5)));
    const Transform base{Pose::trusted(X.rotation(), {random.uniform(0.5, 1.0) * reach, reach, 0}),
                         planar(0.5, 0.05)};
    const Pose mount = random.pose(0.5);
    const Covariance noise = planar(0.3, 0.03);
    const Pose truth = base.pose * exp(Gaussian(base.covariance.of_specified())(random));
    const Pose Z = truth * exp(Gaussian(noise)(random)) * mount;
    const Covariance R = noise.transported(mount.inverse());
    const std::vector<ObservedEdge> edges = {edge_of(base), edge_of(Transform::exact(mount))};
    const auto observed = observe(edges, {Z, R}, kSource, {1.0, true});
    REQUIRE(observed);
    CHECK(observed->accepted);
    CHECK(observed->dimensions == 3);
    sum += observed->distance_squared;
    // A centimetre above the plane, or a degree.
    for (const Twist& off : {Twist(0.01 * Twist::Unit(2)), Twist(0.02 * Twist::Unit(3))}) {
      const auto above = observe(edges, {truth * exp(off) * mount, R}, kSource, {1.0, true});
      REQUIRE(above);
      CHECK(std::isinf(above->distance_squared) == (reach < 1e8 || off[3] != 0));
      CHECK(above->accepted != std::isinf(above->distance_squared));
    }
  }
  INFO("mean distance " << sum / kRuns);
  CHECK(sum > chi_squared_quantile(0.001, 3 * kRuns));
  CHECK(sum < chi_squared_quantile(0.999, 3 * kRuns));
}

TEST_CASE("conditioning: deviations from 1e-9 to 1e9 count, each beside the others") {
  Random random(904);
  INFO("seed " << random.seed());
  for (int run = 0; run < 300; ++run) {
    // Along and about each axis, so that the right answer is a quotient.
    Twist before;
    Twist noise;
    for (int i = 0; i < 6; ++i) {
      before[i] = std::pow(10.0, random.uniform(-9, i < 3 ? 9 : -1));
      noise[i] = before[i] * std::pow(10.0, random.uniform(-7, 1));
    }
    const Transform X{Pose(), of_deviations(before)};
    const Transform Z{Pose(), of_deviations(noise)};
    const auto observed = observe({edge_of(X)}, Z, kSource);
    REQUIRE(observed);
    CHECK(observed->dimensions == 6);
    const auto fused = fuse({X, Z});
    REQUIRE(fused);
    const auto edge = collapse(observed->edges[0].X_PC).covariance.of_specified().stddev();
    const auto together = fused->X.covariance.of_specified().stddev();
    for (std::size_t i = 0; i < 6; ++i) {
      const auto k = static_cast<Eigen::Index>(i);
      const double right = before[k] * noise[k] / std::hypot(before[k], noise[k]);
      CAPTURE(i, before[k], noise[k]);
      CHECK(edge[i] == testing::Approx(right).epsilon(1e-8));
      CHECK(together[i] == testing::Approx(right).epsilon(1e-8));
    }
    // A point shows each of them.
    const auto p = transform(X, Point{});
    for (int i = 0; i < 3; ++i) {
      CHECK(std::sqrt(p.of_specified(i, i)) == testing::Approx(before[i]).epsilon(1e-8));
    }
  }
}

TEST_CASE("conditioning: a measurement of a path hardly known is possible") {
  Random random(905);
  INFO("seed " << random.seed());
  const double metres = GENERATE(1e3, 1e7, 1e9);
  CAPTURE(metres);
  for (int run = 0; run < 50; ++run) {
    const std::vector<ObservedEdge> edges = {edge_of({random.pose(1.0), isotropic(metres, 0.1)}),
                                             edge_of({random.pose(1.0), isotropic(0.1, 0.1)})};
    const Pose X = edges[0].X_PC.pose * edges[1].X_PC.pose;
    const Covariance R = isotropic(0.01, 0.01);
    const auto observed = observe(edges, {X, R}, kSource);
    REQUIRE(observed);
    CHECK(observed->accepted);
    CHECK(observed->dimensions == 6);
    // What is claimed is never less than what is right, but for rounding of what is subtracted.
    const double lost = std::pow(metres / 0.01, 2) * 1e-14;
    if (lost < 0.1) {
      CHECK(worst_ratio(observed_path(*observed), after(path_before(edges), R.matrix())) <
            1.0 + 1e-6 + lost);
    }
    CHECK(testing::domination(R.matrix(), observed_path(*observed)) < 1.0);
  }
}

// utm -> map <- base of a planar robot. Beside the least cost and the inverse Gauss-Newton matrix
// there, with 50 digits: those are the same for all deviations of an angle that is not known.
TEST_CASE(
    "conditioning: whatever is said of an angle that is not known, the rest keeps its digits") {
  const double unknown = GENERATE(10.0, 100.0, 1e3, 1e5, 1e6, 1e9);
  CAPTURE(unknown);
  const auto at = [](double x, double y, double z, double yaw) {
    const Pose turned = exp(Twist(yaw * Twist::Unit(5)));
    return Pose::trusted(turned.rotation(), {x, y, z});
  };
  const auto sigma = [](double x, double y, double z, double roll, double pitch, double yaw) {
    Twist all;
    all << x, y, z, roll, pitch, yaw;
    return all;
  };
  const Transform utm{at(-4567890, -5678901, 0, 0),
                      of_deviations(sigma(0.1, 0.1, 0.1, 0.001, 0.001, 0.01))};
  const Transform base{at(10, 5, 0, 0.3),
                       of_deviations(sigma(0.1, 0.1, 1e3, unknown, unknown, 0.05))};
  const Transform Z{at(4567900.3, 5678906.2, 0.1, 0.31),
                    of_deviations(sigma(0.02, 0.02, 0.05, 0.01, 0.01, 0.01))};
  const Twist of_base = sigma(1.6926, 1.4903, 702.67, 0.0092702, 0.0081684, 0.0098058);
  const Twist of_path = sigma(0.019999, 0.02, 0.05, 0.0092102, 0.0080914, 0.0098058);
  const bool of_source = GENERATE(false, true);
  CAPTURE(of_source);
  // Beside a source, what the path keeps is a difference, which loses some digits.
  const double tolerance = of_source ? 0.03 : 0.001;
  const auto is = [&](const Covariance& found, const Twist& right) {
    for (Eigen::Index i = 0; i < 6; ++i) {
      CAPTURE(i);
      CHECK(found.stddev()[static_cast<std::size_t>(i)] ==
            testing::Approx(right[i]).epsilon(tolerance));
    }
  };
  std::vector<ObservedEdge> edges{edge_of(utm), edge_of(base)};
  edges[0].way = ObservedEdge::Way::kUp;
  if (of_source) {
    // One of the angles errs by a source.
    edges[1].X_PC.common_errors = {{"q", false, Loading(unknown * Twist::Unit(3))}};
    edges[1].X_PC.own = of_deviations(sigma(0.1, 0.1, 1e3, 0, unknown, 0.05));
  }
  const auto observed = observe(edges, Z, kSource, {1.0, true});
  REQUIRE(observed);
  CHECK(observed->accepted);
  CHECK(observed->distance_squared == testing::Approx(0.1765).epsilon(0.01));
  const Belief up = inverse(observed->edges[0].X_PC);
  const Belief path = compose(up, observed->edges[1].X_PC, Order::kSecond);
  is(collapse(path).covariance.of_specified(), of_path);
  is(collapse(observed->edges[1].X_PC).covariance.of_specified(), of_base);
}

TEST_CASE("conditioning: an unspecified edge takes exactly what the measurement says") {
  Random random(906);
  INFO("seed " << random.seed());
  const double lever = GENERATE(1.0, 100.0, 1e4);
  const double sigma = GENERATE(1e-6, 0.01, 1.0);
  CAPTURE(lever, sigma);
  const Covariance R = isotropic(1e-4, 1e-4);
  const double lost = std::pow(lever * sigma / 1e-4, 2) * 2e-14;
  if (lost > 0.1) return;
  for (int run = 0; run < 20; ++run) {
    const std::vector<ObservedEdge> edges = {
        edge_of({random.pose(lever), isotropic(sigma, sigma)}),
        edge_of({random.pose(lever), StatedCovariance::unspecified()}),
        edge_of({random.pose(lever), isotropic(sigma, sigma)})};
    const auto observed = observe(edges, {random.pose(lever), R}, kSource);
    REQUIRE(observed);
    CHECK(worst_ratio(observed_path(*observed), R.matrix()) < 1.0 + 1e-6 + lost);
    // The other edges, alone and together, are as before.
    for (const std::size_t i : {std::size_t{0}, std::size_t{2}}) {
      const Transform left = collapse(observed->edges[i].X_PC);
      CHECK(testing::covariance_diff(left.covariance, edges[i].X_PC.own, 1e-12) == "");
      CHECK(testing::pose_diff(left.pose, edges[i].X_PC.pose, 1e-12) == "");
    }
    const Belief both = compose(observed->edges[0].X_PC, observed->edges[2].X_PC, Order::kSecond);
    const Belief expected = compose(edges[0].X_PC, edges[2].X_PC, Order::kSecond);
    CHECK(testing::covariance_diff(collapse(both).covariance, expected.own, 1e-12) == "");
  }
}

}  // namespace
}  // namespace tfdude
