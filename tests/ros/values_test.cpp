// Poses of filters as values of edges: a peer of another vendor plays a robot's localisation.

#include <array>
#include <cmath>
#include <csignal>
#include <random>
#include <sstream>
#include <string>

#include "tfdude/client/node.hpp"
#include "tfdude/math/perturbation.hpp"

#include "ros_rig.hpp"
#include "support/catch.hpp"
#include "support/sampling.hpp"

namespace tfdude {
namespace {

using testing::ContainsSubstring;
using testing::eventually;
using testing::RosPeer;
using testing::RosRig;

const std::array<double, 6> kWalk{0.06, 0.06, 0.06, 0.03, 0.03, 0.03};  // after one second
const std::array<double, 6> kFilter{0.05, 0.04, 0.03, 0.01, 0.01, 0.02};
constexpr double kPeriod = 0.05;

Time at(int k) { return time_of(1'700'000'000'000'000'000 + k * 50'000'000LL); }

std::string numbers_of(const Pose& X) {
  std::ostringstream text;
  text.precision(17);
  const Eigen::Vector3d p = X.translation();
  const Eigen::Quaterniond q = X.rotation();
  for (const double one : {p.x(), p.y(), p.z(), q.x(), q.y(), q.z(), q.w()}) text << ' ' << one;
  return text.str();
}

// As a message has it: about the axes of its frame.
std::string covariance_of(const Transform& X) {
  std::ostringstream text;
  text.precision(17);
  const Matrix6d sigma = ros_covariance(X).of_specified().matrix();
  for (int i = 0; i < 6; ++i) {
    for (int j = 0; j < 6; ++j) text << ' ' << sigma(i, j);
  }
  return text.str();
}

// A robot that drives a curve, its wheels, and a filter with other errors each time.
struct Robot {
  explicit Robot(std::uint64_t seed) : random(seed) {}

  Pose noise(const std::array<double, 6>& stddev, double factor) {
    Twist xi;
    for (int i = 0; i < 6; ++i) {
      xi[i] = factor * stddev[static_cast<std::size_t>(i)] * std::normal_distribution<>()(random);
    }
    return exp(xi);
  }
  void drive() {
    const Twist motion = (Twist() << 0.05, 0, 0, 0, 0, 0.025).finished();
    X_MB = X_MB * exp(motion);
    X_OB = X_OB * exp(motion) * noise(kWalk, std::sqrt(kPeriod));
  }

  std::mt19937_64 random;
  Pose X_MB = *Pose::create(from_rpy(0, 0, 0.6), Eigen::Vector3d(1, 2, 0.1));
  Pose X_OB;
};

double nees(const Transform& X, const Pose& truth) {
  return testing::squared_distance(log(X.pose.inverse() * truth),
                                   X.covariance.of_specified().matrix());
}

const char* const kConfig =
    "drifts: {base_link: [0.06, 0.06, 0.06, 0.03, 0.03, 0.03]}\n"
    "values_in:\n"
    "  - {topic: /odometry/filtered, type: odometry}\n"
    "  - {topic: /amcl_pose, child: base_link, edge: odom}\n";

}  // namespace

// AMCL, and a filter of wheel odometry. The gripper belongs to a daemon, and is known exactly.
TEST_CASE("ros values: where a gripper is in the map is as uncertain as localisation says") {
  constexpr std::uint64_t kSeed = 5;
  constexpr int kFixes = 40;
  constexpr int kPeriods = 10;  // between two of them
  CAPTURE(kSeed);
  const RosRig rig;
  const testing::TemporaryDirectory files;
  auto bridge = rig.start_bridge({"--config", files.write("b.yaml", kConfig)});
  const Pose X_BG = *Pose::create(from_rpy(0, 0.5, 0), Eigen::Vector3d(0.6, 0, 0.4));
  const Node arm = Node::open("arm", {{"gripper", "base_link", {X_BG, StatedCovariance::exact()}}},
                              rig.dude().options())
                       .value();
  RosPeer peer(rig.ros_domain());
  peer.advertise("/tf", "tf", "reliable");
  peer.advertise("/odometry/filtered", "odometry", "reliable");
  peer.advertise("/amcl_pose", "pose", "reliable");
  Client client = rig.client();
  Robot robot(kSeed);
  std::vector<Pose> truth;
  Pose X_MO;
  double sum = 0;
  double sum_before = 0;
  for (int k = 0; k < kFixes * kPeriods; ++k) {
    if (k > 0) robot.drive();
    truth.push_back(robot.X_MB);
    Query now;
    now.at = at(k);
    // The same transform is also on /tf, as nodes do it. AMCL's holds for a while in advance.
    REQUIRE(eventually([&] {
      const std::string stamp = std::to_string(nanoseconds(at(k)));
      peer.publish("/odometry/filtered", stamp + " odom base_link" + numbers_of(robot.X_OB) + " 0");
      peer.publish("/tf", testing::tf_message(at(k), {{"odom", "base_link", robot.X_OB}}));
      if (k > 20) peer.publish("/tf", testing::tf_message(at(k + 20), {{"map", "odom", X_MO}}));
      // Once the topic is heard, too: that of /tf has no covariance, and is dropped then.
      const auto X = client.lookup("odom", "base_link", now, Milliseconds(200));
      return X && X->covariance.complete();
    }));
    if (k % kPeriods != kPeriods - 1) continue;
    Query then;
    then.at = at(k - 2);
    const Pose& there = truth[static_cast<std::size_t>(k - 2)];
    const Transform Z{there * robot.noise(kFilter, 1), *Covariance::from_stddev(kFilter)};
    X_MO = Z.pose * client.lookup("odom", "base_link", then).value().pose.inverse();
    REQUIRE(eventually([&] {
      peer.publish("/amcl_pose", std::to_string(nanoseconds(*then.at)) + " map" +
                                     numbers_of(Z.pose) + covariance_of(Z));
      const auto X = client.lookup("map", "base_link", then, Milliseconds(200));
      return X && log(X->pose.inverse() * Z.pose).norm() < 1e-6;
    }));
    // The first pose adds the edge, which has a sample of now from the next odometry on.
    if (k < 2 * kPeriods) continue;
    const auto X = client.lookup("map", "gripper", now, Milliseconds(1000));
    REQUIRE(X);
    REQUIRE(X->covariance.complete());
    sum += nees(*X, truth.back() * X_BG);
    then.at = at(k - 5);
    const auto before = client.lookup("map", "gripper", then);
    REQUIRE(before);
    sum_before += nees(*before, truth[static_cast<std::size_t>(k - 5)] * X_BG);
  }
  // χ² of 6 · 38 degrees of freedom: 95 % are within 0.825 and 1.193 of its mean.
  for (const double mean : {sum / (kFixes - 2), sum_before / (kFixes - 2)}) {
    CAPTURE(mean);
    CHECK(mean > 6 * 0.82);
    CHECK(mean < 6 * 1.20);
  }
  const auto shown = rig.dude().cli({"lookup", "map", "gripper"});
  CHECK_THAT(shown.out, ContainsSubstring("std dev") && !ContainsSubstring("unspecified"));
  bridge.signal(SIGTERM);
  CHECK(bridge.wait(testing::in_time()) == 0);
  CHECK_THAT(bridge.err(), ContainsSubstring("/amcl_pose: values taken="));
  CHECK_THAT(bridge.err(), !ContainsSubstring("two publishers"));
}

TEST_CASE("ros values: poses at instants without data are counted, and told once") {
  const RosRig rig;
  const testing::TemporaryDirectory files;
  auto bridge = rig.start_bridge(
      {"--config", files.write("b.yaml",
                               "values_in:\n"
                               "  - {topic: /amcl_pose, child: base_link, edge: odom}\n")});
  RosPeer peer(rig.ros_domain());
  peer.advertise("/tf", "tf", "reliable");
  peer.advertise("/amcl_pose", "pose", "reliable");
  Client client = rig.client();
  REQUIRE(eventually([&] {
    peer.publish("/tf", testing::tf_message(at(0), {{"odom", "base_link", Pose()}}));
    return client.exists("base_link");
  }));
  for (int k = 1; k <= 3; ++k) {
    const std::string stamp = std::to_string(nanoseconds(at(-100 * k)));
    peer.publish("/amcl_pose", stamp + " map" + numbers_of(Pose()) + " 0.01");
  }
  peer.publish("/amcl_pose", "0 map" + numbers_of(Pose()) + " 0.01");
  REQUIRE(eventually([&] {
    (void)bridge.runs();
    return bridge.err().find("/amcl_pose: its message has no stamp") != std::string::npos;
  }));
  bridge.signal(SIGTERM);
  CHECK(bridge.wait(testing::in_time()) == 0);
  const std::string log = bridge.err();
  const std::string said = "the edge of 'base_link' has no data";
  CHECK_THAT(log, ContainsSubstring(said));
  CHECK(log.find(said) == log.rfind(said));
  CHECK_THAT(log, ContainsSubstring("of their stamps: unstamped=1 "));
}

TEST_CASE("ros values: a pose may be the value of its child's own edge") {
  const RosRig rig;
  const testing::TemporaryDirectory files;
  auto bridge = rig.start_bridge(
      {"--config", files.write("b.yaml",
                               "tf_in: false\n"
                               "values_in:\n"
                               "  - {topic: /vio, child: camera, covariance: {none_from: 9999}}\n"
                               "  - {topic: /odom, type: odometry, edge: odom}\n")});
  RosPeer peer(rig.ros_domain());
  peer.advertise("/vio", "pose", "reliable");
  peer.advertise("/odom", "odometry", "reliable");
  Client client = rig.client();
  REQUIRE(eventually([&] {
    peer.publish("/vio", std::to_string(nanoseconds(at(0))) + " world 1 2 3 0 0 0 1 0.04");
    return client.exists("camera");
  }));
  auto X = client.lookup("world", "camera");
  REQUIRE(X);
  REQUIRE(X->covariance.complete());
  CHECK(std::abs(X->covariance.of_specified().matrix()(5, 5) - 0.04) < 1e-12);
  // Zeros are no covariance.
  REQUIRE(eventually([&] {
    peer.publish("/vio", std::to_string(nanoseconds(at(1))) + " world 1 2 4 0 0 0 1 0");
    X = client.lookup("world", "camera");
    return X && X->pose.translation().z() == 4;
  }));
  CHECK(!X->covariance.complete());
  // Of an edge that another one determines, they are rejected.
  peer.publish("/odom", std::to_string(nanoseconds(at(1))) + " map base 1 2 4 0 0 0 1 0");
  REQUIRE(eventually([&] {
    (void)bridge.runs();
    return bridge.err().find("/odom: covariance: the message has none") != std::string::npos;
  }));
}

// A tag on a wall, seen by a camera on a base whose odometry drifts.
TEST_CASE(
    "ros values: a tag stands still in odom, and is as certain as the camera where it sees it") {
  constexpr std::uint64_t kSeed = 15;
  constexpr int kSightings = 40;
  CAPTURE(kSeed);
  const std::array<double, 6> camera{0.005, 0.005, 0.01, 0.01, 0.01, 0.005};
  const RosRig rig;
  const testing::TemporaryDirectory files;
  auto bridge = rig.start_bridge(
      {"--config",
       files.write("b.yaml",
                   "drifts: {base_link: [0.06, 0.06, 0.06, 0.03, 0.03, 0.03]}\n"
                   "detections_in:\n"
                   "  - {topic: /tags, type: isaac_apriltag, under: odom, gate: 1, drop_after: 1,\n"
                   "     covariance: {stddev: [0.005, 0.005, 0.01, 0.01, 0.01, 0.005]}}\n")});
  const Node arm = Node::open("arm", {{"camera", "base_link", {Pose(), StatedCovariance::exact()}}},
                              rig.dude().options())
                       .value();
  RosPeer peer(rig.ros_domain());
  peer.advertise("/tf", "tf", "reliable");
  peer.advertise("/tags", "tags", "reliable");
  Client client = rig.client();
  Robot robot(kSeed);
  const Pose X_MT = robot.X_MB * *Pose::create(from_rpy(0, 0.1, 0.2), Eigen::Vector3d(3, 1, 1));
  double most = 0;  // of the variances that a sighting leaves, in sum
  for (const double one : camera) most += one * one;
  double sum = 0;
  for (int k = 0; k < kSightings; ++k) {
    for (int i = 0; i < 10 && k > 0; ++i) robot.drive();
    Query now;
    now.at = at(10 * k);
    REQUIRE(eventually([&] {
      peer.publish("/tf", testing::tf_message(*now.at, {{"odom", "base_link", robot.X_OB}}));
      return client.lookup("odom", "camera", now, Milliseconds(200)).has_value();
    }));
    // The message's errors are along the axes of the camera.
    const Pose X_CT = robot.X_MB.inverse() * X_MT;
    const Twist error = log(robot.noise(camera, 1));
    const Eigen::Vector3d turn = error.tail<3>();
    const Pose seen = *Pose::create(
        Eigen::Quaterniond(Eigen::AngleAxisd(turn.norm(), turn.normalized())) * X_CT.rotation(),
        X_CT.translation() + error.head<3>());
    Result<StampedTransform> X;
    REQUIRE(eventually([&] {
      peer.publish("/tags",
                   std::to_string(nanoseconds(*now.at)) + " camera 7" + numbers_of(seen) + " 0");
      X = client.lookup("camera", "tag_7", now, Milliseconds(100));
      return X && X->covariance.complete() &&
             X->covariance.of_specified().matrix().trace() <= most * (1 + 1e-9);
    }));
    // The motion since the sighting before hides most of what that has said.
    sum += nees(*X, X_CT);
  }
  const double mean = sum / kSightings;
  CAPTURE(mean);
  // χ² of 6 · 40 degrees of freedom, nearly: 95 % are within 0.83 and 1.19 of its mean.
  CHECK(mean > 6 * 0.82);
  CHECK(mean < 6 * 1.20);
  // What the camera does not see any more is removed.
  CHECK(eventually([&] { return !client.exists("tag_7"); }));
  CHECK(client.exists("base_link"));
  bridge.signal(SIGTERM);
  CHECK(bridge.wait(testing::in_time()) == 0);
  CHECK_THAT(bridge.err(), ContainsSubstring("/tags: objects seen=") &&
                               ContainsSubstring("failed=0; frames removed=1"));
}

TEST_CASE("ros values: each array of detections makes frames below the camera") {
  const RosRig rig;
  const testing::TemporaryDirectory files;
  auto bridge = rig.start_bridge(
      {"--config", files.write("b.yaml",
                               "tf_in: {except: [\"tag36h11:*\"]}\n"
                               "detections_in:\n"
                               "  - {topic: /objects, type: detection3d, frame: \"{}\"}\n"
                               "  - {topic: /markers, type: aruco, frame: \"marker_{}\",\n"
                               "     covariance: {stddev: [0.1, 0.1, 0.1, 0.1, 0.1, 0.1]}}\n"
                               "  - {topic: /tf, type: tf, ids: [\"tag36h11:*\"],\n"
                               "     covariance: {per_metre: [0.1, 0.1, 0.1, 0.1, 0.1, 0.1]}}\n")});
  RosPeer peer(rig.ros_domain());
  peer.advertise("/objects", "objects", "reliable");
  peer.advertise("/markers", "markers", "reliable");
  peer.advertise("/tf", "tf", "reliable");
  Client client = rig.client();
  const auto variance = [&](const std::string& frame) {
    const auto X = client.lookup("camera", frame);
    if (!X || !X->covariance.complete()) return -1.0;
    return X->covariance.of_specified().matrix()(0, 0);
  };
  REQUIRE(eventually([&] {
    const std::string stamp = std::to_string(nanoseconds(at(0)));
    peer.publish("/objects", stamp + " camera cup 0 0 1 0 0 0 1 0.25 bowl 0 0 2 0 0 0 1 0");
    peer.publish("/markers", stamp + " camera 5 0 0 1 0 0 0 1 0");
    peer.publish("/tf", testing::tf_message(at(0), {{"camera", "tag36h11:3",
                                                     *Pose::create(Eigen::Quaterniond::Identity(),
                                                                   Eigen::Vector3d(0, 0, 2))}}));
    return client.exists("bowl") && client.exists("marker_5") && client.exists("tag36h11:3");
  }));
  CHECK(std::abs(variance("cup") - 0.25) < 1e-12);
  CHECK(variance("bowl") == -1);
  CHECK(std::abs(variance("marker_5") - 0.01) < 1e-12);
  CHECK(std::abs(variance("tag36h11:3") - 0.04) < 1e-12);
}

// A receiver and a localisation of another vendor: places on the Earth.
TEST_CASE("ros values: a fix and a geodetic pose place frames on the Earth") {
  const RosRig rig;
  const testing::TemporaryDirectory files;
  auto bridge = rig.start_bridge(
      {"--config", files.write("b.yaml",
                               "values_in:\n"
                               "  - {topic: /fix, type: navsat, child: gps}\n"
                               "  - {topic: /geopose, type: geopose, child: map}\n"
                               "poses_in: [{topic: /measured, type: navsat, child: gps}]\n")});
  RosPeer peer(rig.ros_domain());
  peer.advertise("/fix", "navsat", "reliable");
  peer.advertise("/geopose", "geopose", "reliable");
  Client client = rig.client();
  const std::string stamp = std::to_string(nanoseconds(at(0)));
  peer.publish("/fix", stamp + " gps_link -1 48 11.5 519 2 4");
  peer.publish("/fix", stamp + " gps_link 0 nan 11.5 519 2 4");
  peer.publish("/fix", stamp + " gps_link 2 48 11.5 519 2 4");
  peer.publish("/geopose", stamp + " any 48 11.5 519 0 0 0.6 0.8");
  REQUIRE(eventually([&] {
    return client.lookup("earth", "gps").has_value() && client.lookup("earth", "map").has_value();
  }));
  const auto X_EG = client.lookup("earth", "gps", Query{});
  REQUIRE(X_EG);
  CHECK(X_EG->stamp == at(0));
  // By the closed form for WGS84, in Python.
  const Eigen::Vector3d expected(4190221.812989198, 852510.2629479947, 4717262.022279829);
  CHECK((X_EG->pose.translation() - expected).norm() < 1e-6);
  const Matrix6d sigma = X_EG->covariance.of_specified().matrix();
  CHECK((sigma.topLeftCorner<3, 3>() - 4 * Eigen::Matrix3d::Identity()).norm() < 1e-9);
  // Both are at one place: the map is turned to the north.
  const auto X_GM = client.lookup("gps", "map");
  REQUIRE(X_GM);
  CHECK(X_GM->pose.translation().norm() < 1e-6);
  CHECK(std::abs(X_GM->pose.rotation().z() - 0.6) < 1e-9);
  CHECK_FALSE(X_GM->covariance.complete());
  // Another receiver measures the same place, once: both together are twice as certain. What it
  // sends before the bridge has matched it, too, may be lost.
  peer.advertise("/measured", "navsat", "reliable");
  REQUIRE(eventually([&] {
    peer.publish("/measured", stamp + " gps_link 2 48 11.5 519 0 0");
    return bridge.runs() && bridge.err().find("the message has none") != std::string::npos;
  }));
  for (int i = 0; i < 2; ++i) peer.publish("/measured", stamp + " gps_link 2 48 11.5 519 2 4");
  REQUIRE(eventually([&] {
    const auto X = client.lookup("earth", "gps", Query{});
    return X && std::abs(X->covariance.of_specified().matrix()(0, 0) - 2) < 1e-6;
  }));
  bridge.signal(SIGTERM);
  REQUIRE(bridge.wait(testing::in_time()) == 0);
  CHECK_THAT(bridge.err(), ContainsSubstring("/fix: values taken=1 failed=0 without a place=2"));
  CHECK_THAT(bridge.err(), ContainsSubstring("/geopose: values taken=1 failed=0"));
  CHECK_THAT(bridge.err(),
             ContainsSubstring("/measured: accepted=1 rejected by the gate=0 failed="));
  CHECK_THAT(bridge.err(),
             ContainsSubstring(" without a place=0; of their stamps: unstamped=0 same=1"));
}

}  // namespace tfdude
