#include <algorithm>
#include <cmath>

#include "tfdude/math/pose.hpp"

#include "support/catch.hpp"
#include "support/pose_diff.hpp"
#include "support/random.hpp"

namespace tfdude {
namespace {

using Eigen::Matrix3d;
using Eigen::Quaterniond;
using Eigen::Vector3d;
using testing::angle_between;
using testing::Random;

constexpr double kPi = 3.14159265358979323846;

Quaterniond from_rpy_vector(const Vector3d& rpy) { return from_rpy(rpy.x(), rpy.y(), rpy.z()); }

TEST_CASE("rpy turns about fixed axes as in URDF") {
  Random random(51);
  INFO("seed " << random.seed());
  for (int i = 0; i < 50; ++i) {
    const Vector3d rpy = random.vector(kPi);
    const double cr = std::cos(rpy.x()), sr = std::sin(rpy.x());
    const double cp = std::cos(rpy.y()), sp = std::sin(rpy.y());
    const double cy = std::cos(rpy.z()), sy = std::sin(rpy.z());
    const Matrix3d Rx = (Matrix3d() << 1, 0, 0, 0, cr, -sr, 0, sr, cr).finished();
    const Matrix3d Ry = (Matrix3d() << cp, 0, sp, 0, 1, 0, -sp, 0, cp).finished();
    const Matrix3d Rz = (Matrix3d() << cy, -sy, 0, sy, cy, 0, 0, 0, 1).finished();
    CHECK((from_rpy_vector(rpy).toRotationMatrix() - Rz * Ry * Rx).norm() < 1e-14);
  }
}

TEST_CASE("roll comes first and yaw last") {
  const double quarter = kPi / 2;
  const Vector3d x = Vector3d::UnitX();
  const Vector3d y = Vector3d::UnitY();
  const Vector3d z = Vector3d::UnitZ();
  CHECK((from_rpy(quarter, 0, 0) * y - z).norm() < 1e-15);
  CHECK((from_rpy(0, quarter, 0) * z - x).norm() < 1e-15);
  CHECK((from_rpy(0, 0, quarter) * x - y).norm() < 1e-15);
  // Roll takes y to z, where yaw does nothing; the other way round it would end at -x.
  CHECK((from_rpy(quarter, 0, quarter) * y - z).norm() < 1e-15);
}

TEST_CASE("to_rpy gives back the angles") {
  Random random(52);
  INFO("seed " << random.seed());
  CHECK(to_rpy(Quaterniond::Identity()) == Vector3d::Zero());
  for (int i = 0; i < 200; ++i) {
    const Vector3d rpy(random.uniform(-3.1, 3.1), random.uniform(-1.5, 1.5),
                       random.uniform(-3.1, 3.1));
    const Quaterniond q = from_rpy_vector(rpy);
    CHECK((to_rpy(q) - rpy).norm() < 1e-13);
    CHECK((to_rpy(Quaterniond(-q.coeffs())) - rpy).norm() < 1e-13);
  }
}

TEST_CASE("to_rpy keeps the angles of tiny rotations") {
  const Vector3d rpy(1e-9, -2e-9, 3e-9);
  CHECK((to_rpy(from_rpy_vector(rpy)) - rpy).norm() < 1e-16);
}

TEST_CASE("every rotation survives rpy to rounding") {
  Random random(53);
  INFO("seed " << random.seed());
  for (int i = 0; i < 200; ++i) {
    const Quaterniond q = random.pose().rotation();
    const Vector3d rpy = to_rpy(q);
    CHECK(angle_between(from_rpy_vector(rpy), q) < 2e-15);
    CHECK(std::abs(rpy.y()) <= kPi / 2);
  }
}

TEST_CASE("rotations near gimbal lock survive rpy to rounding") {
  // Roll and yaw are each known badly there, their sum or difference must not be.
  Random random(54);
  INFO("seed " << random.seed());
  const double side = GENERATE(1.0, -1.0);
  const double gap = GENERATE(1e-3, 1e-5, 1e-7, 1e-8, 1e-9, 1e-10, 1e-11, 1e-12, 1e-13, 1e-15);
  CAPTURE(side, gap);
  double worst = 0;
  for (int i = 0; i < 200; ++i) {
    const Vector3d rpy(random.uniform(-kPi, kPi), side * (kPi / 2 - gap),
                       random.uniform(-kPi, kPi));
    const Quaterniond q = from_rpy_vector(rpy);
    worst = std::max(worst, angle_between(from_rpy_vector(to_rpy(q)), q));
  }
  // Within 1e-12 of the lock roll is dropped, which costs no more than that.
  CHECK(worst < (gap > 1e-11 ? 1e-14 : 3e-12));
}

TEST_CASE("at gimbal lock roll is zero and yaw takes all") {
  const double up = kPi / 2;
  const Vector3d above = to_rpy(from_rpy(0.3, up, 0.5));
  CHECK(above.x() == 0.0);
  CHECK(std::abs(above.y() - up) < 1e-7);  // the cosine of the pitch has no digits left
  CHECK(std::abs(above.z() - 0.2) < 1e-14);
  const Vector3d below = to_rpy(from_rpy(0.3, -up, 0.5));
  CHECK(below.x() == 0.0);
  CHECK(std::abs(below.y() + up) < 1e-7);
  CHECK(std::abs(below.z() - 0.8) < 1e-14);
}

}  // namespace
}  // namespace tfdude
