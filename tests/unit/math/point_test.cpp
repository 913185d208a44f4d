#include "tfdude/math/point.hpp"

#include <cmath>
#include <limits>

#include "support/catch.hpp"
#include "support/random.hpp"
#include "support/sampling.hpp"

namespace tfdude {
namespace {

using testing::Gaussian;
using testing::Random;

Eigen::Matrix3d positive(Random& random, double deviation) {
  Eigen::Matrix3d A;
  std::generate_n(A.data(), A.size(), [&] { return random.normal(); });
  return deviation * deviation * (A * A.transpose() / 3 + 0.1 * Eigen::Matrix3d::Identity());
}

struct Moments {
  Eigen::VectorXd mean;
  Eigen::MatrixXd covariance;
};

// Of the coordinates of all points, stacked, over samples of the errors.
Moments sampled(const Transform& X_AB, const std::vector<Point>& points, Random& random,
                int samples) {
  const Gaussian pose(X_AB.covariance);
  std::vector<Gaussian> own;
  for (const Point& p : points) own.emplace_back(Eigen::MatrixXd(p.covariance));
  const auto size = static_cast<Eigen::Index>(3 * points.size());
  Moments moments{Eigen::VectorXd::Zero(size), Eigen::MatrixXd::Zero(size, size)};
  for (int n = 0; n < samples; ++n) {
    const Pose X = X_AB.pose * exp(Twist(pose(random)));
    Eigen::VectorXd all(size);
    for (std::size_t i = 0; i < points.size(); ++i) {
      const Eigen::Vector3d p = points[i].coordinates + Eigen::Vector3d(own[i](random));
      all.segment<3>(static_cast<Eigen::Index>(3 * i)) =
          points[i].direction ? Eigen::Vector3d(X.rotation() * p) : X * p;
    }
    moments.mean += all / samples;
    moments.covariance += all * all.transpose() / samples;
  }
  moments.covariance -= moments.mean * moments.mean.transpose();
  return moments;
}

Moments computed(const Transform& X_AB, const std::vector<Point>& points, Order order) {
  const Eigen::MatrixXd joint = joint_covariance(X_AB, points, order);
  Moments moments{Eigen::VectorXd(joint.rows()), joint};
  for (std::size_t i = 0; i < points.size(); ++i) {
    const TransformedPoint p_A = transform(X_AB, points[i], order);
    moments.mean.segment<3>(static_cast<Eigen::Index>(3 * i)) = p_A.coordinates + p_A.bias;
  }
  return moments;
}

double relative(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b) {
  return (a - b).norm() / b.norm();
}

std::vector<Point> some_points(Random& random, double deviation) {
  return {{{1.5, 0.2, -0.3}, positive(random, deviation), false},
          {{-0.4, 1.0, 0.6}, Eigen::Matrix3d::Zero(), false},
          {{0, 0, 1}, positive(random, deviation), true}};
}

TEST_CASE("point: mean and covariance of points and directions are those of samples") {
  Random random(811);
  INFO("seed " << random.seed());
  constexpr int kSamples = 200'000;
  const Transform X_AB{random.pose(), random.covariance(0.02, 0.02)};
  const auto points = some_points(random, 0.03);
  const Moments drawn = sampled(X_AB, points, random, kSamples);
  const Moments second = computed(X_AB, points, Order::kSecond);
  CHECK(relative(second.covariance, drawn.covariance) < 0.02);
  for (Eigen::Index i = 0; i < drawn.mean.size(); ++i) {
    const double error = std::sqrt(drawn.covariance(i, i) / kSamples);
    CHECK(std::abs(second.mean[i] - drawn.mean[i]) < 5 * error);
  }
  // Errors of one pose are shared: as independent points they would not agree.
  Eigen::MatrixXd alone = Eigen::MatrixXd::Zero(9, 9);
  for (int i = 0; i < 9; i += 3) alone.block<3, 3>(i, i) = second.covariance.block<3, 3>(i, i);
  CHECK(relative(alone, drawn.covariance) > 0.1);
}

TEST_CASE("point: fourth order agrees with samples where second order does not") {
  Random random(812);
  INFO("seed " << random.seed());
  constexpr int kSamples = 400'000;
  const Transform X_AB{random.pose(), random.covariance(0.2, 0.3)};
  const auto points = some_points(random, 0.2);
  const Moments drawn = sampled(X_AB, points, random, kSamples);
  const Moments second = computed(X_AB, points, Order::kSecond);
  const Moments fourth = computed(X_AB, points, Order::kFourth);
  CHECK(relative(fourth.covariance, drawn.covariance) <
        0.35 * relative(second.covariance, drawn.covariance));
  CHECK(relative(fourth.mean, drawn.mean) < 0.35 * relative(second.mean, drawn.mean));
  CHECK(testing::eigenvalues(fourth.covariance).minCoeff() > -1e-12);
}

TEST_CASE("point: the linear covariance is J Sigma J^T, and an origin has the translation's") {
  Random random(813);
  INFO("seed " << random.seed());
  const Transform X_AB = random.transform();
  const Eigen::Vector3d p = random.vector(2.0);
  Eigen::Matrix<double, 3, 6> J;
  J << Eigen::Matrix3d::Identity(), -skew(p);
  const Eigen::Matrix3d R = X_AB.pose.rotation().toRotationMatrix();
  const Matrix6d sigma = X_AB.covariance.of_specified().matrix();
  const TransformedPoint p_A = transform(X_AB, {p});
  CHECK((p_A.coordinates - X_AB.pose * p).norm() < 1e-15);
  REQUIRE(p_A.covariance() != nullptr);
  CHECK(relative(*p_A.covariance(), R * J * sigma * J.transpose() * R.transpose()) < 1e-13);
  const Eigen::Matrix3d at_origin = *transform(X_AB, Point{}).covariance();
  CHECK(relative(at_origin, R * sigma.topLeftCorner<3, 3>() * R.transpose()) < 1e-13);
}

TEST_CASE("point: of an unspecified transform no covariance is claimed") {
  const Transform X_AB{Pose(), StatedCovariance::unspecified()};
  CHECK(transform(X_AB, Point{}).covariance() == nullptr);
}

TEST_CASE("point: wrong values are named") {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  CHECK(check_point({{1, nan, 0}}).error().message == "coordinate 1 is not a number up to 1e9");
  Point negative;
  negative.covariance(1, 1) = -1;
  CHECK(check_point(negative).error().code == Errc::kInvalidInput);
  CHECK(check_point({{1, 2, 3}, Eigen::Matrix3d::Identity()}).has_value());
  const double huge = std::numeric_limits<double>::max();
  CHECK(check_point({{1, 2, 3}, huge * Eigen::Matrix3d::Identity()}).error().message ==
        "covariance[0][0] is 1.79769e+308, which is beyond 1e18");
}

}  // namespace
}  // namespace tfdude
