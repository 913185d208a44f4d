#include "tfdude/math/pose.hpp"

#include <cmath>
#include <limits>
#include <string>
#include <type_traits>
#include <vector>

#include "support/catch.hpp"
#include "support/pose_diff.hpp"
#include "support/random.hpp"

namespace tfdude {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;
using testing::pose_diff;
using testing::Random;

constexpr double kPi = 3.14159265358979323846;
constexpr double kInf = std::numeric_limits<double>::infinity();
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

// Shared memory and other builds rely on these.
static_assert(std::is_trivially_copyable_v<Pose>);
static_assert(sizeof(Pose) == 7 * sizeof(double) && alignof(Pose) == alignof(double));

struct Point {
  std::string name;
  Twist xi;
};

// Where exp and log change their formula or lose their footing, and some of everywhere else.
std::vector<Point> points(Random& random) {
  std::vector<Point> all;
  all.push_back({"identity", Twist::Zero()});
  all.push_back({"pure translation", random.twist(0.0)});
  for (const double angle :
       {1e-160, 1e-12, 1e-8, 9.99e-4, 1e-3, 1.001e-3, 0.1, 1.0, kPi - 1e-3, kPi - 1e-9, kPi}) {
    all.push_back({"angle " + std::to_string(angle), random.twist(angle)});
  }
  all.push_back({"all tiny", random.twist(1e-8, 1e-8)});
  for (int i = 0; i < 20; ++i) all.push_back({"random", random.twist(random.uniform(0.0, kPi))});
  // Half turns about the axes: a single quaternion component is one.
  for (int axis = 3; axis < 6; ++axis) {
    Twist xi = random.twist(0.0);
    xi[axis] = kPi;
    all.push_back({"half turn", xi});
  }
  return all;
}

// Exp by its definition, the power series of the 4x4 matrix, with scaling and squaring: nothing is
// shared with the closed form.
Eigen::Matrix4d matrix_exponential(const Twist& xi) {
  using Matrix = Eigen::Matrix<long double, 4, 4>;
  constexpr int kHalvings = 12;
  Eigen::Matrix4d algebra = Eigen::Matrix4d::Zero();
  algebra.topLeftCorner<3, 3>() << 0, -xi[5], xi[4], xi[5], 0, -xi[3], -xi[4], xi[3], 0;
  algebra.topRightCorner<3, 1>() = xi.head<3>();
  const Matrix A = algebra.cast<long double>() / std::pow(2.0L, kHalvings);
  Matrix sum = Matrix::Identity();
  Matrix term = Matrix::Identity();
  for (int k = 1; k <= 12; ++k) {
    term = term * A / static_cast<long double>(k);
    sum += term;
  }
  for (int i = 0; i < kHalvings; ++i) sum = sum * sum;
  return sum.cast<double>();
}

// ---- the group

TEST_CASE("the default pose is the identity") {
  CHECK(pose_diff(Pose(), exp(Twist::Zero()), 0.0) == "");
  CHECK(Pose().matrix() == Eigen::Matrix4d::Identity());
  CHECK(log(Pose()) == Twist::Zero());
}

TEST_CASE("group laws hold at every kind of point") {
  Random random(11);
  INFO("seed " << random.seed());
  for (const Point& a : points(random)) {
    for (const Point& b : points(random)) {
      INFO(a.name << " and " << b.name);
      const Pose X_AB = exp(a.xi);
      const Pose X_BC = exp(b.xi);
      const Pose X_CD = random.pose();
      const Pose X_AC = X_AB * X_BC;
      const Vector3d p_C = random.vector(2.0);
      CHECK(pose_diff(X_AC * X_CD, X_AB * (X_BC * X_CD), 1e-13) == "");
      CHECK(pose_diff(X_AC.inverse(), X_BC.inverse() * X_AB.inverse(), 1e-13) == "");
      CHECK((X_AC * p_C - X_AB * (X_BC * p_C)).norm() < 1e-13);
      CHECK((X_AC.matrix() - X_AB.matrix() * X_BC.matrix()).norm() < 1e-13);
    }
  }
}

TEST_CASE("a pose and its inverse cancel") {
  Random random(12);
  INFO("seed " << random.seed());
  for (const Point& point : points(random)) {
    INFO(point.name);
    const Pose X_AB = exp(point.xi);
    CHECK(pose_diff(X_AB * Pose(), X_AB, 1e-15) == "");
    CHECK(pose_diff(Pose() * X_AB, X_AB, 1e-15) == "");
    CHECK(pose_diff(X_AB * X_AB.inverse(), Pose(), 1e-14) == "");
    CHECK(pose_diff(X_AB.inverse() * X_AB, Pose(), 1e-14) == "");
    CHECK(pose_diff(X_AB.inverse().inverse(), X_AB, 1e-14) == "");
    CHECK(pose_diff(X_AB.inverse(), exp(-point.xi), 1e-13) == "");
  }
}

TEST_CASE("a pose maps points of the child into the parent") {
  // B stands 1 m ahead of A and looks to A's left.
  const Pose X_AB = Pose::trusted(from_rpy(0, 0, kPi / 2), {1, 0, 0});
  CHECK((X_AB * Vector3d(2, 0, 0) - Vector3d(1, 2, 0)).norm() < 1e-15);
  CHECK((X_AB.inverse() * Vector3d(1, 2, 0) - Vector3d(2, 0, 0)).norm() < 1e-15);
}

TEST_CASE("a chain of 10000 products keeps the quaternion at unit length") {
  Random random(13);
  INFO("seed " << random.seed());
  Pose X = random.pose();
  double worst = 0;
  for (int i = 0; i < 10'000; ++i) {
    // Factors as long as rounding may leave them, always to the same side: without normalization
    // the chain ends 1e-11 off.
    Quaterniond q = random.pose().rotation();
    q.coeffs() *= 1.0 + 1e-15;
    X = X * Pose::trusted(q, random.vector(1.0));
    worst = std::max(worst, std::abs(X.rotation().norm() - 1.0));
  }
  CHECK(worst < 1e-12);
}

// ---- exp and log

TEST_CASE("exp is the matrix exponential") {
  Random random(21);
  INFO("seed " << random.seed());
  for (const Point& point : points(random)) {
    INFO(point.name);
    CHECK((exp(point.xi).matrix() - matrix_exponential(point.xi)).norm() < 1e-14);
  }
  for (const double angle : {4.0, 6.0, 2 * kPi, 10.0}) {  // more than half a turn is fine for exp
    INFO("angle " << angle);
    const Twist xi = random.twist(angle);
    CHECK((exp(xi).matrix() - matrix_exponential(xi)).norm() < 1e-13);
  }
}

TEST_CASE("log undoes exp") {
  Random random(22);
  INFO("seed " << random.seed());
  for (const Point& point : points(random)) {
    const double angle = point.xi.tail<3>().norm();
    if (angle >= kPi - 1e-12) continue;  // two logarithms there
    INFO(point.name);
    CHECK((log(exp(point.xi)) - point.xi).norm() < 1e-13);
  }
}

TEST_CASE("log keeps the relative precision of small rotations") {
  Random random(23);
  INFO("seed " << random.seed());
  for (const double angle : {1e-150, 1e-100, 1e-12, 1e-8, 1e-5, 1e-4, 9.99e-4, 1.001e-3, 1e-2}) {
    INFO("angle " << angle);
    const Twist xi = random.twist(angle, 0.0);
    CHECK((log(exp(xi)) - xi).norm() <= 1e-15 * angle);
  }
}

TEST_CASE("far translations keep their relative precision") {
  // Only they show the last terms of the small-angle series.
  constexpr double kReach = 1e6;
  Random random(27);
  INFO("seed " << random.seed());
  for (const double angle : {1e-8, 9.9e-4, 1.001e-3, 1e-2, 1.0, 3.0}) {
    INFO("angle " << angle);
    const Twist xi = random.twist(angle, kReach);
    CHECK((exp(xi).matrix() - matrix_exponential(xi)).norm() < 2e-15 * kReach);
    CHECK((log(exp(xi)) - xi).norm() < 2e-15 * kReach);
  }
}

TEST_CASE("exp undoes log and log never exceeds half a turn") {
  Random random(24);
  INFO("seed " << random.seed());
  for (const Point& point : points(random)) {
    INFO(point.name);
    const Pose X = exp(point.xi);
    const Twist xi = log(X);
    CHECK(pose_diff(exp(xi), X, 1e-13) == "");
    CHECK(xi.tail<3>().norm() <= kPi + 1e-15);
    // The other quaternion of the same rotation.
    const Quaterniond negative(-X.rotation().coeffs());
    const Twist xi_negative = log(Pose::trusted(negative, X.translation()));
    CHECK(pose_diff(exp(xi_negative), X, 1e-13) == "");
    CHECK(xi_negative.tail<3>().norm() <= kPi + 1e-15);
    if (X.rotation().w() != 0) CHECK((xi_negative - xi).norm() < 1e-15);
  }
}

TEST_CASE("log of an exact half turn has the length pi") {
  Random random(25);
  INFO("seed " << random.seed());
  for (int i = 0; i < 10; ++i) {
    const Vector3d axis = random.direction();
    for (const double w : {0.0, -0.0}) {
      const Pose X =
          Pose::trusted(Quaterniond(w, axis.x(), axis.y(), axis.z()), random.vector(2.0));
      const Twist xi = log(X);
      CHECK(std::abs(xi.tail<3>().norm() - kPi) < 1e-15);
      CHECK(xi.tail<3>().cross(axis).norm() < 1e-15);
      CHECK(pose_diff(exp(xi), X, 1e-14) == "");
    }
  }
}

TEST_CASE("log is exact on both sides of the half turn") {
  Random random(26);
  INFO("seed " << random.seed());
  for (const double gap : {1e-3, 1e-6, 1e-9, 1e-12}) {
    INFO("gap " << gap);
    const Twist short_way = random.twist(kPi - gap);
    const Twist long_way = random.twist(kPi + gap);
    CHECK((log(exp(short_way)) - short_way).norm() < 1e-13);
    // Beyond it the shorter way is the opposite one, of length 2π - θ.
    const double angle = log(exp(long_way)).tail<3>().norm();
    CHECK(std::abs(angle - (kPi - gap)) < 1e-14);
    CHECK(log(exp(long_way)).tail<3>().dot(long_way.tail<3>()) < 0);
  }
}

// ---- the adjoint

TEST_CASE("the adjoint moves a perturbation to the other side") {
  Random random(31);
  INFO("seed " << random.seed());
  for (const Point& a : points(random)) {
    for (const Point& b : points(random)) {
      INFO(a.name << " and " << b.name);
      const Pose X = exp(a.xi);
      CHECK(pose_diff(X * exp(b.xi) * X.inverse(), exp(adjoint(X) * b.xi), 1e-12) == "");
    }
  }
}

TEST_CASE("the adjoint is a homomorphism") {
  Random random(32);
  INFO("seed " << random.seed());
  CHECK(adjoint(Pose()) == Matrix6d::Identity());
  for (int i = 0; i < 50; ++i) {
    const Pose X = random.pose();
    const Pose Y = random.pose();
    CHECK((adjoint(X * Y) - adjoint(X) * adjoint(Y)).norm() < 1e-13);
    CHECK((adjoint(X.inverse()) * adjoint(X) - Matrix6d::Identity()).norm() < 1e-13);
  }
}

TEST_CASE("skew is the cross product") {
  Random random(33);
  INFO("seed " << random.seed());
  const Vector3d a = random.vector(2.0);
  const Vector3d b = random.vector(2.0);
  CHECK((skew(a) * b - a.cross(b)).norm() < 1e-15);
}

// ---- what comes from outside

std::string refusal(const Quaterniond& rotation, const Vector3d& translation) {
  const auto X = Pose::create(rotation, translation);
  if (X) return "";
  CHECK(X.error().code == Errc::kInvalidInput);
  return X.error().message;
}

TEST_CASE("create names the field that is not a finite number") {
  const double bad = GENERATE(as<double>{}, kNan, kInf, -kInf);
  const int i = GENERATE(range(0, 4));
  CAPTURE(bad, i);
  const std::string names[] = {"x", "y", "z", "w"};
  const auto axis = static_cast<std::size_t>(i);
  Quaterniond q = Quaterniond::Identity();
  q.coeffs()[i] = bad;
  CHECK(refusal(q, Vector3d::Zero()) == "rotation." + names[axis] + " is not a finite number");
  if (i == 3) return;
  Vector3d t = Vector3d::Zero();
  t[i] = bad;
  CHECK(refusal(Quaterniond::Identity(), t) ==
        "translation." + names[axis] + " is not a finite number");
}

TEST_CASE("create normalizes a rotation within 1e-3 of unit length") {
  Random random(41);
  INFO("seed " << random.seed());
  const Pose X = random.pose();
  for (const double norm : {0.9991, 0.999999, 1.0, 1.0009}) {
    CAPTURE(norm);
    const auto created = Pose::create(Quaterniond(norm * X.rotation().coeffs()), X.translation());
    REQUIRE(created);
    CHECK(std::abs(created->rotation().norm() - 1.0) < 1e-15);
    CHECK(pose_diff(*created, X, 1e-15) == "");
  }
}

TEST_CASE("create rejects a rotation that is not of unit length") {
  Random random(42);
  INFO("seed " << random.seed());
  const Quaterniond q = random.pose().rotation();
  for (const double norm : {0.0, 1e-200, 0.5, 0.998, 1.002, 2.0, 1e200}) {
    CAPTURE(norm);
    const std::string said = refusal(Quaterniond(norm * q.coeffs()), Vector3d::Zero());
    CAPTURE(said);
    CHECK(said.find("rotation has the norm") == 0);
    // The norm that is shown neither overflows nor vanishes.
    CHECK(said.find("inf") == std::string::npos);
    CHECK((said.find("norm 0,") != std::string::npos) == (norm == 0));
  }
}

TEST_CASE("create accepts translations up to 1e9 m") {
  const int i = GENERATE(range(0, 3));
  const double sign = GENERATE(1.0, -1.0);
  CAPTURE(i, sign);
  Vector3d t = Vector3d::Zero();
  t[i] = sign * 1e9;
  CHECK(refusal(Quaterniond::Identity(), t) == "");
  t[i] = sign * std::nextafter(1e9, kInf);
  const std::string name(1, "xyz"[i]);
  CHECK(refusal(Quaterniond::Identity(), t) == "translation." + name + " is beyond 1e9 m");
}

}  // namespace
}  // namespace tfdude
