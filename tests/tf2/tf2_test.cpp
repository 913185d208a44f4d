// Code that is written for tf2 runs on tfdude/tf2.hpp: a node of ROS 2 with two lines replaced, and
// messages as of ROS 1.

#include "tfdude/tf2.hpp"

#include <cmath>
#include <cstdlib>
#include <string>

#include "tfdude/client/node.hpp"
#include "tfdude/transport/loopback.hpp"

#include "follower_node_of_tfdude.hpp"
#include "support/catch.hpp"
#include "support/domain_lease.hpp"

namespace tfdude {
namespace {

using testing::Approx;
using testing::ContainsSubstring;

Transform moved(double x, double y, double yaw, double stddev = 0) {
  Transform X = Transform::exact(Pose::create(from_rpy(0, 0, yaw), {x, y, 0}).value());
  if (stddev > 0) {
    X.covariance =
        Covariance::from_stddev({stddev, stddev, stddev, stddev, stddev, stddev}).value();
  }
  return X;
}

// map -> odom (static) -> leader and follower; the follower has samples at 10 s and 11 s.
std::vector<FrameSpec> frames() {
  std::vector<FrameSpec> all(4);
  all[0].id = "map";
  all[1] = {"odom", "map", moved(1, 0, 0)};
  all[2] = {"leader", "odom", moved(2, 2, 0)};
  all[3] = {"follower", "odom", moved(0, 0, 0)};
  return all;
}

// Messages as of ROS 1: stamps have nsec, and a class of their own.
struct RosTime {
  std::uint32_t sec = 0;
  std::uint32_t nsec = 0;
  [[nodiscard]] std::uint64_t toNSec() const { return std::uint64_t{sec} * 1'000'000'000 + nsec; }
};
struct RosDuration {
  double seconds = 0;
  [[nodiscard]] std::int64_t toNSec() const { return static_cast<std::int64_t>(seconds * 1e9); }
};
struct RosHeader {
  RosTime stamp;
  std::string frame_id;
};
struct RosPoseStamped {
  RosHeader header;
  geometry_msgs::msg::Pose pose;
};
struct RosTransformStamped {
  RosHeader header;
  std::string child_frame_id;
  geometry_msgs::msg::Transform transform;
};

struct Robot {
  Robot() {
    for (const int second : {10, 11}) {
      REQUIRE(
          node.update("follower", moved(second - 10, 0, 0), Time(std::chrono::seconds(second))));
    }
  }

  LoopbackNetwork network;
  Node node = Node::open(network.join(), "robot", frames(), {}).value();
  tf2_ros::Buffer buffer{node};
};

}  // namespace

TEST_CASE("tf2: a node of ROS 2 runs with two lines replaced") {
  const testing::DomainLease lease;
  setenv("TFDUDE_DOMAIN", std::to_string(lease.number()).c_str(), 1);
  setenv("TFDUDE_PROFILE", TFDUDE_LOOPBACK_PROFILE, 1);
  auto robot = Node::open("robot", frames(), {});
  REQUIRE(robot);
  FollowerNode follower;
  REQUIRE(follower.on_timer());
  CHECK(follower.command_.angular.z == Approx(std::atan2(2, 2)));
  CHECK(follower.command_.linear.x == Approx(0.5 * std::hypot(2, 2)));
  CHECK(follower.last_.nanoseconds() == 0);
  for (const int second : {10, 11}) {
    REQUIRE(
        robot->update("follower", moved(second - 10, 0, 0), Time(std::chrono::seconds(second))));
  }
  REQUIRE(follower.on_timer());
  CHECK(follower.command_.angular.z == Approx(std::atan2(2, 1)));
  CHECK(follower.last_.nanoseconds() == 11'000'000'000);

  const auto seen = std::make_shared<geometry_msgs::msg::PointStamped>();
  seen->header.frame_id = "follower";
  seen->header.stamp.sec = 10;
  seen->header.stamp.nanosec = 500'000'000;
  seen->point.y = 3;
  follower.on_detection(seen);
  CHECK(follower.detection_.header.frame_id == "map");
  CHECK(follower.detection_.header.stamp.nanosec == 500'000'000);
  CHECK(follower.detection_.point.x == Approx(1.5));
  CHECK(follower.detection_.point.y == Approx(3));
  const auto nowhere = std::make_shared<geometry_msgs::msg::PointStamped>(*seen);
  nowhere->header.frame_id = "nowhere";
  follower.on_detection(nowhere);
  REQUIRE(follower.get_logger().size() == 1);
  CHECK(follower.get_logger().back() == "no transform from nowhere");

  geometry_msgs::msg::PoseWithCovarianceStamped pose;
  pose.header = seen->header;
  pose.pose.covariance[0] = 0.25;
  follower.heading_.vector.x = 2;
  follower.on_pose(pose);
  CHECK(follower.pose_.pose.pose.position.x == Approx(1.5));
  CHECK(follower.pose_.pose.covariance[0] == Approx(0.25));
  CHECK(follower.heading_.vector.x == Approx(2));
  CHECK(follower.heading_.header.frame_id == "map");
  unsetenv("TFDUDE_DOMAIN");
  unsetenv("TFDUDE_PROFILE");
}

TEST_CASE("tf2: exceptions have tf2's names") {
  const Robot robot;
  const auto& buffer = robot.buffer;
  CHECK_THROWS_AS((void)buffer.lookupTransform("map", "nobody", tf2::TimePointZero),
                  tf2::LookupException);
  CHECK_THROWS_AS((void)buffer.lookupTransform("map", "follower", tf2::timeFromSec(12)),
                  tf2::ExtrapolationException);
  CHECK_THROWS_AS((void)buffer.lookupTransform("map", "follower", tf2::timeFromSec(9)),
                  tf2::ExtrapolationException);
  CHECK_THROWS_AS((void)buffer.lookupTransform("", "follower", tf2::TimePointZero),
                  tf2::InvalidArgumentException);
  CHECK_THROWS_AS((void)buffer.lookupTransform("map", "nobody", tf2::TimePointZero),
                  tf2::TransformException);
  std::string why;
  CHECK_FALSE(buffer.canTransform("map", "nobody", tf2::TimePointZero, &why));
  CHECK_THAT(why, ContainsSubstring("nobody"));
  CHECK(buffer.canTransform("map", "follower", tf2::timeFromSec(10.25), tf2::Duration(), &why));
  CHECK(buffer._frameExists("leader"));
  CHECK_FALSE(buffer._frameExists("nobody"));
  // A message without a frame.
  for (const char* none : {"", "/"}) {
    why.clear();
    CHECK_FALSE(buffer.canTransform("map", none, tf2::TimePointZero, &why));
    CHECK_FALSE(why.empty());
    CHECK_FALSE(buffer._frameExists(none));
    CHECK_THROWS_AS((void)buffer.lookupTransform("map", none, tf2::TimePointZero),
                    tf2::InvalidArgumentException);
  }
  CHECK(buffer.getAllFrameNames().size() == 4);
}

TEST_CASE("tf2: messages as of ROS 1, a slash before frames, two times") {
  const Robot robot;
  const auto& buffer = robot.buffer;
  const RosTransformStamped X =
      buffer.lookupTransform("/map", "/follower", RosTime{10, 250'000'000}, RosDuration{0.1});
  CHECK(X.header.stamp.nsec == 250'000'000);
  CHECK(X.transform.translation.x == Approx(1.25));
  CHECK(X.header.frame_id == "map");
  CHECK(X.child_frame_id == "follower");
  CHECK(tf2::transformToEigen(X).translation().x() == Approx(1.25));
  // Zero is the newest; a static transform has the time that was asked for.
  const RosTransformStamped newest = buffer.lookupTransform("map", "follower", RosTime{});
  CHECK(newest.header.stamp.sec == 11);
  const RosTransformStamped fixed = buffer.lookupTransform("map", "leader", RosTime{77, 1});
  CHECK(fixed.header.stamp.sec == 77);

  RosPoseStamped pose;
  pose.header = {{10, 0}, "follower"};
  pose.pose.position.y = 1;
  const RosPoseStamped there = buffer.transform(pose, "leader", RosDuration{0.1});
  CHECK(there.pose.position.x == Approx(-2));
  CHECK(there.pose.position.y == Approx(-1));
  CHECK(there.header.frame_id == "leader");
  RosPoseStamped later;
  // Where it will have been seen from the follower a second later.
  buffer.transform(pose, later, "follower", RosTime{11, 0}, "odom");
  CHECK(later.pose.position.x == Approx(-1));
  CHECK(later.header.stamp.sec == 11);
  // Zero is the newest time of the target and the frame between; without one it stays zero.
  buffer.transform(pose, later, "follower", RosTime{}, "odom");
  CHECK(later.pose.position.x == Approx(-1));
  CHECK(later.header.stamp.sec == 11);
  buffer.transform(pose, later, "leader", RosTime{}, "map");
  CHECK(later.header.stamp.sec == 0);
}

TEST_CASE("tf2: parts of what a lookup returns are those of messages") {
  const Robot robot;
  const auto t = robot.buffer.lookupTransform("/map", "leader", tf2::timeFromSec(10.5));
  geometry_msgs::msg::PoseStamped pose;
  pose.header = t.header;
  pose.pose.orientation = t.transform.rotation;
  pose.pose.position = t.transform.translation;
  CHECK(pose.header.frame_id == "map");
  CHECK(pose.header.stamp.sec == 10);
  CHECK(pose.header.stamp.nanosec == 500'000'000);
  CHECK(pose.pose.position.x == Approx(3));
  CHECK(pose.pose.orientation.w == Approx(1));
  geometry_msgs::msg::TransformStamped message;
  message.transform = t.transform;
  CHECK(message.transform.translation.y == Approx(2));
  const RosHeader header = t.header;
  CHECK(header.stamp.nsec == 500'000'000);
  const auto length = [](const geometry_msgs::msg::Vector3& v) { return std::hypot(v.x, v.y); };
  CHECK(length(t.transform.translation) == Approx(std::hypot(3, 2)));
  CHECK(tf2::transformToEigen(t.transform).translation().y() == Approx(2));
  CHECK(tf2::transformToEigen(message.transform).translation().y() == Approx(2));
}

TEST_CASE("tf2: two times can be asked for before") {
  const Robot robot;
  const auto& buffer = robot.buffer;
  std::string error;
  CHECK(buffer.canTransform("/follower", RosTime{11, 0}, "follower", RosTime{10, 0}, "/odom"));
  CHECK(buffer.canTransform("follower", tf2::timeFromSec(11), "follower", tf2::timeFromSec(10),
                            "odom", tf2::durationFromSec(0.1), &error));
  CHECK(error.empty());
  CHECK_FALSE(buffer.canTransform("follower", tf2::timeFromSec(12), "follower",
                                  tf2::timeFromSec(10), "odom", &error));
  CHECK_THAT(error, ContainsSubstring("follower"));
  CHECK_FALSE(buffer.canTransform("follower", tf2::timeFromSec(11), "follower",
                                  tf2::timeFromSec(10), "/", tf2::Duration(), &error));
  CHECK(error == "an empty frame id");
}

TEST_CASE("tf2: the covariance of a pose is turned, and that of the path is added") {
  Robot robot;
  REQUIRE(robot.node.update("leader", moved(2, 2, std::acos(-1.0) / 2, 0.1)));
  geometry_msgs::msg::PoseWithCovarianceStamped pose;
  pose.header.frame_id = "leader";
  pose.pose.pose.position.x = 3;
  pose.pose.covariance[0] = 0.04;
  pose.pose.covariance[7] = 0.09;
  const auto seen = robot.buffer.transform(pose, "map");
  // What was along x is along y; a turn of the leader by 0.1 rad moves the pose at 3 m.
  const double turn = 0.01 * 9;
  CHECK(seen.pose.covariance[0] == Approx(0.09 + 0.01 + turn));
  CHECK(seen.pose.covariance[7] == Approx(0.04 + 0.01));
  CHECK(seen.pose.covariance[35] == Approx(0.01));
  // tf2's own conversion, without what the path does not know.
  geometry_msgs::msg::TransformStamped plain =
      robot.buffer.lookupTransform("map", "leader", tf2::TimePointZero);
  geometry_msgs::msg::PoseWithCovarianceStamped turned;
  tf2::doTransform(pose, turned, plain);
  CHECK(turned.pose.covariance[0] == Approx(0.09));
  CHECK(turned.pose.covariance[7] == Approx(0.04));
  // Zeros say that nothing is known, and stay.
  pose.pose.covariance = {};
  CHECK(robot.buffer.transform(pose, "map").pose.covariance[0] == 0);
  // As the bridge reads them: -1 at first says the same, and stays.
  pose.pose.covariance[0] = -1;
  CHECK(robot.buffer.transform(pose, "map").pose.covariance[0] == -1);
  CHECK(robot.buffer.transform(pose, "map").pose.pose.position.y == Approx(5));
  pose.pose.covariance[0] = -2;
  CHECK_THROWS_AS((void)robot.buffer.transform(pose, "map"), tf2::InvalidArgumentException);
}

TEST_CASE("tf2: of an axis with the largest variance, or with -1, nothing is known") {
  Robot robot;
  REQUIRE(robot.node.update("leader", moved(2, 2, std::acos(-1.0) / 2, 0)));
  geometry_msgs::msg::PoseWithCovarianceStamped pose;
  pose.header.frame_id = "leader";
  pose.pose.covariance[0] = 0.04;
  pose.pose.covariance[7] = std::numeric_limits<double>::max();
  pose.pose.covariance[1] = pose.pose.covariance[6] = 0.01;
  pose.pose.covariance[14] = -1;
  pose.pose.covariance[35] = std::numeric_limits<double>::infinity();
  const auto seen = robot.buffer.transform(pose, "map").pose.covariance;
  // 1 km and 10 rad, and no correlation with other axes; the leader's y is along -x.
  CHECK(seen[0] == Approx(1e6));
  CHECK(seen[7] == Approx(0.04));
  CHECK(seen[14] == Approx(1e6));
  CHECK(seen[35] == Approx(1e2));
  CHECK(std::abs(seen[1]) < 1e-6);
}

}  // namespace tfdude
