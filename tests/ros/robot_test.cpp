// Joints, descriptions and poses, both ways.

#include <algorithm>
#include <chrono>
#include <cmath>
#include <csignal>
#include <fstream>
#include <iterator>
#include <sstream>
#include <string>
#include <vector>

#include "tfdude/client/node.hpp"
#include "tfdude/math/perturbation.hpp"

#include "ros_rig.hpp"
#include "support/catch.hpp"
#include "support/pose_diff.hpp"

namespace tfdude {
namespace {

using testing::Approx;
using testing::ContainsSubstring;
using testing::eventually;
using testing::RosPeer;
using testing::RosRig;

const std::string kRobot = TFDUDE_EXAMPLES "/robots/three_hinges.urdf";

JointInfo joint_of(Client& client, const std::string& partition, const std::string& name) {
  const auto joints = client.joints(partition);
  for (const JointInfo& joint : joints ? *joints : std::vector<JointInfo>()) {
    if (joint.name == name) return joint;
  }
  return {};
}

std::string text_of(const std::string& file) {
  std::ifstream in(file);
  return {std::istreambuf_iterator<char>(in), {}};
}

// FNV-1a, as the peer prints it.
std::string length_and_sum(const std::string& text) {
  std::uint32_t sum = 2166136261U;
  for (const char c : text) sum = (sum ^ static_cast<std::uint8_t>(c)) * 16777619U;
  return std::to_string(text.size()) + ' ' + std::to_string(sum);
}

std::string now_ns() { return std::to_string(nanoseconds(std::chrono::system_clock::now())); }

}  // namespace

TEST_CASE("ros robot: joints of ROS move the robot of a daemon, with the stated deviation") {
  const RosRig rig;
  auto daemon = rig.dude().start_daemon({"--partition", "robot", "--urdf", kRobot});
  testing::await_ready(daemon);
  const auto bridge = rig.start_bridge({"--joints", "0.01"});
  RosPeer peer(rig.ros_domain());
  peer.advertise("/joint_states", "joints", GENERATE("reliable", "best_effort"));
  Client client = rig.client();
  const std::string name = client.joints("robot").value().front().name;
  REQUIRE(eventually([&] {
    peer.publish("/joint_states", now_ns() + " nobody 3 " + name + " 0.25");
    return joint_of(client, "robot", name).position == 0.25;
  }));
  CHECK(joint_of(client, "robot", name).variance == Approx(1e-4));
}

TEST_CASE("ros robot: a joint that nobody has is told once, whatever others publish") {
  const RosRig rig;
  auto daemon = rig.dude().start_daemon({"--partition", "robot", "--urdf", kRobot});
  testing::await_ready(daemon);
  auto bridge = rig.start_bridge({"--joints", "0.01"});
  RosPeer peer(rig.ros_domain());
  peer.advertise("/joint_states", "joints", "reliable");
  Client client = rig.client();
  const std::string name = client.joints("robot").value().front().name;
  for (const double position : {0.125, 0.25, 0.375}) {
    REQUIRE(eventually([&] {
      peer.publish("/joint_states", now_ns() + " nobody 3");
      peer.publish("/joint_states", now_ns() + " another 3");
      peer.publish("/joint_states", now_ns() + ' ' + name + ' ' + std::to_string(position));
      return joint_of(client, "robot", name).position == position;
    }));
  }
  bridge.signal(SIGTERM);
  CHECK(bridge.wait(testing::in_time()) == 0);
  for (const char* const joint : {"'nobody'", "'another'"}) {
    CHECK_THAT(bridge.err(), ContainsSubstring(joint));
    CHECK(bridge.err().find(joint) == bridge.err().rfind(joint));
  }
}

TEST_CASE("ros robot: measured joints are sent, and what ROS publishes does not come back") {
  const RosRig rig;
  auto daemon = rig.dude().start_daemon({"--partition", "robot", "--urdf", kRobot});
  testing::await_ready(daemon);
  Client client = rig.client();
  const auto joints = client.joints("robot").value();
  REQUIRE(joints.size() >= 2);
  const testing::TemporaryDirectory files;
  const auto bridge =
      rig.start_bridge({"--config", files.write("b.yaml",
                                                "joints_in: {stddev: 0.01}\n"
                                                "joints_out: {partitions: [robot], rate: 100}\n")});
  RosPeer peer(rig.ros_domain());
  peer.obey("listen /joint_states joints reliable");
  REQUIRE(client.update_joints({joints[0].name}, {0.5}, {1e-6}));
  CHECK_THAT(peer.next("/joint_states "), ContainsSubstring(' ' + joints[0].name + " 0.5"));

  RosPeer other(rig.ros_domain());
  other.advertise("/joint_states", "joints", "reliable");
  // The first reader that it meets may be that of the other peer.
  REQUIRE(eventually([&] {
    other.publish("/joint_states", now_ns() + ' ' + joints[1].name + " 0.125");
    return joint_of(client, "robot", joints[1].name).position == 0.125;
  }));
  std::string line;
  for (int i = 0; i < 5; ++i) {
    while ((line = peer.next("/joint_states ")).find(" 0.5") == std::string::npos) {
    }
    CHECK(line.find(joints[1].name) == std::string::npos);
  }
}

TEST_CASE("ros robot: a description is served as by a daemon, and a new one replaces it") {
  const RosRig rig;
  RosPeer peer(rig.ros_domain());
  peer.obey("advertise /robot_description string latched");
  peer.publish("/robot_description", "@" + kRobot);
  const auto bridge = rig.start_bridge({"--description", "--joints", "0.001", "--prefix", "r1/"});
  Client client = rig.client();
  REQUIRE(eventually([&] { return client.frames().value().size() > 1; }));
  const auto frames = client.frames().value();
  for (const Frame& frame : frames) {
    // Where the root link is, /tf may say.
    CHECK(frame.partition == (frame.parent.empty() ? "ros" : "robot"));
    CHECK(frame.id.rfind("r1/", 0) == 0);
  }
  const std::string name = client.joints("robot").value().front().name;
  peer.advertise("/joint_states", "joints", "reliable");
  REQUIRE(eventually([&] {
    peer.publish("/joint_states", now_ns() + ' ' + name.substr(3) + " 0.25");
    return joint_of(client, "robot", name).position == 0.25;
  }));

  const testing::TemporaryDirectory files;
  const std::string other =
      files.write("other.urdf", "<robot name=\"other\"><link name=\"only\"/></robot>");
  peer.publish("/robot_description", "this is no URDF");
  peer.publish("/robot_description", "@" + other);
  const auto linked = std::find_if(frames.begin(), frames.end(),
                                   [](const Frame& frame) { return frame.partition == "robot"; });
  REQUIRE(linked != frames.end());
  CHECK(eventually([&] { return client.exists("r1/only") && !client.exists(linked->id); }));
}

TEST_CASE("ros robot: a description that comes after its links on /tf gets them") {
  const RosRig rig;
  RosPeer peer(rig.ros_domain());
  peer.obey("advertise /robot_description string latched");
  const auto bridge = rig.start_bridge({"--description"});
  peer.advertise("/tf", "tf", "reliable");
  Client client = rig.client();
  const auto place = [](double x) {
    return Pose::trusted(Eigen::Quaterniond::Identity(), {x, 0, 0});
  };
  const auto publish = [&](const std::vector<testing::RosTransform>& transforms) {
    const auto now = std::chrono::system_clock::now();
    peer.publish(
        "/tf", testing::tf_message(std::chrono::time_point_cast<Time::duration>(now), transforms));
  };
  REQUIRE(eventually([&] {
    publish({{"odom", "base", place(1)}, {"base", "arm", place(9)}, {"arm", "camera", place(4)}});
    return client.lookup("odom", "camera").has_value();
  }));

  const testing::TemporaryDirectory files;
  peer.publish("/robot_description",
               "@" + files.write("r.urdf",
                                 "<robot name='r'><link name='base'/><link name='arm'/>"
                                 "<joint name='j' type='fixed'><parent link='base'/>"
                                 "<child link='arm'/><origin xyz='2 0 0'/></joint></robot>"));
  const auto partition_of = [&](const std::string& id) {
    const auto frames = client.frames().value();
    for (const Frame& frame : frames) {
      if (frame.id == id) return frame.partition;
    }
    return std::string();
  };
  CHECK(eventually([&] { return partition_of("arm") == "robot"; }));
  CHECK(partition_of("base") == "ros");
  CHECK(partition_of("camera") == "ros");
  // The robot moves on, with what is below it.
  CHECK(eventually([&] {
    publish({{"odom", "base", place(3)}, {"base", "arm", place(9)}, {"arm", "camera", place(4)}});
    const auto X = client.lookup("odom", "camera");
    return X && X->pose.translation().x() == 9;
  }));
}

TEST_CASE("ros robot: a description of 400 kB reaches a late node") {
  const RosRig rig;
  const testing::TemporaryDirectory files;
  const std::string large = text_of(kRobot) + "<!--" + std::string(400'000, 'x') + "-->\n";
  (void)files.write("large.urdf", large);
  const auto bridge =
      rig.start_bridge({"--config", files.write("bridge.yaml", "description_out: large.urdf\n")});
  RosPeer peer(rig.ros_domain(), GENERATE(false, true));
  peer.obey("listen /robot_description string latched");
  CHECK(peer.next("/robot_description ") == length_and_sum(large));
}

TEST_CASE("ros robot: the description that a daemon serves reaches ROS, and its next one") {
  const RosRig rig;
  const auto serving = [&](const std::string& description) {
    NodeOptions options = rig.dude().options();
    options.description = description;
    return Node::open("arm", {{"base", "", {}}}, options).value();
  };
  const auto bridge = rig.start_bridge({"--publish-description", "arm"});
  RosPeer peer(rig.ros_domain());
  peer.obey("listen /robot_description string latched");
  for (const std::string& text : {text_of(kRobot), std::string("<robot name='other'/>")}) {
    const Node arm = serving(text);
    CHECK(peer.next("/robot_description ") == length_and_sum(text));
  }
}

TEST_CASE("ros robot: a path is sent with its covariance about fixed axes") {
  const RosRig rig;
  Transform X{*Pose::create(from_rpy(0.1, 0.2, 1.5), Eigen::Vector3d(1, 2, 3)),
              *Covariance::from_stddev({0.01, 0.02, 0.03, 0.001, 0.002, 0.003})};
  Node node = Node::open("arm",
                         {{"base", "", {}},
                          {"tool", "base", X},
                          {"odd", "base", {{}, StatedCovariance::unspecified()}}},
                         rig.dude().options())
                  .value();
  const testing::TemporaryDirectory files;
  auto bridge = rig.start_bridge(
      {"--config", files.write("b.yaml",
                               "poses_out:\n"
                               "  - {topic: /tool, frame: base, child: tool, rate: 0}\n"
                               "  - {topic: /odd, frame: base, child: odd}\n")});
  RosPeer peer(rig.ros_domain());
  peer.obey("listen /tool pose reliable");
  std::string line;
  int stamp = 0;
  REQUIRE(eventually([&] {
    ++stamp;
    REQUIRE(node.update("tool", X, time_of(1'000'000'000LL * stamp)));
    const auto printed = peer.try_next("/tool ");
    line = printed.value_or("");
    return printed.has_value();
  }));
  std::istringstream text(line);
  std::string token;
  text >> token >> token;
  CHECK(token == "base");
  std::vector<double> numbers;
  for (double number = 0; text >> number;) numbers.push_back(number);
  REQUIRE(numbers.size() == 43);
  CHECK(numbers[0] == Approx(1));
  const Matrix6d expected = ros_covariance(X).of_specified().matrix();
  for (int i = 0; i < 6; ++i) {
    for (int j = 0; j < 6; ++j) {
      CHECK(std::abs(numbers[static_cast<std::size_t>(7 + 6 * i + j)] - expected(i, j)) < 1e-12);
    }
  }
  bridge.signal(SIGTERM);
  CHECK(bridge.wait(testing::in_time()) == 0);
  CHECK_THAT(bridge.err(), ContainsSubstring("not sent to /odd"));
}

TEST_CASE("ros robot: poses and odometry are observed, and the gate's answers are counted") {
  const RosRig rig;
  Transform uncertain{{}, *Covariance::from_stddev({1, 1, 1, 0.1, 0.1, 0.1})};
  Node node = Node::open("map", {{"map", "", {}}, {"base", "map", uncertain}}, rig.dude().options())
                  .value();
  const testing::TemporaryDirectory files;
  auto bridge = rig.start_bridge({"--config", files.write("b.yaml",
                                                          "poses_in:\n"
                                                          "  - {topic: /gps, child: base}\n"
                                                          "  - {topic: /odom, type: odometry}\n")});
  RosPeer peer(rig.ros_domain());
  peer.advertise("/gps", "pose", "reliable");
  peer.advertise("/odom", "odometry", "reliable");
  const auto x = [&] { return node.lookup("map", "base").value().pose.translation().x(); };
  peer.publish("/gps", "0 map 0.5 0 0 0 0 0 1 0.01");
  REQUIRE(eventually([&] { return x() > 0.4; }));
  const double after_gps = x();
  peer.publish("/odom", "0 map base 0.6 0 0 0 0 0 1 0.0001");
  REQUIRE(eventually([&] { return x() > after_gps + 0.05; }));
  const double after_odometry = x();
  peer.publish("/gps", "0 map 500 0 0 0 0 0 1 0.01");
  peer.publish("/gps", "0 map 1 0 0 0 0 0 1 0");
  peer.publish("/gps", "0 map 0.6 0 0 0 0 0 1 0.0001");
  REQUIRE(eventually([&] { return std::abs(x() - after_odometry) > 1e-9; }));
  CHECK(x() < 1);
  bridge.signal(SIGTERM);
  CHECK(bridge.wait(testing::in_time()) == 0);
  CHECK_THAT(bridge.err(), ContainsSubstring("/gps: accepted=2 rejected by the gate=1 failed=1"));
  CHECK_THAT(bridge.err(), ContainsSubstring("/odom: accepted=1"));
}

TEST_CASE("ros robot: the clock of ROS is that of those who have an external clock") {
  const RosRig rig;
  const auto bridge = rig.start_bridge({"--clock", "ros"});
  auto options = rig.dude().options(Milliseconds(200));
  options.clock = ClockKind::kExternal;
  Node node = Node::open("sim", {{"a", "", {}}, {"b", "a", {}}}, options).value();
  RosPeer peer(rig.ros_domain());
  peer.advertise("/clock", "clock", "best_effort");
  const auto await = [&](std::int64_t ns) {
    return eventually([&] {
      peer.publish("/clock", std::to_string(ns));
      return node.now() == time_of(ns);
    });
  };
  REQUIRE(await(5'000'000'000));
  REQUIRE(node.update("b", {}, time_of(5'000'000'000)));
  CHECK(node.history("b").value().front().samples == 1);
  // A jump back clears what comes later.
  REQUIRE(await(1'000'000'000));
  CHECK(eventually([&] {
    return node.history("b").value().empty() || node.history("b").value().front().samples == 0;
  }));
}

TEST_CASE("ros robot: the clock of a simulator in tf-dude is that of ROS") {
  const RosRig rig;
  const testing::TemporaryDirectory files;
  const auto bridge = rig.start_bridge(
      {"--config", files.write("b.yaml", "clock: external\nclock_out: {rate: 100}\n")});
  auto options = rig.dude().options();
  options.clock = ClockKind::kExternal;
  Client simulator = Client::open(options).value();
  RosPeer peer(rig.ros_domain());
  peer.obey("listen /clock clock best_effort");
  for (const std::int64_t ns : {5'000'000'000LL, 6'000'000'000LL, 1'000'000'000LL}) {
    const std::string text = std::to_string(ns);
    REQUIRE(eventually([&] {
      REQUIRE(simulator.publish_clock(ExternalTime(std::chrono::nanoseconds(ns))));
      return peer.try_next("/clock ") == text;
    }));
    // While it stands still, it is sent again.
    CHECK(peer.next("/clock ") == text);
  }
}

TEST_CASE("ros robot: odometry of a moving frame is sent with its velocity") {
  const RosRig rig;
  const Covariance small = *Covariance::from_stddev({1e-3, 1e-3, 1e-3, 1e-4, 1e-4, 1e-4});
  Node node =
      Node::open("base", {{"odom", "", {}}, {"base", "odom", {{}, small}}}, rig.dude().options())
          .value();
  const testing::TemporaryDirectory files;
  const auto bridge = rig.start_bridge(
      {"--config",
       files.write(
           "b.yaml",
           "poses_out: [{topic: /odom, type: odometry, frame: odom, child: base, rate: 0}]\n")});
  RosPeer peer(rig.ros_domain());
  peer.obey("listen /odom odometry reliable");
  int i = 0;
  std::string line;
  REQUIRE(eventually([&] {
    ++i;  // 0.5 m/s
    const Pose X = *Pose::create(Eigen::Quaterniond::Identity(), Eigen::Vector3d(0.05 * i, 0, 0));
    REQUIRE(node.update("base", {X, small}, time_of(100'000'000LL * i)));
    const auto printed = peer.try_next("/odom ");
    line = printed.value_or("");
    return printed.has_value();
  }));
  CHECK_THAT(line, ContainsSubstring(" odom base "));
}

}  // namespace tfdude
