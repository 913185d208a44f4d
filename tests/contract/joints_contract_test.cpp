// Joints over partitions, over each transport.

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <tuple>
#include <vector>

#include "tfdude/client/client.hpp"
#include "tfdude/client/node.hpp"
#include "tfdude/client/watch.hpp"
#include "tfdude/recording/recording.hpp"
#include "tfdude/recording/recording_writer.hpp"

#include "support/catch.hpp"
#include "support/joint_frames.hpp"
#include "support/networks.hpp"
#include "support/pose_diff.hpp"
#include "support/process.hpp"

namespace tfdude {
namespace {

using testing::ContainsSubstring;
using testing::following;
using testing::Join;
using testing::joined_by;
using testing::moved_by;
using testing::outcome;
using testing::revolute_named;
using testing::yaw;
using Names = std::vector<std::string>;
using Numbers = std::vector<double>;

constexpr std::chrono::seconds kLong{20};

Time wall_clock() {
  return std::chrono::time_point_cast<Time::duration>(std::chrono::system_clock::now());
}

// A published value takes a while to arrive.
template <class Condition>
bool comes_true(Condition condition) {
  const auto end = std::chrono::steady_clock::now() + kLong;
  while (!condition()) {
    if (std::chrono::steady_clock::now() > end) return false;
    std::this_thread::sleep_for(Milliseconds(1));
  }
  return true;
}

// world - turret (base) - upper - fore (arm) - hand (tool), which follows the elbow. All about z.
struct Robot {
  explicit Robot(const Join& join) {
    base.emplace(
        Node::open(join("base"), "base",
                   {{"world", "", {}}, moved_by("turret", "world", revolute_named("turn"))})
            .value());
    JointSpec elbow = revolute_named("elbow");
    elbow.coupled = true;
    arm.emplace(Node::open(join("arm"), "arm",
                           {moved_by("upper", "turret", revolute_named("shoulder")),
                            moved_by("fore", "upper", elbow)})
                    .value());
    tool.emplace(Node::open(join("tool"), "tool",
                            {moved_by("hand", "fore", following("wrist", "elbow", -1, 0))})
                     .value());
    client.emplace(Client::open(join("")).value());
  }
  std::optional<Node> base;
  std::optional<Node> arm;
  std::optional<Node> tool;
  std::optional<Client> client;
};

TEST_CASE("joints: a position without a variance has that of its owner's configuration") {
  const Join join = joined_by(GENERATE(from_range(testing::networks())));
  JointSpec elbow = revolute_named("elbow");
  elbow.coupled = true;
  elbow.sample_variance = 0.04;
  JointSpec wrist = following("wrist", "elbow", -0.5, 0);
  wrist.sample_variance = 0.01;
  const Node arm = Node::open(join("arm"), "arm",
                              {{"upper", "", {}},
                               moved_by("fore", "upper", elbow),
                               moved_by("side", "upper", revolute_named("shoulder"))})
                       .value();
  const Node tool = Node::open(join("tool"), "tool", {moved_by("hand", "fore", wrist)}).value();
  Client client = Client::open(join("")).value();
  const auto variances = [&] {
    const auto of_arm = client.joints("arm");
    const auto of_tool = client.joints("tool");
    REQUIRE(of_arm);
    REQUIRE(of_tool);
    return std::tuple{(*of_arm)[0].variance, (*of_arm)[1].variance, (*of_tool)[0].variance};
  };
  REQUIRE(client.update_joints(std::vector<JointValue>{{"elbow", 0.5}, {"shoulder", 0.25}}));
  CHECK(variances() ==
        std::tuple{std::optional(0.04), std::optional<double>(), std::optional(0.01)});
  // What a sample says counts.
  REQUIRE(client.update_joints(std::vector<JointValue>{{"elbow", 0.5, 1.0}, {"shoulder", 1, 4.0}}));
  CHECK(variances() == std::tuple{std::optional(1.0), std::optional(4.0), std::optional(0.25)});
}

TEST_CASE("joints: published positions reach the owners of joints and of those that mimic them") {
  Robot robot(joined_by(GENERATE(from_range(testing::networks()))));
  REQUIRE(robot.client->publish_joints({"turn", "shoulder", "elbow"}, {0.1, 0.2, 0.4},
                                       {1e-4, 4e-4, 9e-4}));
  const auto has_come = [&](const char* a, const char* b, double angle) {
    return comes_true([&] { return std::abs(yaw(robot.client->lookup(a, b)) - angle) < 1e-12; });
  };
  CHECK(has_come("world", "fore", 0.7));
  CHECK(has_come("fore", "hand", -0.4));
  // The hand keeps its direction whatever the elbow does, so the elbow's error does not turn it.
  const auto X_WH = robot.client->lookup("world", "hand", Query{});
  REQUIRE(X_WH);
  CHECK(std::abs(X_WH->covariance.of_specified().stddev()[5] - std::sqrt(5e-4)) < 1e-9);
  CHECK(X_WH->basis.sources == Names{"joint elbow"});
}

TEST_CASE("joints: published positions arrive although the client ends at once") {
  const Join join = joined_by(GENERATE(from_range(testing::networks())));
  Robot robot(join);
  for (int run = 1; run <= 5; ++run) {
    INFO("run " << run);
    const double angle = 0.1 * run;
    {
      auto passing = Client::open(join("")).value();
      REQUIRE(outcome(passing.publish_joints({"turn", "elbow"}, {angle, angle}, {0, 0})) == "ok");
    }
    const auto has_come = [&](const char* a, const char* b, double x) {
      return comes_true([&] { return std::abs(yaw(robot.client->lookup(a, b)) - x) < 1e-12; });
    };
    CHECK(has_come("world", "turret", angle));
    CHECK(has_come("fore", "hand", -angle));
  }
}

TEST_CASE("joints: positions without a variance make a lookup name the edges") {
  Robot robot(joined_by(GENERATE(from_range(testing::networks()))));
  REQUIRE(robot.client->update_joints({"shoulder", "elbow"}, {0.2, 0.4}));
  const auto X = robot.client->lookup("world", "fore", Query{});
  REQUIRE(X);
  CHECK(X->basis.unspecified == Names{"upper", "fore"});
  REQUIRE(robot.client->update_joints(
      std::vector<JointValue>{{"shoulder", 0.2, 1e-4}, {"elbow", 0.4}}));
  const auto Y = robot.client->lookup("world", "fore", Query{});
  REQUIRE(Y);
  CHECK(Y->basis.unspecified == Names{"fore"});
  const auto joints = robot.client->joints("arm");
  REQUIRE(joints);
  for (const JointInfo& joint : *joints) {
    CHECK(joint.variance.has_value() == (joint.name == "shoulder"));
  }
}

TEST_CASE("joints: an update is visible when the call returns and bad input is rejected") {
  Robot robot(joined_by(GENERATE(from_range(testing::networks()))));
  Client& client = *robot.client;
  CHECK(outcome(client.update_joints({"turn", "elbow"}, {0.5, 0.25}, {0, 0})) == "ok");
  CHECK(std::abs(yaw(client.lookup("world", "turret")) - 0.5) < 1e-12);
  CHECK(std::abs(yaw(client.lookup("fore", "hand")) + 0.25) < 1e-12);
  CHECK(outcome(client.update_joints({"knee"}, {0}, {0})) == "unknown_joint");
  CHECK(outcome(client.publish_joints({"knee"}, {0}, {0})) == "unknown_joint");
  CHECK(outcome(client.update_joints({"elbow"}, {0, 1}, {0})) == "invalid_input");
  CHECK(outcome(client.update_joints({"elbow"}, {0}, {-1})) == "invalid_input");
  CHECK(outcome(client.update_joints({"wrist"}, {0}, {1})) == "invalid_input");
  // Outside the limits: applied, and counted.
  CHECK(outcome(client.update_joints({"elbow"}, {3}, {0})) == "ok");
  const auto joints = client.joints("arm");
  REQUIRE(joints);
  REQUIRE(joints->size() == 2);
  CHECK((*joints)[0].name == "elbow");
  CHECK((*joints)[0].position == 3);
  CHECK((*joints)[0].outside == 1);
  CHECK((*joints)[0].limits->upper == 2);
  CHECK((*joints)[1].measured == false);
  CHECK(client.joints("tool").value().at(0).mimic->joint == "elbow");
  CHECK(outcome(client.joints("legs")) == "unknown_partition");
  CHECK(outcome(robot.tool->correlate("hand", {})) == "invalid_input");
}

TEST_CASE("joints: a lookup sees all positions of one stamp also over several owners") {
  Robot robot(joined_by(GENERATE(from_range(testing::networks()))));
  const Time start = wall_clock();
  std::atomic<bool> stop{false};
  REQUIRE(robot.client->update_joints({"turn", "shoulder"}, {0, 0}, {0, 0}, start));
  // The two turn against each other.
  std::thread controller([&] {
    for (int i = 1; !stop; ++i) {
      const double angle = 0.001 * (i % 1000);
      (void)robot.arm->publish_joints({"turn", "shoulder"}, {angle, -angle}, {0, 0},
                                      start + Milliseconds(i));
      std::this_thread::sleep_for(Milliseconds(1));
    }
  });
  int seen = 0;
  CHECK(comes_true([&] {
    const auto X = robot.client->lookup("world", "upper", Query{});
    if (X && X->stamp) {
      CHECK(std::abs(yaw(X)) < 1e-9);
      ++seen;
    }
    return seen > 300;
  }));
  stop = true;
  controller.join();
}

TEST_CASE("joints: between positions far apart all participants see the way of the joint") {
  const Join join = joined_by(GENERATE(from_range(testing::networks())));
  JointSpec turn = revolute_named("turn");
  turn.limits = JointLimits{-3, 3};
  turn.coupled = true;
  JointSpec wrist = following("wrist", "turn", 2, 0);
  wrist.limits = JointLimits{-6, 6};
  const auto base =
      Node::open(join("base"), "base", {{"world", "", {}}, moved_by("turret", "world", turn)})
          .value();
  const auto tool = Node::open(join("tool"), "tool", {moved_by("hand", "turret", wrist)}).value();
  auto client = Client::open(join("")).value();
  WatchOptions composed;
  composed.composed = true;
  const std::vector<PathWatch> watches{client.watch("world", "hand").value(),
                                       client.watch("world", "hand", composed).value()};
  const auto at = [](int milliseconds) { return Time(Milliseconds(milliseconds)); };
  const auto turn_to = [&](double position, int milliseconds) {
    return outcome(client.update_joints({"turn"}, {position}, {4e-4}, at(milliseconds)));
  };
  REQUIRE(turn_to(-2, 1000) == "ok");
  const auto has = [&](const PathWatch& watch, int milliseconds) {
    return comes_true(
        [&] { return watch.latest() && watch.latest().value().stamp == at(milliseconds); });
  };
  for (const PathWatch& watch : watches) REQUIRE(has(watch, 1000));
  REQUIRE(turn_to(2, 2000) == "ok");
  REQUIRE(turn_to(-3, 3000) == "ok");
  // A late one.
  REQUIRE(turn_to(1, 2500) == "ok");
  for (const PathWatch& watch : watches) REQUIRE(has(watch, 3000));
  const auto difference = [&](const PathWatch& watch, int milliseconds) {
    const auto X = client.lookup("world", "hand", Query{at(milliseconds), {}, {}});
    const auto Y = watch.at(at(milliseconds));
    return X && Y ? testing::transform_diff(*X, *Y, 1e-9) : outcome(X) + ", " + outcome(Y);
  };
  for (int t = 1000; t <= 3000; t += 50) {
    INFO("at " << t);
    const double position = t <= 2000   ? -2 + 0.004 * (t - 1000)
                            : t <= 2500 ? 2 - 0.002 * (t - 2000)
                                        : 1 - 0.008 * (t - 2500);
    const Query query{at(t), {}, {}};
    for (const auto& [a, b, angle] :
         {std::tuple{"world", "turret", position}, std::tuple{"turret", "hand", 2 * position}}) {
      const double found = yaw(client.lookup(a, b, query));
      CHECK(std::abs(std::remainder(found - angle, 2 * std::acos(-1.0))) < 1e-9);
    }
    for (const PathWatch& watch : watches) {
      (void)comes_true([&] { return difference(watch, t) == ""; });
      CHECK(difference(watch, t) == "");
    }
  }
}

TEST_CASE("joints: a continuous joint goes the shorter way wherever it is seen") {
  const Join join = joined_by(GENERATE(from_range(testing::networks())));
  JointSpec wheel = revolute_named("wheel");
  wheel.type = JointType::kContinuous;
  wheel.limits.reset();
  wheel.coupled = true;
  JointSpec gear = following("gear", "wheel", 2, 0);
  gear.limits.reset();
  gear.mimic->of_continuous = true;
  const auto base =
      Node::open(join("base"), "base", {{"world", "", {}}, moved_by("rim", "world", wheel)})
          .value();
  const auto tool = Node::open(join("tool"), "tool", {moved_by("hand", "rim", gear)}).value();
  auto client = Client::open(join("")).value();
  const testing::TemporaryDirectory directory;
  const std::string file = directory.path() + "/wheel.mcap";
  const auto at = [](double seconds) { return Time(Milliseconds(std::lround(1000 * seconds))); };
  // As a driver reports them, and all turns that the wheel has made.
  const std::vector<double> reported{3.0, -3.0, -0.5, 1.9, -2.4};
  std::vector<double> turned{reported.front()};
  for (std::size_t i = 1; i < reported.size(); ++i) {
    const double step = reported[i] - reported[i - 1];
    turned.push_back(turned.back() + std::remainder(step, 2 * std::acos(-1.0)));
  }
  std::mutex mutex;
  std::map<std::optional<Time>, int> values;  // how many were told, by their stamps
  auto writer = RecordingWriter::create(file, at(0)).value();
  Time heard = at(0);  // a sample that was told may come again
  const auto write = [&](const PartitionNews& news) {
    const std::lock_guard<std::mutex> lock(mutex);
    const auto* told = std::get_if<ValuesNews>(&news.what);
    if (told != nullptr) heard = std::max(heard, told->values.back().stamp.value_or(heard));
    REQUIRE(writer.add(news, heard));
    if (told == nullptr) return;
    for (const WatchedValue& one : told->values) ++values[one.stamp];
  };
  const auto are_told = [&](const std::optional<Time>& stamp) {
    return comes_true([&] {
      const std::lock_guard<std::mutex> lock(mutex);
      return values[stamp] >= 2;
    });
  };
  const auto watch = client.watch("world", "hand").value();
  {
    std::vector<PartitionWatch> recorded;
    for (const char* name : {"base", "tool"}) {
      recorded.push_back(client.watch_partition(name, {0, write}).value());
    }
    // The values at rest; then each sample before the next one.
    REQUIRE(are_told(std::nullopt));
    for (std::size_t i = 0; i < reported.size(); ++i) {
      const Time stamp = at(1 + static_cast<double>(i));
      REQUIRE(client.update_joints({"wheel"}, {reported[i]}, {4e-4}, stamp));
      REQUIRE(are_told(stamp));
      // Both owners have told it: while one has not, its joint is where it was.
      REQUIRE(comes_true([&] {
        const auto X = watch.latest();
        const auto Y = client.lookup("world", "hand");
        return X && Y && X->stamp == stamp && testing::pose_diff(X->pose, Y->pose, 1e-9).empty();
      }));
    }
  }
  REQUIRE(writer.finish(at(5)));
  auto recording = Recording::open(file).value();
  for (double t = 1; t < 5.6; t += 0.05) {
    INFO("at " << t << " s");
    const auto i = std::min(static_cast<std::size_t>(t - 1), reported.size() - 2);
    const double angle = turned[i] + (t - 1 - static_cast<double>(i)) * (turned[i + 1] - turned[i]);
    const Query query{at(t), std::chrono::seconds(1), {}};
    recording.seek(at(5));
    for (const auto& [a, b, ratio] : {std::tuple{"world", "rim", 1.0}, {"rim", "hand", 2.0}}) {
      const auto off = [&, ratio = ratio](const Result<StampedTransform>& X) {
        return std::abs(std::remainder(yaw(X) - ratio * angle, 2 * std::acos(-1.0)));
      };
      CHECK(off(client.lookup(a, b, query)) < 1e-9);
      CHECK(off(recording.lookup(a, b, query)) < 1e-9);
    }
    const auto X = client.lookup("world", "hand", query);
    const auto Y = watch.lookup(query);
    REQUIRE(X);
    REQUIRE(Y);
    CHECK(testing::pose_diff(Y->pose, X->pose, 1e-9) == "");
  }
}

TEST_CASE("joints: reachable owners get their positions although another owner is unreachable") {
  const Join join = joined_by(GENERATE(from_range(testing::networks())));
  Robot robot(join);
  REQUIRE(robot.client->publish_joints({"turn", "elbow"}, {0.1, 0.1}, {0, 0}));
  robot.tool.reset();
  REQUIRE(comes_true([&] {
    const auto partitions = robot.client->partitions().value();
    for (const PartitionInfo& one : partitions) {
      if (one.name == "tool") return !one.reachable;
    }
    return true;
  }));
  const auto published = robot.client->publish_joints({"turn", "elbow"}, {0.3, 0.4}, {0, 0});
  CHECK(outcome(published) == "unreachable");
  CHECK_THAT(published.error().message, ContainsSubstring("'tool'"));
  CHECK(comes_true([&] {
    return std::abs(yaw(robot.client->lookup("world", "turret")) - 0.3) < 1e-12 &&
           std::abs(yaw(robot.client->lookup("upper", "fore")) - 0.4) < 1e-12;
  }));
  CHECK(outcome(robot.client->update_joints({"elbow"}, {0.5}, {0})) == "unreachable");
}

TEST_CASE("joints: a new client reaches all owners at once and names an unknown joint") {
  const Join join = joined_by(GENERATE(from_range(testing::networks())));
  Robot robot(join);
  for (int i = 1; i <= 5; ++i) {
    const double angle = 0.1 * i;
    auto joiner = Client::open(join(""));
    REQUIRE(joiner);
    REQUIRE(joiner->update_joints({"elbow"}, {angle}, {0}));
    CHECK(std::abs(yaw(robot.client->lookup("upper", "fore")) - angle) < 1e-12);
    CHECK(std::abs(yaw(robot.client->lookup("fore", "hand")) + angle) < 1e-12);
  }
  auto joiner = Client::open(join(""));
  const auto published = joiner->publish_joints({"knee", "elbow"}, {1, 0.75}, {0, 0});
  CHECK(outcome(published) == "unknown_joint");
  CHECK_THAT(published.error().message, ContainsSubstring("'knee'"));
  CHECK(comes_true(
      [&] { return std::abs(yaw(robot.client->lookup("fore", "hand")) + 0.75) < 1e-12; }));
}

TEST_CASE("joints: a node that is reopened has its stored joint positions") {
  const Join join = joined_by(GENERATE(from_range(testing::networks())));
  const testing::TemporaryDirectory directory;
  NodeOptions options;
  options.state = directory.path();
  const std::vector<FrameSpec> frames{{"world", "", {}},
                                      moved_by("turret", "world", revolute_named("turn"))};
  auto client = Client::open(join(""));
  REQUIRE(client);
  {
    auto node = Node::open(join("base"), "base", frames, options);
    REQUIRE(node);
    REQUIRE(comes_true([&] { return client->exists("turret"); }));
    REQUIRE(client->update_joints({"turn"}, {0.75}, {1e-4}));
  }
  auto node = Node::open(join("base"), "base", frames, options);
  REQUIRE(node);
  const auto joints = node->joints("base");
  REQUIRE(joints);
  CHECK(joints->at(0).position == 0.75);
  CHECK(joints->at(0).measured);
  CHECK(std::abs(yaw(node->lookup("world", "turret")) - 0.75) < 1e-12);
  CHECK(std::abs(node->lookup("world", "turret").value().covariance.of_specified().stddev()[5] -
                 0.01) < 1e-12);
}

}  // namespace
TEST_CASE("joints: an owner lists more joints than fit into one reply") {
  const Join join = joined_by(GENERATE(from_range(testing::networks())));
  constexpr std::size_t kAll = 4100;  // a reply holds 4,096
  std::vector<FrameSpec> frames{{"base", "", {}}};
  for (std::size_t i = 0; i < kAll; ++i) {
    const std::string number = std::to_string(10000 + i);
    frames.push_back(moved_by("frame" + number, "base", revolute_named("joint" + number)));
  }
  const auto owner = Node::open(join("arm"), "arm", frames);
  REQUIRE(owner);
  auto client = Client::open(join("")).value();
  const auto listed = client.joints("arm");
  REQUIRE(listed);
  REQUIRE(listed->size() == kAll);
  for (std::size_t i = 0; i < kAll; ++i) {
    if ((*listed)[i].name != "joint" + std::to_string(10000 + i)) FAIL("joint " << i);
  }
}

}  // namespace tfdude
