// Covariances at the limits of arithmetic: long chains, far coordinates, half turns.

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <iostream>

#include "tfdude/math/belief.hpp"
#include "tfdude/math/fusion.hpp"
#include "tfdude/math/observation.hpp"

#include "math/path_accumulation.hpp"
#include "support/catch.hpp"
#include "support/pose_diff.hpp"
#include "support/random.hpp"
#include "support/sampling.hpp"

namespace tfdude {
namespace {

using testing::eigenvalues;
using testing::pose_diff;
using testing::Random;
using Real = long double;
using Matrix3r = Eigen::Matrix<Real, 3, 3>;
using Vector3r = Eigen::Matrix<Real, 3, 1>;
using Matrix6r = Eigen::Matrix<Real, 6, 6>;

// The smallest eigenvalue, in units of the axes' own deviations, where the largest is of the order
// of one.
double smallest_eigenvalue(const StatedCovariance& covariance) {
  const Matrix6d sigma = covariance.of_specified().matrix();
  const Twist unit = sigma.diagonal().unaryExpr(
      [](double variance) { return variance > 0 ? 1.0 / std::sqrt(variance) : 0.0; });
  const Matrix6d scaled = unit.asDiagonal() * sigma * unit.asDiagonal();
  return eigenvalues(scaled)[0];
}

// The same arithmetic with 64 bits of mantissa instead of 53, product by product.
struct Exact {
  Matrix3r R = Matrix3r::Identity();
  Vector3r t = Vector3r::Zero();
  Matrix6r sigma = Matrix6r::Zero();

  static Matrix3r cross(const Vector3r& v) {
    Matrix3r m;
    m << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
    return m;
  }
  Matrix6r adjoint_of_inverse() const {
    Matrix6r ad = Matrix6r::Zero();
    ad.topLeftCorner<3, 3>() = R.transpose();
    ad.bottomRightCorner<3, 3>() = R.transpose();
    ad.topRightCorner<3, 3>() = -R.transpose() * cross(t);
    return ad;
  }
  void append(const Transform& X) {
    Exact edge;
    const auto q = X.pose.rotation().cast<Real>().normalized();
    edge.R = q.toRotationMatrix();
    edge.t = X.pose.translation().cast<Real>();
    const Matrix6r ad = edge.adjoint_of_inverse();
    sigma =
        (ad * sigma * ad.transpose()).eval() + X.covariance.of_specified().matrix().cast<Real>();
    t += R * edge.t;
    R = (R * edge.R).eval();
  }
  // The largest difference of an element, in units of its axes' deviations.
  double error_of(const StatedCovariance& covariance) const {
    double largest = 0;
    const Matrix6d other = covariance.of_specified().matrix();
    for (int i = 0; i < 6; ++i) {
      for (int j = 0; j < 6; ++j) {
        const Real unit = std::sqrt(sigma(i, i) * sigma(j, j));
        largest =
            std::max(largest, static_cast<double>(std::abs(other(i, j) - sigma(i, j)) / unit));
      }
    }
    return largest;
  }
  double error_of(const Pose& X) const {
    return static_cast<double>((X.translation().cast<Real>() - t).cwiseAbs().maxCoeff());
  }
};

// Set TFDUDE_REPORT to have the largest errors printed.
void report(const char* what, double value) {
  if (std::getenv("TFDUDE_REPORT") != nullptr) std::cout << what << ": " << value << '\n';
}

Transform accumulated(const std::vector<Transform>& edges) {
  PathAccumulation<Transform> down;
  for (auto edge = edges.rbegin(); edge != edges.rend(); ++edge) down.up(*edge);
  return join(PathAccumulation<Transform>(), std::move(down));
}

TEST_CASE("numerics: a chain of 10,000 edges keeps its covariance") {
  Random random(681);
  INFO("seed " << random.seed());
  std::vector<Transform> edges;
  for (int i = 0; i < 10'000; ++i) edges.push_back(random.transform(1.0, 0.001, 0.001));
  Exact exact;
  Belief second;
  Belief fourth;
  for (const Transform& edge : edges) {
    exact.append(edge);
    const Belief X{edge.pose, edge.covariance.of_specified(), std::nullopt, {}};
    second = compose(second, X, Order::kSecond);
    fourth = compose(fourth, X, Order::kFourth);
  }
  const Transform looked_up = accumulated(edges);
  report("chain of 10,000: pose [m]", exact.error_of(looked_up.pose));
  report("chain of 10,000: lookup's covariance", exact.error_of(looked_up.covariance));
  report("chain of 10,000: composed covariance", exact.error_of(collapse(second).covariance));
  CHECK(exact.error_of(looked_up.pose) < 1e-9);
  CHECK(exact.error_of(looked_up.covariance) < 1e-11);
  CHECK(exact.error_of(collapse(second).covariance) < 1e-11);
  double smallest = 1;
  for (const StatedCovariance& one :
       {looked_up.covariance, collapse(second).covariance, collapse(fourth).covariance}) {
    smallest = std::min(smallest, smallest_eigenvalue(one));
  }
  report("chain of 10,000: smallest eigenvalue", smallest);
  CHECK(smallest > -1e-12);
}

TEST_CASE("numerics: poses and covariances stay precise at a million metres") {
  Random random(682);
  INFO("seed " << random.seed());
  double worst_pose = 0;
  double worst = 0;
  double smallest = 1;
  for (int i = 0; i < 1000; ++i) {
    // A machine far out, and a tool on it seen from another one beside: by way of the origin.
    const Transform X_WA{Pose::trusted(random.pose().rotation(), random.vector(1e6)),
                         random.covariance(0.001, 1e-9)};
    const Transform X_AB{random.pose(10.0), random.covariance(0.001, 0.001)};
    Exact exact;
    exact.append(X_WA);
    exact.append(X_AB);
    const Transform X_WB = accumulated({X_WA, X_AB});
    worst_pose = std::max(worst_pose, exact.error_of(X_WB.pose));
    worst = std::max(worst, exact.error_of(X_WB.covariance));
    for (const Transform& X : {X_WB, inverse(X_WB), between(X_WB, X_WA)}) {
      smallest = std::min(smallest, smallest_eigenvalue(X.covariance));
    }
  }
  report("a million metres: pose [m]", worst_pose);
  report("a million metres: covariance", worst);
  report("a million metres: smallest eigenvalue", smallest);
  CHECK(worst_pose < 5e-9);
  CHECK(worst < 1e-12);
  CHECK(smallest > -1e-12);
}

TEST_CASE("numerics: a covariance transported over a million metres and back is the same") {
  Random random(683);
  INFO("seed " << random.seed());
  double worst = 0;
  double smallest = 1;
  for (int i = 0; i < 1000; ++i) {
    const Covariance sigma = random.covariance(0.001, 0.001);
    const Pose far = Pose::trusted(random.pose().rotation(), random.vector(1e6));
    const Covariance there = sigma.transported(far);
    const Covariance back = there.transported(far.inverse());
    smallest = std::min(smallest, smallest_eigenvalue(there));
    const Matrix6d rest = back.matrix() - sigma.matrix();
    worst = std::max(worst, rest.cwiseAbs().maxCoeff());
  }
  // A lever of 1e6 m turns 1 mrad into a variance of 1e6 m², whose last bits are 1e-10 m².
  report("there and back over a million metres [m²]", worst);
  report("seen from a million metres: smallest eigenvalue", smallest);
  CHECK(worst < 1e-8);
  CHECK(smallest > -1e-12);
}

TEST_CASE("numerics: poses and covariances stay precise near half turns") {
  Random random(684);
  INFO("seed " << random.seed());
  double worst_log = 0;
  double worst_fused = 0;
  double smallest = 1;
  for (const double off : {0.0, 1e-15, 1e-12, 1e-9, 1e-6, 1e-3}) {
    for (int i = 0; i < 200; ++i) {
      const Twist xi = random.twist(M_PI - off);
      const Pose X = exp(xi);
      const Pose again = exp(log(X));
      worst_log = std::max(worst_log, (again.matrix() - X.matrix()).cwiseAbs().maxCoeff());
      const Transform X_AB{X, random.covariance(0.01, 0.01)};
      const Transform X_BC{exp(random.twist(M_PI - off)), random.covariance(0.01, 0.01)};
      Exact exact;
      exact.append(X_AB);
      exact.append(X_BC);
      CHECK(exact.error_of(accumulated({X_AB, X_BC}).covariance) < 1e-12);
      // A path that is itself half a turn, observed where it is thought to be and a little beside.
      const Transform Z{X * exp(0.005 * random.twist(1.0, 1.0)), random.covariance(0.01, 0.01)};
      const auto observed =
          observe({{{X, X_AB.covariance.of_specified(), std::nullopt, {}}, {}}}, Z, "observed:1");
      const auto fused = fuse({X_AB, Z});
      REQUIRE(observed);
      REQUIRE(fused);
      const Transform corrected = collapse(observed->edges[0].X_PC);
      CHECK(pose_diff(corrected.pose, fused->X.pose, 1e-9) == "");
      worst_fused = std::max(
          worst_fused, (corrected.pose.matrix() - fused->X.pose.matrix()).cwiseAbs().maxCoeff());
      smallest = std::min({smallest, smallest_eigenvalue(fused->X.covariance),
                           smallest_eigenvalue(corrected.covariance)});
    }
  }
  report("half turns: exp of log", worst_log);
  report("half turns: observed beside fused", worst_fused);
  report("half turns: smallest eigenvalue", smallest);
  CHECK(worst_log < 1e-12);
  CHECK(smallest > -1e-12);
}

TEST_CASE("numerics: covariances stay positive semi-definite after very precise observations") {
  Random random(685);
  INFO("seed " << random.seed());
  double smallest = 1;
  double worst = 0;
  for (const double precision : {1e-3, 1e-5, 1e-7}) {
    for (int run = 0; run < 50; ++run) {
      std::vector<ObservedEdge> edges;
      Pose X_AB;
      for (int i = 0; i < 6; ++i) {
        const Transform X = random.transform(1.0, 0.01, 0.01);
        edges.push_back(
            {{X.pose, X.covariance.of_specified(), std::nullopt, {}}, ObservedEdge::Way::kDown});
        X_AB = X_AB * X.pose;
      }
      const Covariance R = random.covariance(precision, precision);
      Belief whole;
      for (int again = 0; again < 3; ++again) {
        const auto observed =
            observe(edges, {X_AB, R}, "observed:" + std::to_string(again), {1.0, true});
        REQUIRE(observed);
        whole = {};
        for (std::size_t i = 0; i < edges.size(); ++i) {
          edges[i].X_PC = observed->edges[i].X_PC;
          whole = compose(whole, edges[i].X_PC, Order::kSecond);
          smallest = std::min(smallest, smallest_eigenvalue(collapse(edges[i].X_PC).covariance));
          smallest = std::min(smallest, smallest_eigenvalue(collapse(whole).covariance));
        }
      }
      // Three of one measurement: a third of its covariance.
      const Matrix6d left = collapse(whole).covariance.of_specified().matrix() - R.matrix() / 3.0;
      const double rest = left.cwiseAbs().maxCoeff() / R.matrix().cwiseAbs().maxCoeff();
      worst = std::max(worst, rest);
    }
  }
  report("observations: smallest eigenvalue", smallest);
  report("observations: path beside the measurement's third", worst);
  CHECK(smallest > -1e-12);
  CHECK(worst < 0.05);
}

}  // namespace
}  // namespace tfdude
