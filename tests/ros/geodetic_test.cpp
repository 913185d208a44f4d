#include "tfdude-ros/logic/geodetic.hpp"

#include <cmath>
#include <limits>

#include "support/catch.hpp"
#include "tfdude-ros/logic/values.hpp"

namespace tfdude::ros {
namespace {

using testing::Approx;
using testing::ContainsSubstring;

constexpr double kDegree = 3.14159265358979323846 / 180;
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

// Of WGS84's axes, as every textbook has it.
Eigen::Vector3d earth_centred(double latitude, double longitude, double altitude) {
  const double a = 6378137.0;
  const double f = 1 / 298.257223563;
  const double e2 = f * (2 - f);
  const double sin = std::sin(latitude * kDegree);
  const double cos = std::cos(latitude * kDegree);
  const double n = a / std::sqrt(1 - e2 * sin * sin);
  return {(n + altitude) * cos * std::cos(longitude * kDegree),
          (n + altitude) * cos * std::sin(longitude * kDegree), (n * (1 - e2) + altitude) * sin};
}

// East, north and up in its columns.
Eigen::Matrix3d axes_at(double latitude, double longitude) {
  const double s = std::sin(latitude * kDegree);
  const double c = std::cos(latitude * kDegree);
  const double sl = std::sin(longitude * kDegree);
  const double cl = std::cos(longitude * kDegree);
  Eigen::Matrix3d R;
  R << -sl, -s * cl, c * cl,  //
      cl, -s * sl, c * sl,    //
      0, c, s;
  return R;
}

GeoPose fix(const std::optional<std::array<double, 9>>& covariance) {
  return {time_of(5), "gps_link", {48.137154, 11.576124, 519}, std::nullopt, covariance};
}

}  // namespace

TEST_CASE("ros geodetic: a fix is a position in the earth frame, and no rotation") {
  const auto value =
      geodetic_message(fix({{4, 1, 0, 1, 9, 0, 0, 0, 25}}), "/earth", "gps", "r1/", {});
  REQUIRE(value);
  CHECK(value->a == "r1/earth");
  CHECK(value->b == "r1/gps");
  CHECK(value->stamp == time_of(5));
  const Pose& X = value->X_AB.pose;
  CHECK((X.translation() - earth_centred(48.137154, 11.576124, 519)).norm() < 1e-6);
  const Eigen::Matrix3d axes = axes_at(48.137154, 11.576124);
  CHECK((X.rotation().toRotationMatrix() - axes).norm() < 1e-12);
  // Along the child's axes, which are east, north and up.
  const Matrix6d sigma = value->X_AB.covariance.if_complete()->matrix();
  Matrix6d expected = Matrix6d::Zero();
  expected.topLeftCorner<3, 3>() << 4, 1, 0, 1, 9, 0, 0, 0, 25;
  expected.diagonal().tail<3>().setConstant(kNoAngle);
  CHECK((sigma - expected).norm() < 1e-9);
}

TEST_CASE("ros geodetic: a covariance that is not known is unspecified, unless configured") {
  for (const auto& said : {std::optional<std::array<double, 9>>(),
                           std::optional<std::array<double, 9>>(std::array<double, 9>{})}) {
    const auto value = geodetic_message(fix(said), "earth", "gps", {}, {});
    REQUIRE(value);
    CHECK_FALSE(value->X_AB.covariance.complete());
    Variances variances;
    variances.stddev = StddevModel{{2, 2, 5, 1, 1, 1}};
    const auto configured = geodetic_message(fix(said), "earth", "gps", {}, variances);
    REQUIRE(configured);
    const Matrix6d sigma = configured->X_AB.covariance.if_complete()->matrix();
    CHECK(sigma(0, 0) == Approx(4));
    CHECK(sigma(2, 2) == Approx(25));
    CHECK(sigma(5, 5) == Approx(kNoAngle));  // a fix has no rotation, whatever is configured
  }
  // As for poses: -1 at first, and the largest double on an axis.
  CHECK_FALSE(geodetic_message(fix({{-1, 0, 0, 0, 1, 0, 0, 0, 1}}), "earth", "gps", {}, {})
                  ->X_AB.covariance.complete());
  const double huge = std::numeric_limits<double>::max();
  const auto flat = geodetic_message(fix({{1, 0, 0, 0, 1, 0, 0, 0, huge}}), "earth", "gps", {}, {});
  REQUIRE(flat);
  CHECK(flat->X_AB.covariance.if_complete()->matrix()(2, 2) == Approx(kNoPosition));
  CHECK_THAT(
      geodetic_message(fix({{-3, 0, 0, 0, 1, 0, 0, 0, 1}}), "earth", "gps", {}, {}).error().message,
      ContainsSubstring("covariance"));
}

TEST_CASE("ros geodetic: a pose has its rotation in the axes east, north and up") {
  GeoPose message{time_of(5), "any", {-33.9, 151.2, 40}};
  message.quat = {{0, 0, 0.6, 0.8}};
  ValueIn in;
  in.child = "map";
  const auto value = transform_of(in, message);
  REQUIRE(value);
  CHECK(value->parent == "earth");
  CHECK(value->child == "map");
  const Eigen::Matrix3d turned = axes_at(-33.9, 151.2) * Eigen::Quaterniond(0.8, 0, 0, 0.6);
  const auto& q = value->pose.quat;
  const Eigen::Matrix3d R = Eigen::Quaterniond(q[3], q[0], q[1], q[2]).toRotationMatrix();
  CHECK((R - turned).norm() < 1e-12);
  CHECK(value->covariance);
  CHECK_FALSE(value->covariance->complete());
  in.variances.stddev = StddevModel{{1, 2, 3, 0.1, 0.2, 0.3}};
  const auto known = transform_of(in, message);
  REQUIRE(known);
  // Along and about east, north and up, turned to the axes of the child.
  Matrix6d T = Matrix6d::Zero();
  T.topLeftCorner<3, 3>() = Eigen::Quaterniond(0.8, 0, 0, 0.6).toRotationMatrix();
  T.bottomRightCorner<3, 3>() = T.topLeftCorner<3, 3>();
  const Matrix6d ros = T * known->covariance->if_complete()->matrix() * T.transpose();
  CHECK(ros(1, 1) == Approx(4));
  CHECK(ros(5, 5) == Approx(0.09));
  message.quat = {{0, 0, 0, 0}};
  CHECK_THAT(transform_of(in, message).error().message, ContainsSubstring("rotation"));
}

TEST_CASE("ros geodetic: without a fix or with NaN there is no place") {
  GeoPose message = fix({});
  CHECK(has_place(message));
  message.fixed = false;
  CHECK_FALSE(has_place(message));
  for (std::size_t i = 0; i < 3; ++i) {
    message = fix({});
    message.place[i] = kNan;
    CHECK_FALSE(has_place(message));
  }
  message = fix({});
  message.place[0] = 91;
  CHECK(has_place(message));
  CHECK_THAT(geodetic_message(message, "earth", "gps", {}, {}).error().message,
             ContainsSubstring("latitude"));
}

TEST_CASE("ros geodetic: a measurement needs a covariance, and counts once") {
  PoseIn in;
  in.child = "base";
  CHECK_THAT(measurement_of(in, fix({})).error().message, ContainsSubstring("has none"));
  CHECK(measurement_of(in, fix({{1, 0, 0, 0, 1, 0, 0, 0, 1}})));
  CHECK(is_repeat(fix({}), fix({})));
  GeoPose other = fix({});
  other.place[2] = 520;
  CHECK_FALSE(is_repeat(other, fix({})));
  other = fix({});
  other.stamp = Time();
  CHECK_FALSE(is_repeat(other, other));
}

}  // namespace tfdude::ros
