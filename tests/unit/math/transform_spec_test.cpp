#include "tfdude/math/transform_spec.hpp"

#include <cmath>
#include <limits>
#include <string>

#include "support/catch.hpp"
#include "support/pose_diff.hpp"
#include "support/random.hpp"

namespace tfdude {
namespace {

using testing::pose_diff;
using testing::Random;
using testing::transform_diff;

constexpr double kInf = std::numeric_limits<double>::infinity();
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

// The message of a rejection; empty where the spec is accepted.
std::string refusal(const TransformSpec& spec) {
  const auto X = spec.build();
  if (X) return "";
  CHECK(X.error().code == Errc::kInvalidInput);
  return X.error().message;
}

bool contains(const std::string& text, std::string_view part) {
  return text.find(part) != std::string::npos;
}

Covariance::Upper identity_upper() { return Covariance::trusted(Matrix6d::Identity()).upper(); }

TEST_CASE("an empty spec is the identity of unspecified covariance") {
  const TransformSpec spec;
  CHECK(spec.empty());
  const auto X = spec.build();
  REQUIRE(X);
  CHECK(transform_diff(*X, Transform{}, 0.0) == "");
  CHECK_FALSE(X->covariance.complete());
  CHECK(transform_diff(*spec.build(StatedCovariance::exact()), Transform::exact({}), 0.0) == "");
}

TEST_CASE("a spec with any field is not empty") {
  TransformSpec spec;
  SECTION("xyz") { spec.xyz.emplace(); }
  SECTION("rpy") { spec.rpy.emplace(); }
  SECTION("quat") { spec.quat = {0, 0, 0, 1}; }
  SECTION("stddev") { spec.stddev.emplace(); }
  SECTION("cov") { spec.cov.emplace(); }
  CHECK_FALSE(spec.empty());
  const auto X = spec.build(StatedCovariance::exact());
  REQUIRE(X);
  CHECK(transform_diff(*X, Transform::exact({}), 0.0) == "");
}

TEST_CASE("a matrix is the pose that it has row by row") {
  Random random(402);
  INFO("seed " << random.seed());
  const Pose X_AB = random.pose();
  TransformSpec spec;
  const Eigen::Matrix<double, 4, 4, Eigen::RowMajor> rows = X_AB.matrix();
  spec.matrix.emplace();
  std::copy_n(rows.data(), rows.size(), spec.matrix->begin());
  CHECK_FALSE(spec.empty());
  CHECK(pose_diff(spec.build()->pose, X_AB, 1e-14) == "");
  SECTION("no rotation") {
    (*spec.matrix)[0] += 1e-3;
    CHECK(refusal(spec) == "matrix: the upper left 3x3 is not a rotation");
  }
  SECTION("a reflection") {
    for (const std::size_t i : {0U, 1U, 2U}) (*spec.matrix)[i] *= -1;
    CHECK(refusal(spec) == "matrix: the upper left 3x3 is not a rotation");
  }
  SECTION("by columns") {
    (*spec.matrix)[12] = 1;
    CHECK(refusal(spec) == "matrix: the last row must be 0 0 0 1");
  }
  SECTION("not a number") {
    (*spec.matrix)[3] = kNan;
    CHECK(contains(refusal(spec), "translation.x is not a finite number"));
  }
  SECTION("beside xyz") {
    spec.xyz.emplace();
    CHECK(contains(refusal(spec), "matrix is given beside"));
  }
}

TEST_CASE("xyz alone is a translation") {
  TransformSpec spec;
  spec.xyz = {1, 2, 3};
  const auto X = spec.build();
  REQUIRE(X);
  CHECK(X->pose.translation() == Eigen::Vector3d(1, 2, 3));
  CHECK(X->pose.rotation().coeffs() == Eigen::Quaterniond::Identity().coeffs());
  CHECK(X->covariance.of_specified().matrix() == Matrix6d::Zero());
}

TEST_CASE("rpy is roll and pitch and yaw") {
  TransformSpec spec;
  spec.rpy = {0.1, 0.2, 0.3};
  const auto X = spec.build();
  REQUIRE(X);
  const Pose expected = Pose::trusted(from_rpy(0.1, 0.2, 0.3), Eigen::Vector3d::Zero());
  CHECK(pose_diff(X->pose, expected, 1e-15) == "");
}

TEST_CASE("quat is x and y and z and w") {
  TransformSpec spec;
  spec.xyz = {1, 0, 0};
  spec.quat = {0.1, 0.1, 0.7, 0.7};
  const auto X = spec.build();
  REQUIRE(X);
  CHECK((X->pose.rotation().vec() - Eigen::Vector3d(0.1, 0.1, 0.7)).norm() < 1e-15);
  CHECK(std::abs(X->pose.rotation().w() - 0.7) < 1e-15);
}

TEST_CASE("quat is normalized when close to unit length and rejected otherwise") {
  TransformSpec spec;
  spec.quat = {0, 0, 0.7071, 0.7071};
  const auto X = spec.build();
  REQUIRE(X);
  CHECK(std::abs(X->pose.rotation().norm() - 1.0) < 1e-15);
  spec.quat = {0, 0, 0, 0};
  CHECK(contains(refusal(spec), "rotation has the norm"));
  spec.quat = {0, 0, 1, 1};
  CHECK(contains(refusal(spec), "rotation has the norm"));
}

TEST_CASE("stddev is the root of the diagonal") {
  TransformSpec spec;
  spec.stddev = {0.1, 0.2, 0.3, 0.4, 0.5, 0.6};
  const auto X = spec.build();
  REQUIRE(X);
  CHECK(std::abs(X->covariance.of_specified().matrix()(1, 1) - 0.04) < 1e-16);
  CHECK(std::abs(X->covariance.of_specified().matrix()(5, 5) - 0.36) < 1e-16);
  CHECK(X->covariance.of_specified().matrix()(1, 5) == 0.0);
}

TEST_CASE("cov is the upper triangle") {
  Random random(401);
  INFO("seed " << random.seed());
  const Covariance sigma = random.covariance();
  TransformSpec spec;
  spec.cov = sigma.upper();
  const auto X = spec.build();
  REQUIRE(X);
  CHECK(X->covariance.of_specified().upper() == sigma.upper());
}

TEST_CASE("a second rotation or a second covariance is rejected") {
  TransformSpec spec;
  SECTION("rotations") {
    spec.rpy = {0, 0, 0};
    spec.quat = {0, 0, 0, 1};
    CHECK(contains(refusal(spec), "rpy and quat"));
  }
  SECTION("covariances") {
    spec.stddev = {0, 0, 0, 0, 0, 0};
    spec.cov = identity_upper();
    CHECK(contains(refusal(spec), "stddev and cov"));
  }
}

TEST_CASE("a number that is not finite is rejected by its element") {
  const double bad = GENERATE(as<double>{}, kNan, kInf, -kInf);
  CAPTURE(bad);
  TransformSpec spec;
  for (std::size_t i = 0; i < 3; ++i) {
    spec = {};
    spec.xyz.emplace()[i] = bad;
    CHECK(refusal(spec) == std::string("translation.") + "xyz"[i] + " is not a finite number");
    spec = {};
    spec.rpy.emplace()[i] = bad;
    CHECK(refusal(spec) == "rpy[" + std::to_string(i) + "] is not a finite number");
  }
  for (std::size_t i = 0; i < 4; ++i) {
    spec = {};
    spec.quat = {0, 0, 0, 1};
    (*spec.quat)[i] = bad;
    CHECK(refusal(spec) == std::string("rotation.") + "xyzw"[i] + " is not a finite number");
  }
  for (std::size_t i = 0; i < 6; ++i) {
    spec = {};
    spec.stddev.emplace()[i] = bad;
    CHECK(refusal(spec) == "stddev[" + std::to_string(i) + "] is not a finite number");
  }
  spec = {};
  spec.cov = identity_upper();
  (*spec.cov)[upper_index(2, 4)] = bad;
  CHECK(refusal(spec) == "covariance[2][4] is not a finite number");
}

TEST_CASE("values out of range are rejected by their element") {
  TransformSpec spec;
  SECTION("translation") {
    spec.xyz = {0, -1.1e9, 0};
    CHECK(refusal(spec) == "translation.y is beyond 1e9 m");
  }
  SECTION("negative standard deviation") {
    spec.stddev = {0, 0, 0, -1e-3, 0, 0};
    CHECK(refusal(spec) == "stddev[3] is negative");
  }
  SECTION("standard deviation") {
    spec.stddev = {0, 0, 1.1e9, 0, 0, 0};
    CHECK(refusal(spec) == "stddev[2] is 1.1e+09, which is beyond 1e9");
  }
  SECTION("negative variance") {
    spec.cov = identity_upper();
    (*spec.cov)[upper_index(3, 3)] = -1;
    CHECK(refusal(spec) == "covariance[3][3] is a negative variance");
  }
  SECTION("variance") {
    spec.cov = identity_upper();
    (*spec.cov)[upper_index(5, 5)] = 1.1e18;
    CHECK(refusal(spec) == "covariance[5][5] is 1.1e+18, which is beyond 1e18");
  }
  SECTION("correlation") {
    spec.cov = identity_upper();
    (*spec.cov)[upper_index(0, 4)] = 1.1;
    CHECK(contains(refusal(spec), "covariance[0][4]"));
  }
}

TEST_CASE("large angles are accepted") {
  TransformSpec spec;
  spec.rpy = {100.0, -7.0, 1e6};
  const auto X = spec.build();
  REQUIRE(X);
  CHECK(std::abs(X->pose.rotation().norm() - 1.0) < 1e-15);
}

}  // namespace
}  // namespace tfdude
