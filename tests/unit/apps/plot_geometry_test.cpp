#include "tfdude/drawing/plot_geometry.hpp"

#include <cmath>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "tfdude/math/perturbation.hpp"

#include "support/catch.hpp"
#include "support/random.hpp"

namespace tfdude::cli {
namespace {

using Eigen::Matrix2d;
using Eigen::Vector2d;
using Eigen::Vector3d;
using testing::Approx;
using testing::Random;

// ---- ellipses

TEST_CASE("an ellipse has the axes and the extent of its covariance") {
  Random random(31);
  INFO("seed " << random.seed());
  for (int i = 0; i < 200; ++i) {
    Matrix2d root;
    root << random.normal(), random.normal(), random.normal(), random.normal();
    root *= std::pow(10.0, random.uniform(-9, 9));
    const Matrix2d covariance = root * root.transpose();
    const Ellipse ellipse = ellipse_of(covariance);
    CHECK(ellipse.major >= ellipse.minor);
    const Vector2d major(std::cos(ellipse.angle), std::sin(ellipse.angle));
    const Vector2d minor(-major.y(), major.x());
    const double size = covariance.norm();
    const double major2 = ellipse.major * ellipse.major;
    CHECK((covariance * major - major2 * major).norm() <= 1e-9 * size);
    CHECK((covariance * minor - ellipse.minor * ellipse.minor * minor).norm() <= 1e-9 * size);
    // Along any direction it reaches as far as the deviation there, times three.
    const double turn = random.uniform(0, 6.28);
    const Vector2d u(std::cos(turn), std::sin(turn));
    double reach = 0;
    for (const Vector2d& p : outline_of(ellipse, 3)) reach = std::max(reach, p.dot(u));
    const double expected = 3 * std::sqrt(u.dot(covariance * u));
    CHECK(reach <= expected * (1 + 1e-9));
    CHECK(reach >= expected * 0.998);  // between two of its points
  }
}

TEST_CASE("a flat ellipse is a line and an empty one is a point") {
  Matrix2d covariance;
  covariance << 4, 4, 4, 4;
  double furthest = 0;
  for (const Vector2d& p : outline_of(ellipse_of(covariance), 1)) {
    CHECK(std::abs(p.x() - p.y()) < 1e-6);
    furthest = std::max(furthest, p.norm());
  }
  CHECK(furthest == Approx(std::sqrt(8)));
  const Ellipse none = ellipse_of(Matrix2d::Zero());
  CHECK(none.major == 0);
  CHECK(none.minor == 0);
}

// ---- axes

TEST_CASE("ticks are round numbers") {
  CHECK(ticks_within(-1.05, 3.05, 6).values == std::vector<double>{-1, 0, 1, 2, 3});
  CHECK(ticks_within(0, 1, 6).step == Approx(0.2));
  CHECK(ticks_within(0, 1, 11).step == Approx(0.1));
  CHECK(ticks_within(-30, 30, 6).values == std::vector<double>{-20, 0, 20});
  CHECK(ticks_within(400, 2100, 6).values == std::vector<double>{500, 1000, 1500, 2000});
}

TEST_CASE("ticks of any range are within it, few, and multiples of 1, 2 or 5") {
  Random random(32);
  INFO("seed " << random.seed());
  for (int i = 0; i < 2000; ++i) {
    const double size = std::pow(10.0, random.uniform(-8, 8));
    const double low = random.uniform(-2, 2) * size;
    const double high = low + random.uniform(0.5, 3) * size;
    const Ticks ticks = ticks_within(low, high, 6);
    INFO(low << " to " << high);
    CHECK(ticks.values.size() <= 6);
    CHECK(ticks.values.size() >= 2);
    const double digit = ticks.step / std::pow(10.0, std::floor(std::log10(ticks.step) + 1e-9));
    CHECK((std::abs(digit - 1) < 1e-9 || std::abs(digit - 2) < 1e-9 || std::abs(digit - 5) < 1e-9));
    for (const double value : ticks.values) {
      CHECK(value >= low - 1e-9 * size);
      CHECK(value <= high + 1e-9 * size);
      CHECK(std::abs(std::remainder(value, ticks.step)) < 1e-9 * ticks.step);
    }
  }
}

TEST_CASE("numbers on an axis have the decimals of its step") {
  CHECK(tick_label(0, 0.5) == "0.0");
  CHECK(tick_label(-1.5, 0.5) == "−1.5");
  CHECK(tick_label(20, 10) == "20");
  CHECK(tick_label(0.06, 0.02) == "0.06");
  CHECK(tick_label(-0.3, 0.1) == "−0.3");
  CHECK(number_text(-0.0004, 2) == "0.00");
}

TEST_CASE("units make numbers easy to read") {
  CHECK(std::string(unit_for(3e8).name) == "Mm");
  CHECK(std::string(unit_for(4e3).name) == "km");
  CHECK(std::string(unit_for(2).name) == "m");
  CHECK(std::string(unit_for(0.1).name) == "cm");
  CHECK(std::string(unit_for(0.02).name) == "mm");
  CHECK(std::string(unit_for(2e-5).name) == "µm");
  CHECK(std::string(unit_for(2e-8).name) == "nm");
  CHECK(length_text(0.0312) == "31.2 mm");
  CHECK(length_text(0.1) == "100 mm");
  CHECK(length_text(0.00099999) == "1 mm");
  CHECK(length_text(1.5) == "1.5 m");
  CHECK(length_text(0) == "0 mm");
}

// ---- the path

TEST_CASE("a chain follows the edges of its path up and down") {
  Random random(33);
  INFO("seed " << random.seed());
  const Step up{random.transform(), true};
  const Step down{random.transform(), false};
  const auto chain = chain_of({up, down, down});
  REQUIRE(chain.size() == 4);
  CHECK(chain[0].norm() == 0);
  // The parent, seen from the child.
  CHECK((up.X_PC.pose * chain[1]).norm() < 1e-12);
  const Pose X = up.X_PC.pose.inverse() * down.X_PC.pose;
  CHECK((chain[2] - X.translation()).norm() < 1e-12);
  CHECK((chain[3] - X * down.X_PC.pose.translation()).norm() < 1e-12);
  CHECK(chain_of({}).size() == 1);
}

TEST_CASE("sampled points have the spread of small covariances") {
  Random random(34);
  INFO("seed " << random.seed());
  constexpr int kPoints = 20000;
  std::vector<Step> steps;
  for (const bool up : {true, true, false, false}) {
    steps.push_back({random.transform(1, 1e-4, 1e-4), up});
  }
  Transform X_AB;
  for (const Step& step : steps) X_AB = compose(X_AB, step.up ? inverse(step.X_PC) : step.X_PC);
  const Eigen::Matrix3d expected =
      ros_covariance(X_AB).of_specified().matrix().topLeftCorner<3, 3>();
  Vector3d mean = Vector3d::Zero();
  Eigen::Matrix3d moment = Eigen::Matrix3d::Zero();
  for (const Vector3d& p : sample_ends(steps, kPoints, random.seed())) {
    const Vector3d d = p - X_AB.pose.translation();
    mean += d / kPoints;
    moment += d * d.transpose() / kPoints;
  }
  for (int i = 0; i < 3; ++i) {
    CHECK(std::abs(mean[i]) < 5 * std::sqrt(expected(i, i) / kPoints));
    for (int j = i; j < 3; ++j) {
      const double both = expected(i, i) * expected(j, j) + expected(i, j) * expected(i, j);
      CHECK(std::abs(moment(i, j) - expected(i, j)) < 5 * std::sqrt(both / kPoints));
    }
  }
}

TEST_CASE("points of an uncertain rotation lie on its circle and not on the tangent") {
  const std::vector<Step> steps{
      {{Pose(), *Covariance::from_stddev({0, 0, 0, 0, 0, 1})}, false},
      {{*Pose::create(Eigen::Quaterniond::Identity(), {2, 0, 0}), {}}, false}};
  double lowest = 2;
  for (const Vector3d& p : sample_ends(steps, 500, 1)) {
    CHECK(p.norm() == Approx(2));
    CHECK(p.z() == 0);
    lowest = std::min(lowest, p.x());
  }
  CHECK(lowest < 0);
}

TEST_CASE("the same seed gives the same points") {
  Random random(35);
  const std::vector<Step> steps{{random.transform(), false}};
  const auto first = sample_ends(steps, 5, 7);
  CHECK(first.size() == 5);
  CHECK(first == sample_ends(steps, 5, 7));
  CHECK(first != sample_ends(steps, 5, 8));
}

}  // namespace
}  // namespace tfdude::cli
