#include "tfdude-ros/logic/poses.hpp"

#include <cmath>
#include <random>
#include <string>

#include "support/catch.hpp"
#include "support/sampling.hpp"

namespace tfdude::ros {
namespace {

using testing::Approx;
using testing::ContainsSubstring;
using Matrix = Eigen::Matrix<double, 6, 6, Eigen::RowMajor>;

Covariance covariance() {
  Matrix6d A;
  for (int i = 0; i < 6; ++i) {
    for (int j = 0; j < 6; ++j) A(i, j) = 1e-3 * std::sin(1 + 5 * i + 3 * j + i * j);
  }
  Matrix6d sigma = A * A.transpose();
  sigma.diagonal().array() += 1e-7;
  return *Covariance::from_matrix(sigma);
}

StampedTransform example() {
  StampedTransform X;
  X.pose = *Pose::create(from_rpy(0.4, -0.8, 1.2), Eigen::Vector3d(1, -2, 3));
  X.covariance = covariance();
  X.stamp = time_of(5'000'000'000);
  return X;
}

const PoseOut kOut{"/tool_pose", "r1/base", "r1/tool", "r1/"};
const PoseIn kIn{"/pose", false, "tool", "r1/"};

}  // namespace

// p = p̄ + δp, R = Exp(δθ) R̄: what a reader of geometry_msgs/PoseWithCovariance expects.
TEST_CASE("ros poses: the covariance sent is that of samples about the fixed axes of the frame") {
  const StampedTransform X = example();
  const auto message = message_of(kOut, X, Time());
  REQUIRE(message);
  std::mt19937_64 random(20);  // NOLINT(cert-msc51-cpp): the same each time
  std::normal_distribution<double> normal;
  const Matrix6d L = testing::cholesky_root(covariance().matrix());
  constexpr int kSamples = 200'000;
  Matrix6d moment = Matrix6d::Zero();
  const Pose back = X.pose.inverse();
  for (int i = 0; i < kSamples; ++i) {
    Twist unit;
    for (int k = 0; k < 6; ++k) unit[k] = normal(random);
    const Pose sample = X.pose * exp(Twist(L * unit));
    const Eigen::AngleAxisd turn(sample.rotation() * back.rotation());
    Twist error;
    error << sample.translation() - X.pose.translation(), turn.angle() * turn.axis();
    moment += error * error.transpose() / kSamples;
  }
  const Matrix sent = Eigen::Map<const Matrix>(message->covariance.data());
  for (int i = 0; i < 6; ++i) {
    for (int j = 0; j < 6; ++j) {
      CAPTURE(i, j);
      const double scale = std::sqrt(sent(i, i) * sent(j, j));
      CHECK(std::abs(sent(i, j) - moment(i, j)) < 0.015 * scale);
    }
  }
}

TEST_CASE("ros poses: a message is the measurement that it was made of") {
  const StampedTransform X = example();
  const auto message = message_of(kOut, X, Time());
  REQUIRE(message);
  CHECK(message->frame == "base");
  CHECK(message->stamp == X.stamp);
  const auto back = measurement_of(kIn, *message, "tool");
  REQUIRE(back);
  CHECK(back->a == "r1/base");
  CHECK(back->b == "r1/tool");
  CHECK(back->stamp == X.stamp);
  const auto* sigma = back->X_AB.covariance.if_complete();
  REQUIRE(sigma != nullptr);
  CHECK((sigma->matrix() - covariance().matrix()).norm() < 1e-12 * covariance().matrix().norm());
}

TEST_CASE("ros poses: a path with an unspecified edge is not sent") {
  StampedTransform X = example();
  X.covariance = StatedCovariance::incomplete(covariance());
  CHECK(!message_of(kOut, X, Time()));
}

TEST_CASE("ros poses: odometry has the velocity in the axes of the child") {
  StampedTransform X = example();
  X.pose = *Pose::create(from_rpy(0, 0, std::acos(-1.0) / 2), Eigen::Vector3d(1, 0, 0));
  Velocity velocity;
  velocity.linear = {0, 2, 0};  // the child's x points along the frame's y
  velocity.angular = {0, 0, 3};
  velocity.covariance = *Covariance::from_stddev({1, 2, 3, 4, 5, 6});
  const auto message = message_of(kOut, X, velocity, Time());
  REQUIRE(message);
  CHECK(message->child == "tool");
  CHECK(message->linear[0] == Approx(2));
  CHECK(message->angular[2] == Approx(3));
  CHECK(message->twist_covariance[0] == Approx(4));
  CHECK(message->twist_covariance[7] == Approx(1));
  CHECK(message->twist_covariance[21] == Approx(25));
  velocity.covariance = StatedCovariance::unspecified();
  CHECK(!message_of(kOut, X, velocity, Time()));
}

TEST_CASE("ros poses: a static path has the time of the message") {
  StampedTransform X = example();
  X.stamp.reset();
  CHECK(message_of(kOut, X, time_of(9))->stamp == time_of(9));
}

TEST_CASE("ros poses: a message without a usable covariance is no measurement") {
  PoseWithCovariance message = *message_of(kOut, example(), Time());
  message.stamp = Time();
  CHECK(!measurement_of(kIn, message, "tool")->stamp);
  // Without a stamp, it may be another measurement with the same result.
  CHECK(!is_repeat(message, message));
  message.stamp = time_of(7);
  PoseWithCovariance other = message;
  CHECK(is_repeat(other, message));
  other.pose.xyz[0] += 1e-3;
  CHECK(!is_repeat(other, message));
  const auto why = [&] { return measurement_of(kIn, message, "tool").error().message; };
  message.covariance[1] += 1;
  CHECK_THAT(why(), ContainsSubstring("symmetric"));
  message.covariance = {};
  CHECK_THAT(why(), ContainsSubstring("has none"));
  message.covariance[0] = -1;
  CHECK_THAT(why(), ContainsSubstring("has none"));
  message.covariance[0] = std::numeric_limits<double>::max();
  // Such a variance says nothing of its axis, which is no error.
  CHECK(measurement_of(kIn, message, "tool"));
  message.covariance[0] = 1;
  message.pose.quat = {};
  CHECK_THAT(why(), ContainsSubstring("quaternion"));
  message.frame.clear();
  CHECK(!measurement_of(kIn, message, "tool"));
}

}  // namespace tfdude::ros
