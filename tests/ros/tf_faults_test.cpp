// Restarts, late nodes, foreign frames and messages that are out of the ordinary.

#include <csignal>
#include <string>
#include <vector>

#include "tfdude/client/node.hpp"

#include "ros_rig.hpp"
#include "support/catch.hpp"
#include "support/stranger.hpp"

namespace tfdude {
namespace {

using testing::ContainsSubstring;
using testing::eventually;
using testing::finish;
using testing::Process;
using testing::RosPeer;
using testing::RosRig;
using testing::RosTransform;
using testing::tf_message;

Pose at_x(double x) {
  return *Pose::create(Eigen::Quaterniond::Identity(), Eigen::Vector3d(x, 0, 0));
}

Time at(double seconds) {
  return time_of(1'700'000'000'000'000'000 + static_cast<std::int64_t>(seconds * 1e9));
}

double x_of(Client& client, const std::string& a, const std::string& b) {
  const auto X = client.lookup(a, b);
  return X ? X->pose.translation().x() : -1;
}

std::string owner_of(Client& client, const std::string& id) {
  const auto frames = client.frames();
  if (!frames) return {};
  for (const Frame& frame : *frames) {
    if (frame.id == id) return frame.partition;
  }
  return {};
}

}  // namespace

// Without a check, the threads of the bridge loop for good.
TEST_CASE("ros faults: huge ranges of sequence numbers do not silence the bridge") {
  const RosRig rig;
  auto bridge = rig.start_bridge();
  const RosPeer peer(rig.ros_domain());
  testing::Stranger stranger(rig.ros_domain());
  testing::send_huge_ranges(stranger, stranger.await_participants(2));
  RosPeer other(rig.ros_domain());
  other.obey("advertise /tf_static tf latched");
  other.publish("/tf_static", tf_message(at(0), {{"base", "lidar", at_x(1)}}));
  Client client = rig.client();
  CHECK(eventually([&] { return x_of(client, "base", "lidar") == 1; }));
  bridge.signal(SIGTERM);
  CHECK(bridge.wait(testing::in_time()) == 0);
  CHECK_THAT(bridge.err(), ContainsSubstring("dropped a datagram"));
}

TEST_CASE("ros faults: a late bridge gets the static frames, and both sides may restart") {
  const RosRig rig;
  RosPeer peer(rig.ros_domain());
  peer.obey("advertise /tf_static tf latched");
  peer.publish("/tf_static", tf_message(at(0), {{"base", "lidar", at_x(1)}}));
  Client client = rig.client();
  auto bridge = rig.start_bridge();
  REQUIRE(eventually([&] { return x_of(client, "base", "lidar") == 1; }));

  bridge.kill();
  auto second = rig.start_bridge();
  REQUIRE(eventually([&] { return x_of(client, "base", "lidar") == 1; }));

  peer.process().kill();
  RosPeer other(rig.ros_domain());
  other.advertise("/tf_static", "tf", "latched");
  other.publish("/tf_static", tf_message(at(0), {{"base", "lidar", at_x(2)}}));
  CHECK(eventually([&] { return x_of(client, "base", "lidar") == 2; }));
}

TEST_CASE("ros faults: frames of another partition are not taken, also while it is away") {
  const RosRig rig;
  Client client = rig.client();
  const testing::TemporaryDirectory files;
  const std::string config = files.write(
      "arm.yaml", "partition: arm\nframes:\n  - {id: base}\n  - {id: tool, parent: base}\n");
  auto daemon = rig.dude().start_daemon({"--config", config});
  testing::await_ready(daemon);
  // The witness remembers who is away.
  Node witness = Node::open("witness", {{"w", "", {}}}, rig.dude().options()).value();
  REQUIRE(eventually([&] { return owner_of(client, "tool") == "arm"; }));

  RosPeer peer(rig.ros_domain());
  auto bridge = rig.start_bridge();
  peer.advertise("/tf_static", "tf", "latched");
  const std::string message =
      tf_message(at(0), {{"world", "tool", at_x(5)}, {"tool", "tip", at_x(3)}});
  peer.publish("/tf_static", message);
  REQUIRE(eventually([&] { return x_of(client, "tool", "tip") == 3; }));
  CHECK(x_of(client, "base", "tool") == 0);

  // A bridge that starts while the owner is away does not know its frames.
  daemon.kill();
  REQUIRE(eventually([&] {
    const auto partitions = client.partitions();
    return partitions && !partitions->empty() && !partitions->front().reachable;
  }));
  bridge.kill();
  auto second = rig.start_bridge();
  REQUIRE(second.wait_for_line("never", testing::Clock::now() + std::chrono::milliseconds(300)) ==
          std::nullopt);
  CHECK(owner_of(client, "tool") == "arm");
  auto back = rig.dude().start_daemon({"--config", config});
  testing::await_ready(back);
  REQUIRE(eventually([&] { return x_of(client, "tool", "tip") == 3; }));
  CHECK(owner_of(client, "tool") == "arm");
  CHECK(x_of(client, "base", "tool") == 0);
  second.signal(SIGTERM);
  CHECK(second.wait(testing::in_time()) == 0);
  CHECK_THAT(second.err(), ContainsSubstring("not taken"));
}

TEST_CASE("ros faults: malformed messages are counted, and the next one is taken") {
  const RosRig rig;
  auto bridge = rig.start_bridge();
  Process malformed({"/usr/bin/env", testing::cyclone_on_loopback(), TFDUDE_ROS_MALFORMED,
                     std::to_string(rig.ros_domain())});
  const auto sent = finish(malformed);
  INFO(sent.err);
  REQUIRE(sent.status == 0);
  RosPeer peer(rig.ros_domain());
  peer.advertise("/tf", "tf", "reliable");
  peer.publish("/tf", tf_message(at(1), {{"odom", "base", at_x(1)}}));
  Client client = rig.client();
  REQUIRE(eventually([&] { return x_of(client, "odom", "base") == 1; }));
  bridge.signal(SIGTERM);
  CHECK(bridge.wait(testing::in_time()) == 0);
  CHECK_THAT(bridge.err(), ContainsSubstring("malformed messages of ROS: 6"));
}

TEST_CASE("ros faults: names of 10 kB and odd values are refused, all others taken") {
  const RosRig rig;
  auto bridge = rig.start_bridge();
  RosPeer peer(rig.ros_domain());
  peer.advertise("/tf", "tf", "reliable");
  peer.publish("/tf", tf_message(at(1), {{"odom", std::string(10'000, 'x'), at_x(1)},
                                         {"odom", "odom", at_x(1)},
                                         {"odom", "base", at_x(1)}}));
  peer.publish("/tf", std::to_string(nanoseconds(at(2))) + " odom wheel 0 0 0 0 0 0 nan");
  peer.publish("/tf", std::to_string(nanoseconds(at(2))) + " odom wheel 0 0 0 0 0 0 0.5");
  peer.publish("/tf", std::to_string(nanoseconds(at(2))) + " odom wheel 7 0 0 0 0 0 1.0001");
  Client client = rig.client();
  REQUIRE(eventually([&] { return x_of(client, "odom", "wheel") == 7; }));
  CHECK(x_of(client, "odom", "base") == 1);
  CHECK(client.frames().value().size() == 3);
  bridge.signal(SIGTERM);
  CHECK(bridge.wait(testing::in_time()) == 0);
  CHECK_THAT(bridge.err(), ContainsSubstring("taken=2 not taken: names=1 values=3"));
}

TEST_CASE("ros faults: a thousand frames in one message, in and out") {
  const RosRig rig;
  const auto in = rig.start_bridge();
  Client client = rig.client();
  std::vector<FrameSpec> own{{"root", "", {}}};
  std::vector<RosTransform> foreign;
  for (int i = 0; i < 1000; ++i) {
    const std::string number = std::to_string(i);
    own.push_back({"own_" + number, i % 10 == 0 ? "root" : "own_" + std::to_string(i - 1), {}});
    foreign.push_back({i % 10 == 0 ? "map" : "f_" + std::to_string(i - 1), "f_" + number, at_x(1)});
  }
  Node node = Node::open("robot", own, rig.dude().options()).value();
  auto out = rig.start_bridge({"--export", "robot", "--partition", "ros_2"});
  RosPeer peer(rig.ros_domain());
  peer.obey("listen /tf_static tf latched");
  peer.advertise("/tf", "tf", "reliable");
  peer.publish("/tf", tf_message(at(1), foreign));
  REQUIRE(eventually([&] { return x_of(client, "map", "f_999") == 10; }));
  std::size_t received = 0;
  const bool all = eventually([&] {
    if (const auto line = peer.try_next("/tf_static ")) received = testing::parse_tf(*line).size();
    return received == 1000;
  });
  out.signal(SIGTERM);
  CHECK(out.wait(testing::in_time()) == 0);
  INFO("the last message had " << received << " transforms; the bridge said: " << out.err());
  CHECK(all);
}

TEST_CASE("ros faults: a jump back of time clears the history, and values go on") {
  const RosRig rig;
  const auto bridge = rig.start_bridge();
  RosPeer peer(rig.ros_domain());
  Client client = rig.client();
  peer.advertise("/tf", "tf", "reliable");
  for (int i = 100; i < 110; ++i) {
    peer.publish("/tf", tf_message(at(i), {{"odom", "base", at_x(i)}}));
  }
  REQUIRE(eventually([&] { return x_of(client, "odom", "base") == 109; }));
  peer.publish("/tf", tf_message(at(1), {{"odom", "base", at_x(1)}}));
  REQUIRE(eventually([&] { return x_of(client, "odom", "base") == 1; }));
  CHECK(client.history("base").value().front().samples == 1);
  peer.publish("/tf", tf_message(at(2), {{"odom", "base", at_x(2)}}));
  CHECK(eventually([&] { return x_of(client, "odom", "base") == 2; }));
}

TEST_CASE("ros faults: what came in does not go out again, with two bridges") {
  const RosRig rig;
  Node node =
      Node::open("robot", {{"world", "", {}}, {"arm", "world", {}}}, rig.dude().options()).value();
  const auto one = rig.start_bridge({"--export", "*"});
  const auto two = rig.start_bridge({"--export", "*", "--partition", "ros_2"});
  RosPeer listener(rig.ros_domain());
  listener.obey("listen /tf tf reliable");
  RosPeer static_listener(rig.ros_domain());
  static_listener.obey("listen /tf_static tf latched");
  RosPeer peer(rig.ros_domain());
  peer.advertise("/tf", "tf", "reliable");
  Client client = rig.client();
  REQUIRE(eventually([&] {
    peer.publish("/tf", tf_message(at(0), {{"map", "hello", at_x(0)}}));
    return listener.try_next("/tf ").has_value() && !owner_of(client, "hello").empty();
  }));
  constexpr int kMessages = 50;
  for (int i = 1; i <= kMessages; ++i) {
    peer.publish("/tf", tf_message(at(i), {{"map", "base", at_x(i)}}));
  }
  peer.publish("/tf", tf_message(at(1), {{"map", "end", at_x(0)}}));
  REQUIRE(eventually([&] { return x_of(client, "map", "base") == kMessages; }));
  // The frames of the daemon are sent by both, and by nobody taken.
  CHECK(owner_of(client, "arm") == "robot");
  CHECK(testing::parse_tf(static_listener.next("/tf_static ")).front().child == "arm");
  int seen = 0;
  std::string child;
  while (child != "end") {
    child = testing::parse_tf(listener.next("/tf ")).front().child;
    seen += child == "base" ? 1 : 0;
  }
  CHECK(seen == kMessages);
  CHECK(!listener.try_next("/tf "));
}

}  // namespace tfdude
