#include "tfdude/math/covariance.hpp"

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <limits>
#include <set>
#include <string>
#include <type_traits>

#include "support/catch.hpp"
#include "support/pose_diff.hpp"
#include "support/random.hpp"
#include "support/sampling.hpp"

namespace tfdude {
namespace {

using testing::covariance_diff;
using testing::eigenvalues;
using testing::Random;

constexpr double kInf = std::numeric_limits<double>::infinity();
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

// Shared memory and other builds rely on these.
static_assert(std::is_trivially_copyable_v<Covariance>);
static_assert(sizeof(Covariance) == 21 * sizeof(double));

// The message of a rejection; empty where the matrix is accepted.
std::string refusal(const Matrix6d& matrix) {
  const auto sigma = Covariance::from_matrix(matrix);
  if (sigma) return "";
  CHECK(sigma.error().code == Errc::kInvalidInput);
  return sigma.error().message;
}

bool contains(const std::string& text, std::string_view part) {
  return text.find(part) != std::string::npos;
}

std::string name(int row, int column) {
  return "covariance[" + std::to_string(row) + "][" + std::to_string(column) + "]";
}

Matrix6d scaled(const Matrix6d& unit, double metres, double radians) {
  Twist scale;
  scale << Eigen::Vector3d::Constant(metres), Eigen::Vector3d::Constant(radians);
  return scale.asDiagonal() * unit * scale.asDiagonal();
}

// The smallest eigenvalue after metres and radians were scaled to variances of at most one, so that
// rounding errors of both are comparable.
double smallest_eigenvalue(const Matrix6d& sigma) {
  const double metres = std::sqrt(sigma.diagonal().head<3>().maxCoeff());
  const double radians = std::sqrt(sigma.diagonal().tail<3>().maxCoeff());
  const Matrix6d unit = scaled(sigma, metres > 0 ? 1 / metres : 0, radians > 0 ? 1 / radians : 0);
  return eigenvalues(unit)[0];
}

// As it would come back from a text with so many significant digits.
double rounded(double value, int digits) {
  char text[64];
  std::snprintf(text, sizeof text, "%.*e", digits - 1, value);
  return std::strtod(text, nullptr);
}

// ---- storage

TEST_CASE("upper_index counts the upper triangle row by row") {
  std::size_t next = 0;
  for (std::size_t row = 0; row < 6; ++row) {
    for (std::size_t column = row; column < 6; ++column) {
      CHECK(upper_index(row, column) == next++);
    }
  }
  CHECK(next == Covariance::kSize);
}

TEST_CASE("the default covariance is zero") {
  CHECK(Covariance().matrix() == Matrix6d::Zero());
  CHECK(Covariance().stddev() == std::array<double, 6>{});
  CHECK(refusal(Matrix6d::Zero()) == "");
}

TEST_CASE("upper and matrix hold the same elements") {
  Covariance::Upper upper{};
  for (std::size_t i = 0; i < upper.size(); ++i) upper[i] = static_cast<double>(i + 1);
  const Covariance sigma = Covariance::trusted(upper);
  const Matrix6d m = sigma.matrix();
  CHECK(m == m.transpose());
  CHECK(m(0, 5) == 6);
  CHECK(m(1, 1) == 7);
  CHECK(m(2, 3) == 13);
  CHECK(m(5, 5) == 21);
  CHECK(Covariance::trusted(m).upper() == upper);
}

TEST_CASE("a regular covariance passes unchanged") {
  Random random(101);
  INFO("seed " << random.seed());
  for (int i = 0; i < 50; ++i) {
    const Covariance sigma = random.covariance(0.1, 0.02);
    const auto from_upper = Covariance::from_upper(sigma.upper());
    const auto from_matrix = Covariance::from_matrix(sigma.matrix());
    REQUIRE(from_upper);
    REQUIRE(from_matrix);
    CHECK(from_upper->upper() == sigma.upper());
    CHECK(from_matrix->upper() == sigma.upper());
  }
}

TEST_CASE("sums are element by element") {
  Random random(102);
  INFO("seed " << random.seed());
  const Covariance a = random.covariance();
  const Covariance b = random.covariance();
  CHECK((a + b).matrix() == a.matrix() + b.matrix());
  Covariance c = a;
  c += b;
  CHECK(c.upper() == (a + b).upper());
}

// ---- standard deviations

TEST_CASE("from_stddev squares and stddev takes the roots") {
  const std::array<double, 6> stddev{0.1, 0.2, 0.3, 0.01, 0.0, 1e9};
  const auto sigma = Covariance::from_stddev(stddev);
  REQUIRE(sigma);
  Matrix6d expected = Matrix6d::Zero();
  for (int i = 0; i < 6; ++i) expected(i, i) = std::pow(stddev[static_cast<std::size_t>(i)], 2);
  CHECK((sigma->matrix() - expected).norm() <= 1e-15 * expected.norm());
  for (std::size_t i = 0; i < 6; ++i) {
    CHECK(std::abs(sigma->stddev()[i] - stddev[i]) <= 1e-15 * stddev[i]);
  }
}

TEST_CASE("from_stddev names the element that it rejects") {
  const std::size_t i = GENERATE(range<std::size_t>(0, 6));
  const double bad = GENERATE(as<double>{}, kNan, kInf, -kInf, -1e-300, -1.0, 1.0000001e9);
  CAPTURE(i, bad);
  std::array<double, 6> stddev{1, 1, 1, 1, 1, 1};
  stddev[i] = bad;
  const auto sigma = Covariance::from_stddev(stddev);
  REQUIRE_FALSE(sigma);
  CHECK(sigma.error().code == Errc::kInvalidInput);
  CHECK(contains(sigma.error().message, "stddev[" + std::to_string(i) + "]"));
}

// ---- refusals

TEST_CASE("a number that is not finite is rejected wherever it is") {
  const double bad = GENERATE(as<double>{}, kNan, kInf, -kInf);
  const int i = GENERATE(range(0, 6));
  const int j = GENERATE(range(0, 6));
  CAPTURE(bad, i, j);
  Matrix6d m = Matrix6d::Identity();
  m(i, j) = bad;
  CHECK(refusal(m) != "");
  m(j, i) = bad;
  CHECK(refusal(m) == name(std::min(i, j), std::max(i, j)) + " is not a finite number");
}

TEST_CASE("an asymmetric matrix is rejected") {
  const int i = GENERATE(range(0, 6));
  const int j = GENERATE(range(0, 6));
  if (i == j) return;
  CAPTURE(i, j);
  Matrix6d m = Matrix6d::Identity();
  m(i, j) = 1e-5;
  CHECK(contains(refusal(m), name(std::min(i, j), std::max(i, j))));
  CHECK(contains(refusal(m), "not symmetric"));
  m(i, j) = 1e-10;  // rounding: the mean of both is taken
  const auto sigma = Covariance::from_matrix(m);
  REQUIRE(sigma);
  CHECK(sigma->matrix()(i, j) == 0.5e-10);
}

TEST_CASE("a negative variance is rejected by its element") {
  const int i = GENERATE(range(0, 6));
  const double value = GENERATE(-1.0, -1e-3, -1e-9, -1e-11);
  CAPTURE(i, value);
  Matrix6d m = Matrix6d::Identity();
  m(i, i) = value;
  CHECK(refusal(m) == name(i, i) + " is a negative variance");
  // A tiny negative variance cannot be a rounding error if all others are zero.
  m.setZero();
  m(i, i) = 1e-9 * value;
  CHECK(refusal(m) == name(i, i) + " is a negative variance");
}

TEST_CASE("a variance up to 1e18 is accepted") {
  Matrix6d m = Matrix6d::Identity();
  m(2, 2) = 1e18;
  CHECK(refusal(m) == "");
  m(2, 2) = std::nextafter(1e18, kInf);
  CHECK(refusal(m) == name(2, 2) + " is 1e+18, which is beyond 1e18");
}

TEST_CASE("the checks of a covariance do not overflow") {
  // Some programs give the largest number as the variance of an axis of which they know nothing.
  const double huge = GENERATE(1e154, 1e155, 1e308, std::numeric_limits<double>::max());
  const int i = GENERATE(range(0, 6));
  const int j = GENERATE(range(0, 6));
  CAPTURE(huge, i, j);
  Matrix6d m = Matrix6d::Identity();
  m(i, j) = m(j, i) = huge;
  const std::string place = name(std::min(i, j), std::max(i, j));
  const std::string said = refusal(m);
  CHECK(contains(said, place + " is "));
  CHECK(contains(said, ", which is beyond 1e18"));
  const auto upper = Covariance::from_upper(Covariance::trusted(m).upper());
  REQUIRE_FALSE(upper);
  CHECK(upper.error().message == said);
  if (i == j) return;
  m(i, j) = -huge;
  CHECK(contains(refusal(m), "not symmetric"));
}

TEST_CASE("a correlation beyond one is rejected") {
  const int i = GENERATE(range(0, 6));
  const int j = GENERATE(range(0, 6));
  if (i >= j) return;
  const double excess = GENERATE(1e-5, 1e-3, 1.0);
  const double sign = GENERATE(1.0, -1.0);
  CAPTURE(i, j, excess, sign);
  Matrix6d m = Matrix6d::Identity();
  m(i, i) = 4.0;
  m(j, j) = 0.25;
  m(i, j) = m(j, i) = sign * (1.0 + excess);
  CHECK(contains(refusal(m), name(i, j)));
  CHECK(contains(refusal(m), "not positive semi-definite"));
  m(i, j) = m(j, i) = sign;
  CHECK(refusal(m) == "");
}

TEST_CASE("a zero variance allows no covariance beyond rounding") {
  const int i = GENERATE(range(0, 6));
  const int j = GENERATE(range(0, 6));
  if (i == j) return;
  const double value = GENERATE(1e-5, -1e-3, 1.0);
  CAPTURE(i, j, value);
  Matrix6d m = Matrix6d::Identity();
  m(i, i) = 0;
  CHECK(refusal(m) == "");
  // Next to a variance of one, the covariance c makes an eigenvalue of -c².
  m(i, j) = m(j, i) = 1e-7;
  CHECK(refusal(m) == "");
  m(i, j) = m(j, i) = value;
  CHECK(contains(refusal(m), "not positive semi-definite"));
}

TEST_CASE("a unit known exactly allows no covariance at all") {
  Matrix6d m = Matrix6d::Identity();
  m.bottomRightCorner<3, 3>().setZero();
  CHECK(refusal(m) == "");
  m(1, 4) = m(4, 1) = 1e-300;
  CHECK(contains(refusal(m), name(1, 4)));
}

TEST_CASE("a matrix is rejected if only pairs of elements are consistent") {
  // Three errors each opposed to the others: every 2x2 minor is positive, the determinant is not.
  Matrix6d m = Matrix6d::Identity();
  m(0, 1) = m(1, 0) = m(0, 3) = m(3, 0) = m(1, 3) = m(3, 1) = -0.6;
  CHECK(contains(refusal(m), "not positive semi-definite"));
  m(0, 1) = m(1, 0) = m(0, 3) = m(3, 0) = m(1, 3) = m(3, 1) = -0.5;
  CHECK(refusal(m) == "");
}

// ---- the borderline

TEST_CASE("a covariance of rank one is accepted") {
  Random random(111);
  INFO("seed " << random.seed());
  for (int i = 0; i < 200; ++i) {
    const Twist xi = random.twist(random.uniform(1e-6, 1.0), random.uniform(1e-3, 10.0));
    const Matrix6d m = xi * xi.transpose();
    const auto sigma = Covariance::from_matrix(m);
    REQUIRE(sigma);
    CHECK(covariance_diff(*sigma, Covariance::trusted(m), 1e-14) == "");
    CHECK(smallest_eigenvalue(sigma->matrix()) >= -1e-15 * 6);
  }
}

TEST_CASE("metres and radians of very different size are judged equally") {
  const double metres = GENERATE(1e6, 1.0, 1e-6);
  const double radians = GENERATE(1.0, 1e-6, 1e-9);
  CAPTURE(metres, radians);
  for (int i = 0; i < 6; ++i) {
    for (int j = i + 1; j < 6; ++j) {
      CAPTURE(i, j);
      Matrix6d unit = Matrix6d::Identity();
      unit(i, j) = unit(j, i) = 0.999;
      CHECK(refusal(scaled(unit, metres, radians)) == "");
      // Relative to the largest eigenvalue of the unscaled matrix this may be as little as 1e-33.
      unit(i, j) = unit(j, i) = 1.001;
      CHECK(refusal(scaled(unit, metres, radians)) != "");
    }
  }
}

TEST_CASE("axes of different size are distinguished down to rounding of the largest") {
  // z is known 1e4 times better than x and y, and yet its correlation with the yaw counts.
  Matrix6d m = Matrix6d::Identity();
  m(2, 2) = 1e-8;
  m(2, 5) = m(5, 2) = 0.99e-4;
  CHECK(refusal(m) == "");
  m(2, 5) = m(5, 2) = 1.01e-4;
  CHECK(refusal(m) != "");
}

TEST_CASE("decimal rounding is accepted up to 1e-6 and rejected beyond") {
  // The tolerance: with every axis scaled to a variance of one, no eigenvalue below -1e-6 of the
  // largest. Rounding to d digits moves each element by up to 5·10^-d of it, an eigenvalue by up to
  // 6 times that: eight digits always pass, four may well be rejected, and whatever passes comes
  // out semi-definite.
  Random random(112);
  INFO("seed " << random.seed());
  int accepted = 0;
  int refused = 0;
  for (int i = 0; i < 300; ++i) {
    const int digits = std::array<int, 5>{3, 4, 5, 6, 8}[random.index(5)];
    const Twist xi = Twist::Constant(1) + 0.5 * random.twist(1.0, 1.0);
    const Twist eta = Twist::Constant(1) + 0.5 * random.twist(1.0, 1.0);
    Matrix6d m = xi * xi.transpose() + eta * eta.transpose();
    m = m.unaryExpr([digits](double value) { return rounded(value, digits); });
    const Twist scale = m.diagonal().cwiseSqrt().cwiseInverse();
    const Matrix6d unit = scale.asDiagonal() * m * scale.asDiagonal();
    const Eigen::VectorXd values = eigenvalues(unit);
    const double smallest = values[0] / values[5];
    CAPTURE(i, digits, smallest);
    if (digits == 8) CHECK(smallest > -1e-6);
    const auto sigma = Covariance::from_matrix(m);
    CHECK(sigma.has_value() == (smallest >= -1e-6));
    ++(sigma ? accepted : refused);
    if (!sigma) continue;
    CHECK(smallest_eigenvalue(sigma->matrix()) >= -1e-12);
    CHECK(covariance_diff(*sigma, Covariance::trusted(m), 1e-5) == "");
    CHECK(Covariance::from_upper(sigma->upper()));  // what was lifted is fit to be sent on
  }
  CHECK(accepted > 50);
  CHECK(refused > 50);
}

TEST_CASE("covariances of any rank and size pass after rounding to float32") {
  Random random(113);
  INFO("seed " << random.seed());
  for (int i = 0; i < 2000; ++i) {
    const int rank = 1 + static_cast<int>(random.index(6));
    const double metres = std::pow(10.0, random.uniform(-9, 8));
    const double radians = std::pow(10.0, random.uniform(-9, 0));
    CAPTURE(i, rank, metres, radians);
    Matrix6d m = Matrix6d::Zero();
    for (int k = 0; k < rank; ++k) {
      Twist xi = random.twist(radians, metres);
      xi[static_cast<int>(random.index(6))] *= 1e-3;
      m += xi * xi.transpose();
    }
    const Matrix6d Ad = adjoint(random.pose(std::pow(10.0, random.uniform(-2, 6))));
    m = (Ad * m * Ad.transpose()).eval();
    if (m.maxCoeff() > kMaxVariance) continue;
    const Matrix6d even = 0.5 * (m + m.transpose());
    const auto sigma = Covariance::from_matrix(even.cast<float>().cast<double>());
    REQUIRE(sigma);
    CHECK(covariance_diff(*sigma, Covariance::trusted(even), 1e-6) == "");
  }
}

TEST_CASE("a product that was computed in float32 passes though it is not quite symmetric") {
  Random random(114);
  INFO("seed " << random.seed());
  using Matrix6f = Eigen::Matrix<float, 6, 6>;
  for (int i = 0; i < 2000; ++i) {
    const Matrix6f J = adjoint(random.pose(10.0)).cast<float>();
    const Matrix6f S = random.covariance(0.01, 0.01).matrix().cast<float>();
    const Matrix6f product = J * S * J.transpose();
    CAPTURE(i);
    CHECK(refusal(product.cast<double>()) == "");
  }
}

// ---- transport

TEST_CASE("transported is the dense product with the adjoint") {
  Random random(121);
  INFO("seed " << random.seed());
  for (int i = 0; i < 200; ++i) {
    const Pose X = random.pose(5.0);
    const Covariance sigma = random.covariance(random.uniform(0.001, 1.0), 0.1);
    const Matrix6d Ad = adjoint(X);
    const Matrix6d dense = Ad * sigma.matrix() * Ad.transpose();
    CHECK(covariance_diff(sigma.transported(X), Covariance::trusted(dense), 1e-14) == "");
  }
}

TEST_CASE("transport by a pose and then by its inverse cancels") {
  Random random(122);
  INFO("seed " << random.seed());
  const Covariance sigma = random.covariance();
  const Pose X = random.pose();
  const Pose Y = random.pose();
  CHECK(sigma.transported(Pose()).upper() == sigma.upper());
  CHECK(covariance_diff(sigma.transported(X).transported(X.inverse()), sigma, 1e-13) == "");
  CHECK(covariance_diff(sigma.transported(Y).transported(X), sigma.transported(X * Y), 1e-13) ==
        "");
}

TEST_CASE("a rotation error moves a distant frame sideways") {
  // Known to 0.01 rad about z at B; seen from A, 10 m along x, B wavers 0.1 m along y.
  const auto sigma = Covariance::from_stddev({0, 0, 0, 0, 0, 0.01});
  REQUIRE(sigma);
  const auto seen = sigma->transported(Pose::trusted(Eigen::Quaterniond::Identity(), {10, 0, 0}));
  CHECK(std::abs(seen.stddev()[1] - 0.1) < 1e-15);
  CHECK(seen.stddev()[0] == 0.0);
  CHECK(seen.stddev()[2] == 0.0);
  // [t]× z for t = 10 x points along -y: Exp(ξ) turns about A's origin, not about B's.
  CHECK(std::abs(seen.matrix()(1, 5) + 1e-3) < 1e-17);
}

}  // namespace
}  // namespace tfdude
