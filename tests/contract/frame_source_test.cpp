// One algorithm over all that answers lookups, and conversions for programs that use Eigen.

#include "tfdude/client/frame_source.hpp"

#include "tfdude/client/broadcast.hpp"
#include "tfdude/client/node.hpp"
#include "tfdude/math/conversions.hpp"

#include "support/catch.hpp"
#include "support/networks.hpp"
#include "support/pose_diff.hpp"
#include "support/process.hpp"
#include "support/random.hpp"

namespace tfdude {
namespace {

using testing::pose_diff;
using testing::Random;
using testing::transform_diff;

// An algorithm that does not know who answers.
Eigen::Vector3d tip_in_world(FrameSource& frames) {
  return value_or_throw(frames.lookup("world", "tip")).pose * Eigen::Vector3d(0, 0, 1);
}

// Of f at zero, by differences.
template <class Function>
Matrix6d derivative(const Pose& mean, Function disturbed) {
  constexpr double kStep = 1e-6;
  Matrix6d J;
  for (int i = 0; i < 6; ++i) {
    const Twist step = Twist::Unit(i) * kStep;
    J.col(i) = (tfdude::log(mean.inverse() * disturbed(step)) -
                tfdude::log(mean.inverse() * disturbed(-step))) /
               (2 * kStep);
  }
  return J;
}

}  // namespace

TEST_CASE("frame source: a client, watched edges and a table answer the same") {
  const auto join = testing::join_loopback();
  Random random(4620);
  INFO("seed " << random.seed());
  auto node =
      Node::open(join("robot"), "robot", {{"world", "", {}}, {"tip", "world", random.transform()}});
  auto client = Client::open(join(""));
  REQUIRE((node && client));
  ClientSource live(*client);
  const auto X = live.lookup("world", "tip", {}, std::chrono::seconds(20));
  REQUIRE(X);
  const Eigen::Vector3d expected = tip_in_world(live);
  auto edges = client->watch_edges({"tip"});
  REQUIRE(edges);
  WatchSource watched(*edges);
  REQUIRE(testing::eventually([&] { return watched.lookup("world", "tip", {}, {}).has_value(); }));
  CHECK((tip_in_world(watched) - expected).norm() < 1e-12);
  TableSource table;
  table.set("world", "tip", *X);
  CHECK((tip_in_world(table) - expected).norm() < 1e-12);
  const auto back = table.lookup("tip", "world", {}, {});
  REQUIRE(back);
  CHECK(transform_diff(*back, inverse(*X), 1e-12) == "");
  CHECK(table.lookup("tip", "moon", {}, {}).error().code == Errc::kNotConnected);
  try {
    (void)value_or_throw(live.lookup("world", "moon", {}, {}));
    FAIL("no exception");
  } catch (const ErrorException& error) {
    CHECK(error.code() == Errc::kUnknownEnd);
    CHECK(std::string(error.what()) == error.error().message);
  }
}

TEST_CASE("broadcast: a frame is created, updated and moved, as a broadcaster of tf2 does") {
  const auto join = testing::join_loopback();
  auto node = Node::open(join("robot"), "robot", {{"world", "", {}}, {"table", "world", {}}});
  auto client = Client::open(join(""));
  REQUIRE((node && client));
  const auto x_of = [&](const std::string& parent, const Query& query = {}) {
    const auto X = client->lookup(parent, "cup", query);
    return X ? X->pose.translation().x() : -1;
  };
  const auto ahead = [](double x) {
    return Transform::exact(Pose::trusted(Eigen::Quaterniond::Identity(), {x, 0, 0}));
  };
  REQUIRE(ensure(*client, "cup", "world", ahead(1)));
  CHECK(x_of("world") == 1);
  REQUIRE(ensure(*client, "cup", "world", ahead(2)));
  CHECK(x_of("world") == 2);
  REQUIRE(ensure(*client, "cup", "table", ahead(3)));
  CHECK(x_of("table") == 3);
  CHECK(client->parent("cup").value() == "table");
  const Time begin(std::chrono::seconds(1'000'000));
  REQUIRE(ensure(*client, "cup", "table", ahead(4), begin));
  REQUIRE(ensure(*client, "cup", "table", ahead(6), begin + Milliseconds(10)));
  Query query;
  query.at = begin + Milliseconds(5);
  CHECK(x_of("table", query) == 5);
  // With a stamp a new frame is dynamic at once.
  REQUIRE(client->remove("cup"));
  REQUIRE(ensure(*client, "cup", "world", ahead(7), begin));
  CHECK(client->lookup("world", "cup", query).error().code == Errc::kNotYet);
  CHECK(ensure(*client, "cup", "moon", ahead(1)).error().code == Errc::kUnknownParent);
}

TEST_CASE("broadcast: each value of a list may have its own stamp") {
  const auto join = testing::join_loopback();
  auto node = Node::open(join("robot"), "robot", {{"world", "", {}}});
  auto client = Client::open(join(""));
  REQUIRE((node && client));
  const auto at = [](double x) {
    return Transform::exact(Pose::trusted(Eigen::Quaterniond::Identity(), {x, 0, 0}));
  };
  REQUIRE(client->add("left", "world", at(0)));
  REQUIRE(client->add("right", "world", at(0)));
  const Time begin(std::chrono::seconds(1'000'000));
  const auto x_of = [&](const char* frame, Time when) {
    Query query;
    query.at = when;
    return client->lookup("world", frame, query).value().pose.translation().x();
  };
  // The later one of an edge may come first in the list.
  REQUIRE(publish(*client, {{"left", at(3)}, {"right", at(5)}, {"left", at(1)}},
                  {begin + Milliseconds(20), begin + Milliseconds(10), begin}));
  CHECK(x_of("left", begin + Milliseconds(10)) == 2);
  CHECK(x_of("right", begin + Milliseconds(10)) == 5);
  Query early;
  early.at = begin;
  CHECK(client->lookup("world", "right", early).error().code == Errc::kTooOld);
  // What is wrong does not stop the others.
  const auto some = publish(*client, {{"nobody", at(0)}, {"left", at(7)}},
                            {begin + Milliseconds(30), begin + Milliseconds(40)});
  CHECK(some.error().code == Errc::kUnknownFrame);
  CHECK(x_of("left", begin + Milliseconds(40)) == 7);
  CHECK(publish(*client, {{"left", at(9)}}, {}).error().message == "0 stamps for 1 edges");
  CHECK(x_of("left", begin + Milliseconds(40)) == 7);
}

TEST_CASE("conversions: Eigen's transforms, angles, and Jacobians beside differences") {
  Random random(4621);
  INFO("seed " << random.seed());
  for (int i = 0; i < 10; ++i) {
    const Pose X = random.pose();
    const Pose Y = random.pose();
    CHECK(pose_diff(value_or_throw(from_isometry(to_isometry(X))), X, 1e-12) == "");
    CHECK(((to_isometry(X) * to_isometry(Y)).matrix() - (X * Y).matrix()).norm() < 1e-12);
    CHECK(pose_diff(value_or_throw(from_xyz_rpy(X.translation(), to_rpy(X.rotation()))), X, 1e-9) ==
          "");
    ProductJacobians product;
    const Pose XY = multiply(X, Y, product);
    CHECK(pose_diff(XY, X * Y, 0) == "");
    CHECK((product.by_first - derivative(XY, [&](const Twist& xi) {
             return X * tfdude::exp(xi) * Y;
           })).norm() < 1e-6);
    CHECK((product.by_second - derivative(XY, [&](const Twist& xi) {
             return X * (Y * tfdude::exp(xi));
           })).norm() < 1e-6);
    Matrix6d of_inverse;
    const Pose back = invert(X, of_inverse);
    CHECK((of_inverse - derivative(back, [&](const Twist& xi) {
             return (X * tfdude::exp(xi)).inverse();
           })).norm() < 1e-6);
    Eigen::Matrix<double, 3, 6> by_pose;
    Eigen::Matrix3d by_point;
    const Eigen::Vector3d p = random.vector(2);
    const Eigen::Vector3d moved = act(X, p, by_pose, by_point);
    const Twist xi = random.twist(1e-6, 1e-6);
    const Eigen::Vector3d q = random.vector(1e-6);
    CHECK((X * tfdude::exp(xi) * (p + q) - moved - by_pose * xi - by_point * q).norm() < 1e-10);
    const Transform A = random.transform();
    const Transform B = random.transform();
    CHECK(transform_diff(A * B, compose(A, B), 0) == "");
  }
  Eigen::Isometry3d bent = Eigen::Isometry3d::Identity();
  bent.linear()(0, 0) = 2;
  CHECK_FALSE(from_isometry(bent));
}

}  // namespace tfdude
