// Clouds of points: beside single points, and with a stamp a point.

#include <string>
#include <thread>
#include <vector>

#include "tfdude/client/client.hpp"
#include "tfdude/client/node.hpp"
#include "tfdude/math/point.hpp"

#include "support/catch.hpp"
#include "support/networks.hpp"
#include "support/random.hpp"

namespace tfdude {
namespace {

using testing::ContainsSubstring;
using testing::Random;

Time instant(int ms) { return Time(std::chrono::seconds(1'000'000)) + Milliseconds(ms); }

// A lidar on a base that drives in odom, with an uncertain mount of another owner.
struct Car {
  Car(const testing::Join& join, Random& random)
      : base(Node::open(join("base"), "base", {{"odom", "", {}}, {"base", "odom", {}}}).value()),
        sensors(Node::open(join("sensors"), "sensors", {{"lidar", "base", random.transform()}})
                    .value()) {
    for (int i = 0; i <= 10; ++i) {
      const Twist turn = random.twist(0.1, 1.0);
      REQUIRE(base.update("base", {tfdude::exp(turn), random.covariance()}, instant(10 * i)));
    }
  }
  Node base;
  Node sensors;
};

std::array<double, 6> upper(const Eigen::Matrix3d& m) {
  return {m(0, 0), m(0, 1), m(0, 2), m(1, 1), m(1, 2), m(2, 2)};
}

double difference(const Eigen::Matrix<double, 6, 1>& got, const Eigen::Matrix3d& expected) {
  const auto u = upper(expected);
  return (got - Eigen::Map<const Eigen::Matrix<double, 6, 1>>(u.data())).norm() / expected.norm();
}

}  // namespace

TEST_CASE("clouds: each point as by transform(), in double and single precision") {
  const auto join = testing::join_loopback();
  Random random(4605);
  INFO("seed " << random.seed());
  Car car(join, random);
  auto client = Client::open(join(""));
  REQUIRE(client);
  const auto X = client->lookup("odom", "lidar", Query{});
  REQUIRE(X);
  CloudQuery query;
  query.covariances = true;
  query.own = random.covariance().matrix().topLeftCorner<3, 3>();
  for (const Eigen::Index count : {0, 1, 3, 4, 5, 63}) {
    INFO(count << " points");
    Eigen::Matrix3Xd points(3, count);
    for (Eigen::Index i = 0; i < count; ++i) points.col(i) = random.vector(20);
    const auto cloud = client->transform_cloud("odom", "lidar", points, query);
    const Eigen::Matrix3Xf narrow = points.cast<float>();
    const auto single = client->transform_cloud("odom", "lidar", narrow, query);
    REQUIRE((cloud && single));
    REQUIRE(cloud->points.cols() == count);
    CHECK(cloud->complete);
    for (Eigen::Index i = 0; i < count; ++i) {
      const TransformedPoint expected = transform(*X, Point{points.col(i), query.own});
      CHECK((cloud->points.col(i) - expected.coordinates).norm() < 1e-12);
      CHECK(difference(cloud->covariances.col(i), expected.of_specified) < 1e-12);
      CHECK((single->points.col(i).cast<double>() - expected.coordinates).norm() < 1e-4);
      CHECK(difference(single->covariances.col(i).cast<double>(), expected.of_specified) < 1e-4);
    }
  }
  // Columns that are apart in memory.
  const Eigen::Matrix<double, 5, 7> wide = Eigen::Matrix<double, 5, 7>::Random();
  const auto apart = client->transform_cloud("odom", "lidar", wide.middleRows<3>(1));
  REQUIRE(apart);
  CHECK((apart->points.col(6) - X->pose * wide.block<3, 1>(1, 6)).norm() < 1e-12);
  CHECK(apart->covariances.cols() == 0);
}

TEST_CASE("clouds: in place, and as whole matrices") {
  Random random(4606);
  INFO("seed " << random.seed());
  const Transform X = random.transform();
  Eigen::Matrix3Xd points = Eigen::Matrix3Xd::Random(3, 11);
  const Eigen::Matrix3Xd given = points;
  CloudMatrices<double> whole(9, 11);
  transform_cloud_matrices(X, points, points, whole);
  for (Eigen::Index i = 0; i < points.cols(); ++i) {
    const TransformedPoint expected = transform(X, Point{given.col(i)});
    CHECK((points.col(i) - expected.coordinates).norm() < 1e-12);
    const Eigen::Map<const Eigen::Matrix3d> sigma(whole.col(i).data());
    CHECK((sigma - expected.of_specified).norm() < 1e-12 * expected.of_specified.norm());
  }
}

TEST_CASE("clouds: with a stamp a point, each by the pose at its instant") {
  const int network = GENERATE(from_range(testing::networks()));
  const auto join = testing::joined_by(network);
  Random random(4607);
  INFO("seed " << random.seed());
  Car car(join, random);
  auto client = Client::open(join(""));
  REQUIRE(client);
  const Eigen::Index count = 60;
  const Eigen::Matrix3Xd points = Eigen::Matrix3Xd::Random(3, count) * 10;
  CloudQuery query;
  query.covariances = true;
  for (Eigen::Index i = 0; i < count; ++i) {
    query.stamps.push_back(instant(0) + std::chrono::microseconds(random.index(20) * 5000));
  }
  const auto cloud = client->transform_cloud("odom", "lidar", points, query);
  REQUIRE(cloud);
  query.fixed = "odom";
  const auto still = client->transform_cloud("lidar", "lidar", points, query);
  REQUIRE(still);
  query.covariances = false;
  const auto poses_only = client->transform_cloud("lidar", "lidar", points, query);
  REQUIRE(poses_only);
  const Time last = *std::max_element(query.stamps.begin(), query.stamps.end());
  for (Eigen::Index i = 0; i < count; ++i) {
    INFO(i);
    Query at;
    at.at = query.stamps[static_cast<std::size_t>(i)];
    const auto X = client->lookup("odom", "lidar", at);
    REQUIRE(X);
    const TransformedPoint expected = transform(*X, Point{points.col(i)});
    CHECK((cloud->points.col(i) - expected.coordinates).norm() < 1e-12);
    CHECK(difference(cloud->covariances.col(i), expected.of_specified) < 1e-12);
    Query then;
    then.at = last;
    const auto X_LL = client->lookup("lidar", then, "lidar", at, "odom");
    REQUIRE(X_LL);
    const TransformedPoint in_lidar = transform(*X_LL, Point{points.col(i)});
    CHECK((still->points.col(i) - in_lidar.coordinates).norm() < 1e-11);
    CHECK((poses_only->points.col(i) - in_lidar.coordinates).norm() < 1e-11);
    if (in_lidar.of_specified.norm() > 1e-12) {
      CHECK(difference(still->covariances.col(i), in_lidar.of_specified) < 1e-9);
    }
  }
  // Stamps that are looked up as one: at the middle of those that occur.
  CloudQuery grouped;
  grouped.stamps = {instant(41), instant(43), instant(44), instant(57)};
  grouped.group = Milliseconds(10);
  const auto few = client->transform_cloud("odom", "lidar", points.leftCols<4>(), grouped);
  REQUIRE(few);
  for (int i = 0; i < 4; ++i) {
    Query at;
    at.at = i < 3 ? instant(42) + std::chrono::microseconds(500) : instant(57);
    CHECK((few->points.col(i) - client->lookup("odom", "lidar", at)->pose * points.col(i)).norm() <
          1e-12);
  }
}

TEST_CASE("clouds: what cannot be transformed is an error of the whole cloud") {
  const auto join = testing::join_loopback();
  Random random(4608);
  Car car(join, random);
  auto client = Client::open(join(""));
  REQUIRE(client);
  const Eigen::Matrix3Xd points = Eigen::Matrix3Xd::Random(3, 2);
  const auto code = [&](const CloudQuery& query) {
    const auto cloud = client->transform_cloud("odom", "lidar", points, query);
    return cloud ? "ok" : std::string(to_string(cloud.error().code));
  };
  CloudQuery query;
  query.stamps = {instant(0)};
  CHECK(code(query) == "invalid_input");
  query.stamps = {instant(0), instant(101)};
  CHECK(code(query) == "not_yet");
  query.stamps = {instant(0), instant(-1)};
  CHECK(code(query) == "too_old");
  query.stamps = {instant(0), instant(1)};
  query.lookup.at = instant(0);
  CHECK(code(query) == "invalid_input");
  query.lookup.at.reset();
  query.lookup.order = Order::kFourth;
  CHECK(code(query) == "invalid_input");
  query.lookup.order = Order::kSecond;
  query.own(0, 0) = -1;
  CHECK(code(query) == "invalid_input");
  query = {};
  query.fixed = "odom";
  CHECK(code(query) == "invalid_input");
  // A wait is for the last stamp.
  query = {};
  query.stamps = {instant(0), instant(105)};
  std::thread later([&] { CHECK(car.base.update("base", Transform::exact({}), instant(110))); });
  const auto waited =
      client->transform_cloud("odom", "lidar", points, query, std::chrono::seconds(20));
  later.join();
  CHECK(waited);
}

}  // namespace tfdude
