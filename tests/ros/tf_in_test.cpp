// What a foreign node publishes on /tf and /tf_static is there in the domain of tf-dude.

#include <cmath>
#include <csignal>
#include <string>
#include <vector>

#include "ros_rig.hpp"
#include "support/catch.hpp"
#include "support/pose_diff.hpp"

namespace tfdude {
namespace {

using testing::Approx;
using testing::eventually;
using testing::pose_diff;
using testing::RosPeer;
using testing::RosRig;
using testing::tf_message;

constexpr double kTolerance = 1e-12;

Pose pose(double x, double yaw) {
  return *Pose::create(from_rpy(0.1, -0.2, yaw), Eigen::Vector3d(x, 2, -3));
}

Time at(double seconds) {
  return time_of(1'700'000'000'000'000'000 + static_cast<std::int64_t>(seconds * 1e9));
}

}  // namespace

TEST_CASE("ros tf in: a dynamic and a static frame have the peer's values and stamps") {
  const bool typed = GENERATE(false, true);
  const RosRig rig;
  RosPeer peer(rig.ros_domain(), typed);
  auto bridge = rig.start_bridge();
  Client client = rig.client();

  peer.advertise("/tf", "tf", "reliable");
  peer.advertise("/tf_static", "tf", "latched");
  peer.publish("/tf_static", tf_message(at(0), {{"base", "lidar", pose(0.5, 0)}}));
  peer.publish("/tf", tf_message(at(1), {{"/odom", "base", pose(1, 0.1)}}));
  peer.publish("/tf", tf_message(at(2), {{"odom", "base", pose(2, 0.2)}}));

  Query query;
  query.at = at(2);
  const auto moved = client.lookup("odom", "base", query, Milliseconds(20000));
  REQUIRE(moved);
  CHECK(pose_diff(moved->pose, pose(2, 0.2), kTolerance) == "");
  query.at = at(1);
  const auto lidar = client.lookup("odom", "lidar", query, Milliseconds(20000));
  REQUIRE(lidar);
  CHECK(pose_diff(lidar->pose, pose(1, 0.1) * pose(0.5, 0), kTolerance) == "");
  CHECK(lidar->stamp == at(1));
  CHECK(lidar->basis.unspecified == std::vector<std::string>{"base", "lidar"});

  const auto fixed = client.lookup("base", "lidar", Query{});
  REQUIRE(fixed);
  CHECK(!fixed->stamp);
  const auto frames = client.frames();
  REQUIRE(frames);
  REQUIRE(frames->size() == 3);
  for (const Frame& frame : *frames) CHECK(frame.partition == "ros");

  bridge.signal(SIGTERM);
  CHECK(bridge.wait(testing::in_time()) == 0);
}

TEST_CASE("ros tf in: transforms without a stamp are samples of the time of their arrival") {
  const RosRig rig;
  auto bridge = rig.start_bridge();
  RosPeer peer(rig.ros_domain());
  Client client = rig.client();
  peer.advertise("/tf", "tf", "reliable");
  const auto x = [&] {
    const auto X = client.lookup("map", "odom", Query{});
    return X && X->stamp ? X->pose.translation().x() : -1;
  };
  // Messages that are written before both sides have met are lost.
  int seconds = 0;
  REQUIRE(eventually([&] {
    peer.publish("/tf", tf_message(at(++seconds), {{"odom", "base", pose(1, 0)}}));
    return client.lookup("odom", "base").has_value();
  }));
  const Time before = client.now().value();
  for (int k = 0; k < 5; ++k) {
    peer.publish("/tf", tf_message(Time(), {{"map", "odom", pose(k, 0)}}));
    REQUIRE(eventually([&] { return std::abs(x() - k) < kTolerance; }));
  }
  const auto newest = client.lookup("map", "odom", Query{}).value().stamp;
  CHECK(newest.value() > before);
  CHECK(client.history("odom").value().at(0).samples == 5);
  // The first of two values of one stamp stays.
  for (const double value : {7.0, 7.0, 8.0}) {
    peer.publish("/tf", tf_message(at(1e8), {{"map", "odom", pose(value, 0)}}));
  }
  peer.publish("/tf", tf_message(at(1e8 + 1), {{"map", "odom", pose(9, 0)}}));
  REQUIRE(eventually([&] { return std::abs(x() - 9) < kTolerance; }));
  Query query;
  query.at = at(1e8);
  CHECK(client.lookup("map", "odom", query).value().pose.translation().x() == Approx(7));

  bridge.signal(SIGTERM);
  CHECK(bridge.wait(testing::in_time()) == 0);
  CHECK_THAT(bridge.err(),
             testing::ContainsSubstring("unstamped=5 same=1 repeated=1") &&
                 testing::ContainsSubstring("frame 'odom': its message has no stamp") &&
                 testing::ContainsSubstring("another value for a stamp"));
}

TEST_CASE("ros tf in: both domains may be the same") {
  const RosRig rig;
  RosPeer peer(rig.ros_domain());
  const auto bridge = rig.start_bridge(rig.ros_domain(), {});
  peer.advertise("/tf", "tf", "reliable");
  peer.publish("/tf", tf_message(at(1), {{"odom", "base", pose(1, 0.1)}}));
  auto options = rig.dude().options();
  options.domain = rig.ros_domain();
  Client client = Client::open(options).value();
  CHECK(eventually([&] { return client.lookup("odom", "base").has_value(); }));
}

TEST_CASE("ros tf in: patterns and a prefix choose the frames of a robot") {
  const RosRig rig;
  const testing::TemporaryDirectory files;
  const auto bridge = rig.start_bridge(
      {"--config", files.write("b.yaml",
                               "partition: r1\nprefix: r1/\n"
                               "tf_in: {except: [\"camera*\"], covariance: exact}\n")});
  RosPeer peer(rig.ros_domain());
  peer.advertise("/tf", "tf", "reliable");
  peer.publish("/tf", tf_message(at(1), {{"base", "camera_link", pose(1, 0)},
                                         {"/odom", "/base", pose(2, 0.1)}}));
  Client client = rig.client();
  REQUIRE(eventually([&] { return client.lookup("r1/odom", "r1/base").has_value(); }));
  CHECK(client.lookup("r1/odom", "r1/base").value().covariance.complete());
  const auto frames = client.frames();
  REQUIRE(frames.value().size() == 2);
  CHECK(frames->front().partition == "r1");
}

}  // namespace tfdude
