// tf2 itself, as Debian has it, gets the same messages, and gives the same answers.

#include <random>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include <tf2/buffer_core.h>

#include "tfdude/client/node.hpp"

#include "ros_rig.hpp"
#include "support/catch.hpp"
#include "support/pose_diff.hpp"
#include "support/tf2_message.hpp"

namespace tfdude {
namespace {

using testing::eventually;
using testing::pose_diff;
using testing::RosPeer;
using testing::RosRig;
using testing::RosTransform;

constexpr double kTolerance = 1e-9;

Pose random_pose(std::mt19937& random) {
  std::uniform_real_distribution<double> any(-2, 2);
  return *Pose::create(from_rpy(any(random), any(random), any(random)),
                       Eigen::Vector3d(any(random), any(random), any(random)));
}

Time at(int i) { return time_of(1'700'000'000'000'000'000 + i * 10'000'000LL); }

ros::Time ros_time(Time time) {
  ros::Time out;
  out.fromNSec(static_cast<std::uint64_t>(nanoseconds(time)));
  return out;
}

void set(tf2::BufferCore& buffer, const RosTransform& one, Time stamp, bool is_static) {
  const auto message = testing::tf2_message(one.parent, one.child, one.X_PC, ros_time(stamp));
  REQUIRE(buffer.setTransform(message, "test", is_static));
}

Pose look_up(const tf2::BufferCore& buffer, const std::string& a, const std::string& b, Time t) {
  const auto X = buffer.lookupTransform(a, b, ros_time(t)).transform;
  return *Pose::create(Eigen::Quaterniond(X.rotation.w, X.rotation.x, X.rotation.y, X.rotation.z),
                       Eigen::Vector3d(X.translation.x, X.translation.y, X.translation.z));
}

Pose look_up(Client& client, const std::string& a, const std::string& b, Time t) {
  Query query;
  query.at = t;
  const auto X = client.lookup(a, b, query, Milliseconds(20000));
  REQUIRE(X);
  return X->pose;
}

void check_equal(const tf2::BufferCore& buffer, Client& client, int count) {
  for (int i = 0; i < count; ++i) {
    for (const auto& [a, b] : {std::pair("map", "tool"), {"camera", "odom"}, {"tool", "camera"}}) {
      CAPTURE(i, a, b);
      CHECK(pose_diff(look_up(client, a, b, at(i)), look_up(buffer, a, b, at(i)), kTolerance) ==
            "");
    }
  }
}

constexpr int kSamples = 20;

}  // namespace

TEST_CASE("ros tf2: what the peer publishes gives the same answers here and in tf2") {
  std::mt19937 random(20);  // NOLINT(cert-msc51-cpp): the same each time
  const RosRig rig;
  const auto bridge = rig.start_bridge();
  Client client = rig.client();
  RosPeer peer(rig.ros_domain());
  peer.advertise("/tf", "tf", "reliable");
  peer.advertise("/tf_static", "tf", "latched");
  tf2::BufferCore buffer;
  const RosTransform mount{"base", "camera", random_pose(random)};
  peer.publish("/tf_static", testing::tf_message(at(0), {mount}));
  set(buffer, mount, at(0), true);
  for (int i = 0; i < kSamples; ++i) {
    const std::vector<RosTransform> moved{{"map", "odom", random_pose(random)},
                                          {"odom", "base", random_pose(random)},
                                          {"base", "tool", random_pose(random)}};
    peer.publish("/tf", testing::tf_message(at(i), moved));
    for (const RosTransform& one : moved) set(buffer, one, at(i), false);
  }
  check_equal(buffer, client, kSamples);
}

TEST_CASE("ros tf2: what tf-dude sends gives the same answers here and in tf2") {
  std::mt19937 random(21);  // NOLINT(cert-msc51-cpp): the same each time
  const RosRig rig;
  Node base = Node::open("base",
                         {{"map", "", {}},
                          {"odom", "map", {}},
                          {"base", "odom", {}},
                          {"camera", "base", {random_pose(random), {}}}},
                         rig.dude().options())
                  .value();
  Node arm =
      Node::open("arm", {{"mount", "base", {random_pose(random), {}}}, {"tool", "mount", {}}},
                 rig.dude().options())
          .value();
  // The mount of the arm is not known to ROS: the tool is sent in the base.
  const auto bridge =
      rig.start_bridge({"--export", "base", "--export-frame", "tool", "--rate", "0"});
  RosPeer peer(rig.ros_domain());
  peer.obey("listen /tf_static tf latched");
  peer.obey("listen /tf tf reliable");
  tf2::BufferCore buffer;
  // All are static until they move, and tf2 would keep that of a frame.
  bool has_camera = false;
  while (!has_camera) {
    for (const auto& one : testing::parse_tf(peer.next("/tf_static "))) {
      if (one.child != "camera") continue;
      set(buffer, one, one.stamp, true);
      has_camera = true;
    }
  }
  int warm_up = -1000;
  REQUIRE(eventually([&] {
    ++warm_up;
    REQUIRE(base.update({{"odom", {}}, {"base", {}}}, at(warm_up)));
    REQUIRE(arm.update({{"tool", {}}}, at(warm_up)));
    return peer.try_next("/tf ").has_value();
  }));
  for (int i = 0; i < kSamples; ++i) {
    REQUIRE(base.update({{"odom", {random_pose(random), {}}}, {"base", {random_pose(random), {}}}},
                        at(i)));
    REQUIRE(arm.update({{"tool", {random_pose(random), {}}}}, at(i)));
    // Each sample must have been sent before the next one.
    std::set<std::string> missing{"odom", "base", "tool"};
    while (!missing.empty()) {
      for (const auto& one : testing::parse_tf(peer.next("/tf "))) {
        set(buffer, one, one.stamp, false);
        if (one.stamp == at(i)) missing.erase(one.child);
      }
    }
  }
  check_equal(buffer, arm, kSamples);
}

}  // namespace tfdude
