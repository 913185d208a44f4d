// Frames of tf-dude reach a foreign node by /tf and /tf_static.

#include <csignal>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include "tfdude/client/node.hpp"

#include "ros_rig.hpp"
#include "support/catch.hpp"
#include "support/pose_diff.hpp"

namespace tfdude {
namespace {

using testing::eventually;
using testing::parse_tf;
using testing::pose_diff;
using testing::Process;
using testing::ReceivedTransform;
using testing::RosPeer;
using testing::RosRig;

Transform pose(double x, double yaw) {
  return {*Pose::create(from_rpy(0.1, -0.2, yaw), Eigen::Vector3d(x, 2, -3)), {}};
}

Time at(double seconds) {
  return time_of(1'700'000'000'000'000'000 + static_cast<std::int64_t>(seconds * 1e9));
}

/// The newest transform of each child that a peer has received on a topic.
std::map<std::string, ReceivedTransform> await(RosPeer& peer, const std::string& topic,
                                               const std::vector<std::string>& children) {
  std::map<std::string, ReceivedTransform> received;
  const auto has_all = [&] {
    for (const std::string& child : children) {
      if (received.count(child) == 0) return false;
    }
    return true;
  };
  while (!has_all()) {
    for (auto& one : parse_tf(peer.next(topic + ' '))) received[one.child] = one;
  }
  return received;
}

}  // namespace

TEST_CASE("ros tf out: dynamic and static frames of a partition reach a late peer") {
  const RosRig rig;
  Node node = Node::open("robot",
                         {{"world", "", {}},
                          {"base", "world", pose(1, 0)},
                          {"mast", "base", pose(2, 0.5)},
                          {"camera", "mast", pose(3, 1)}},
                         rig.dude().options())
                  .value();
  auto bridge = rig.start_bridge({"--export", "robot"});
  RosPeer peer(rig.ros_domain(), GENERATE(false, true));
  peer.obey("listen /tf_static tf latched");
  peer.obey("listen /tf tf reliable");
  auto fixed = await(peer, "/tf_static", {"base", "mast", "camera"});
  CHECK(fixed["camera"].parent == "mast");
  CHECK(pose_diff(fixed["camera"].X_PC, pose(3, 1).pose, 1e-12) == "");

  // The peer may not have been matched yet on the other topic.
  int n = 0;
  std::map<std::string, ReceivedTransform> moved;
  REQUIRE(eventually([&] {
    ++n;
    REQUIRE(node.update("base", pose(n, 0.25), at(n)));
    return peer.try_next("/tf ").has_value();
  }));
  REQUIRE(node.update({{"base", pose(-1, 0.75)}, {"mast", pose(-2, 1)}}, at(1000)));
  do {
    moved = await(peer, "/tf", {"base"});
  } while (moved["base"].stamp != at(1000));
  CHECK(moved["base"].parent == "world");
  CHECK(pose_diff(moved["base"].X_PC, pose(-1, 0.75).pose, 1e-12) == "");
  CHECK(moved.count("mast") == 1);
  // What became dynamic is no longer among the static ones.
  auto left = await(peer, "/tf_static", {"camera"});
  while (left.size() != 1) left = await(peer, "/tf_static", {"camera"});
  CHECK(left.count("camera") == 1);
}

TEST_CASE("ros tf out: all samples that an owner has pushed at once are sent") {
  const RosRig rig;
  Node node =
      Node::open("robot", {{"world", "", {}}, {"base", "world", pose(1, 0)}}, rig.dude().options())
          .value();
  const testing::TemporaryDirectory files;
  const auto bridge = rig.start_bridge(
      {"--config", files.write("b.yaml", "tf_out: {partitions: [robot], rate: 0}\n")});
  RosPeer peer(rig.ros_domain());
  peer.obey("listen /tf tf reliable");
  int n = 0;
  REQUIRE(eventually([&] {
    ++n;
    REQUIRE(node.update("base", pose(n, 0.25), at(n)));
    return peer.try_next("/tf ").has_value();
  }));
  // Faster than anybody reads.
  constexpr int kSamples = 40;
  for (int i = 0; i < kSamples; ++i) {
    REQUIRE(node.update("base", pose(i, 0.5), at(n + 1 + 0.001 * i)));
  }
  std::vector<Time> stamps;
  while (stamps.empty() || stamps.back() != at(n + 1 + 0.001 * (kSamples - 1))) {
    for (const auto& one : parse_tf(peer.next("/tf "))) {
      if (one.stamp > at(n)) stamps.push_back(one.stamp);
    }
  }
  REQUIRE(stamps.size() == kSamples);
  for (int i = 0; i < kSamples; ++i) {
    CHECK(stamps[static_cast<std::size_t>(i)] == at(n + 1 + 0.001 * i));
  }
}

TEST_CASE("ros tf out: frames of an owner that is not reachable are not sent, until it returns") {
  const RosRig rig;
  const testing::TemporaryDirectory files;
  const std::string arm = files.write(
      "arm.yaml", "partition: arm\nframes:\n  - {id: tool, parent: base, xyz: [1, 0, 0]}\n");
  Node node =
      Node::open("base", {{"world", "", {}}, {"base", "world", {}}}, rig.dude().options()).value();
  auto daemon = rig.dude().serve(arm);
  auto bridge = rig.start_bridge({"--export", "*"});
  RosPeer peer(rig.ros_domain());
  peer.obey("listen /tf_static tf latched");
  REQUIRE(await(peer, "/tf_static", {"base", "tool"}).size() == 2);
  daemon.kill();
  while (parse_tf(peer.next("/tf_static ")).size() != 1) {
  }
  auto back = rig.dude().serve(arm);
  while (parse_tf(peer.next("/tf_static ")).size() != 2) {
  }
  // The peer restarts, then the bridge.
  RosPeer late(rig.ros_domain());
  late.obey("listen /tf_static tf latched");
  CHECK(await(late, "/tf_static", {"base", "tool"}).size() == 2);
  bridge.kill();
  auto second = rig.start_bridge({"--export", "*"});
  CHECK(await(late, "/tf_static", {"base", "tool"}).size() == 2);
}

}  // namespace tfdude
