#include <cmath>
#include <limits>
#include <string>

#include "tfdude/math/ros_variances.hpp"

#include "support/catch.hpp"
#include "tfdude-ros/logic/names.hpp"
#include "tfdude-ros/logic/values.hpp"

namespace tfdude::ros {
namespace {

using testing::Approx;
using testing::ContainsSubstring;
using RowMajor = Eigen::Matrix<double, 6, 6, Eigen::RowMajor>;
using Numbers = std::array<double, 36>;

constexpr double kHuge = std::numeric_limits<double>::max();

Pose turned() { return *Pose::create(from_rpy(0.4, -0.8, 1.2), Eigen::Vector3d(1, -2, 3)); }

Numbers diagonal(const std::array<double, 6>& variances) {
  Numbers numbers{};
  for (std::size_t i = 0; i < 6; ++i) numbers[7 * i] = variances[i];
  return numbers;
}

Numbers numbers_of(const Matrix6d& sigma) {
  Numbers numbers{};
  Eigen::Map<RowMajor>(numbers.data()) = sigma;
  return numbers;
}

// The standard deviations as the message has them: along the axes of its frame.
std::array<double, 6> stddev_of(const Pose& X, const Transform& out) {
  const Matrix6d sigma = out.covariance.of_specified().matrix();
  Matrix6d T = Matrix6d::Zero();
  T.topLeftCorner<3, 3>() = X.rotation().toRotationMatrix();
  T.bottomRightCorner<3, 3>() = T.topLeftCorner<3, 3>();
  const Matrix6d ros = T * sigma * T.transpose();
  std::array<double, 6> stddev{};
  for (int i = 0; i < 6; ++i) stddev[static_cast<std::size_t>(i)] = std::sqrt(ros(i, i));
  return stddev;
}

}  // namespace

// The message says of p = p̄ + δp, R = Exp(δθ) R̄ how δ varies. Ours is of X = X̄ Exp(ξ). So ξ is a
// function of δ, whose derivative is computed numerically here, from the definitions.
TEST_CASE("ros variances: the covariance is that of a numeric derivative") {
  const Pose X = turned();
  constexpr double kStep = 1e-6;
  Matrix6d J;
  for (int k = 0; k < 6; ++k) {
    Twist column = Twist::Zero();
    for (const double sign : {1.0, -1.0}) {
      Twist delta = Twist::Zero();
      delta[k] = sign * kStep;
      const Eigen::Vector3d turn = delta.tail<3>();
      const double angle = turn.norm();
      Eigen::Quaterniond q = X.rotation();
      if (angle > 0) q = Eigen::Quaterniond(Eigen::AngleAxisd(angle, turn / angle)) * q;
      const Pose moved = *Pose::create(q, X.translation() + delta.head<3>());
      column += sign * log(X.inverse() * moved) / (2 * kStep);
    }
    J.col(k) = column;
  }
  Matrix6d A;
  for (int i = 0; i < 6; ++i) {
    for (int j = 0; j < 6; ++j) A(i, j) = 1e-2 * std::cos(1 + 2 * i + 5 * j + i * j);
  }
  const Matrix6d ros = A * A.transpose();
  const auto out = with_ros_covariance(X, {}, numbers_of(ros));
  REQUIRE(out);
  REQUIRE(out->covariance.complete());
  const Matrix6d expected = J * ros * J.transpose();
  CHECK((out->covariance.of_specified().matrix() - expected).norm() < 1e-8 * expected.norm());
}

TEST_CASE("ros variances: what zeros and -1 mean is set for each topic") {
  const Pose X = turned();
  Variances variances;
  const auto is_complete = [&](const Numbers& numbers) {
    const auto out = with_ros_covariance(X, variances, numbers);
    REQUIRE(out);
    return out->covariance.complete();
  };
  Numbers minus_one{};
  minus_one[0] = -1;
  CHECK(!is_complete({}));
  CHECK(!is_complete(minus_one));
  variances.all_zero_is_exact = true;
  CHECK(is_complete({}));
  CHECK(with_ros_covariance(X, variances, {})->covariance == StatedCovariance::exact());
  variances.minus_one_is_none = true;
  CHECK(is_complete(minus_one));
}

TEST_CASE("ros variances: an axis without information has more than any robot's") {
  const Pose X;
  // As AMCL, robot_localization and others: planar, with z, roll and pitch as the case may be.
  for (const double unknown : {kHuge, 1e6, 1e9, -1.0, std::numeric_limits<double>::infinity()}) {
    CAPTURE(unknown);
    Numbers numbers = diagonal({0.04, 0.01, unknown, unknown, unknown, 0.0025});
    numbers[1] = numbers[6] = 0.005;
    const auto out = with_ros_covariance(X, {}, numbers);
    REQUIRE(out);
    const auto stddev = stddev_of(X, *out);
    CHECK(stddev[0] == Approx(0.2));
    CHECK(stddev[2] == Approx(1000));
    CHECK(stddev[3] == Approx(10));
    CHECK(stddev[5] == Approx(0.05));
    CHECK(out->covariance.of_specified().matrix()(0, 1) == Approx(0.005));
  }
}

TEST_CASE("ros variances: beside an axis without information the others keep their digits") {
  const Pose X = turned();
  const auto out = with_ros_covariance(X, {}, diagonal({1e-8, 1e-8, kHuge, kHuge, 1e-10, 1e-10}));
  REQUIRE(out);
  const auto stddev = stddev_of(X, *out);
  CHECK(stddev[0] == Approx(1e-4).epsilon(0.01));
  CHECK(stddev[5] == Approx(1e-5).epsilon(0.01));
}

TEST_CASE("ros variances: zeros on some axes are exact, or say nothing") {
  const Pose X;
  Variances variances;
  const Numbers planar = diagonal({0.04, 0.01, 0, 0, 0, 0.0025});
  CHECK(stddev_of(X, *with_ros_covariance(X, variances, planar))[2] == 0);
  variances.zero_is_none = true;
  CHECK(stddev_of(X, *with_ros_covariance(X, variances, planar))[3] == Approx(10));
  variances = {};
  variances.none_from = 9999;
  const auto odd = with_ros_covariance(X, variances, diagonal({1, 1, 9999, 9999, 1, 1}));
  CHECK(stddev_of(X, *odd)[2] == Approx(1000));
}

TEST_CASE("ros variances: a model stands in for zeros, by distance and angle") {
  StddevModel model;
  model.constant = {0.001, 0.001, 0.002, 0.01, 0.01, 0.005};
  model.per_metre = {0, 0, 0.01, 0, 0, 0};
  model.per_radian = {0, 0, 0, 0.1, 0, 0};
  Variances variances;
  variances.stddev = model;
  // Two metres ahead of a camera, turned away by 0.5 rad.
  const Pose X = *Pose::create(from_rpy(0.5, 0, 0), Eigen::Vector3d(0, 0, 2));
  const auto out = with_ros_covariance(X, variances, {});
  REQUIRE(out);
  CHECK(out->covariance.complete());
  const auto stddev = stddev_of(X, *out);
  CHECK(stddev[0] == Approx(0.001));
  CHECK(stddev[2] == Approx(0.022));
  CHECK(stddev[3] == Approx(0.06));
  CHECK(stddev[5] == Approx(0.005));
  // What a message says itself stays.
  const auto partly = with_ros_covariance(X, variances, diagonal({0.25, 0, 0, 0, 0, 0}));
  CHECK(stddev_of(X, *partly)[0] == Approx(0.5));
  CHECK(stddev_of(X, *partly)[2] == Approx(0.022));
  // Flipped, or from where the tag is: the same angle; and no division by zero.
  CHECK(stddev_at(model, *Pose::create(from_rpy(0.5 + std::acos(-1.0), 0, 0), {0, 0, 2}))[3] ==
        Approx(0.06));
  CHECK(stddev_at(model, Pose())[3] == Approx(0.01));
}

TEST_CASE("ros variances: singular matrices, and those rounded to float32, are taken") {
  const Pose X = turned();
  Matrix6d A;
  for (int i = 0; i < 6; ++i) {
    for (int j = 0; j < 6; ++j) A(i, j) = 1e-2 * std::sin(1 + 5 * i + 3 * j + i * j);
  }
  const int rank = GENERATE(1, 2, 3, 5);
  CAPTURE(rank);
  const Matrix6d sigma = A.leftCols(rank) * A.leftCols(rank).transpose();
  const Matrix6d rounded = sigma.cast<float>().cast<double>();
  for (const Matrix6d& one : {sigma, rounded}) {
    const auto out = with_ros_covariance(X, {}, numbers_of(one));
    REQUIRE(out);
    CHECK(out->covariance.of_specified().matrix().trace() == Approx(sigma.trace()).epsilon(1e-5));
  }
}

TEST_CASE("ros variances: what is no covariance is rejected") {
  const auto why = [](const Numbers& numbers) {
    const auto out = with_ros_covariance(Pose(), {}, numbers);
    return out ? std::string() : out.error().message;
  };
  CHECK_THAT(why(diagonal({1, -0.5, 1, 1, 1, 1})), ContainsSubstring("negative variance"));
  CHECK_THAT(why(diagonal({1, std::nan(""), 1, 1, 1, 1})), ContainsSubstring("finite"));
  Numbers numbers = diagonal({1, 1, 1, 1, 1, 1});
  numbers[1] = 0.5;
  CHECK_THAT(why(numbers), ContainsSubstring("symmetric"));
  numbers[6] = 0.5;
  CHECK(why(numbers).empty());
  numbers[1] = numbers[6] = 2;
  CHECK_THAT(why(numbers), ContainsSubstring("semi-definite"));
}

TEST_CASE("ros values: a pose of an edge is a transform with a covariance") {
  const ValueIn in{"/pose", false, "base", "", "r1/"};
  PoseWithCovariance message{time_of(7), "/map", ros_pose_of(turned()), {}};
  const auto zero = transform_of(in, message, "base");
  REQUIRE(zero);
  REQUIRE(zero->covariance);
  CHECK(!zero->covariance->complete());
  message.covariance = diagonal({1, 1, 1, 1, 1, 1});
  const auto value = transform_of(in, message, "base");
  REQUIRE(value);
  CHECK(value->covariance->complete());
  CHECK(value->stamp == time_of(7));
  CHECK(value->parent == "/map");
  CHECK(value_of(in, message, "base")->a == "r1/map");
  message.frame.clear();
  CHECK(!transform_of(in, message, "base"));
}

}  // namespace tfdude::ros
