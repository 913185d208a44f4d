// Why an answer is as uncertain as it is, and why there is none: injected causes.

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "tfdude/client/client.hpp"
#include "tfdude/client/node.hpp"

#include "support/catch.hpp"
#include "support/joint_frames.hpp"
#include "support/lossy_requests.hpp"
#include "support/networks.hpp"
#include "support/process.hpp"
#include "support/random.hpp"

namespace tfdude {
namespace {

using testing::Approx;
using testing::ContainsSubstring;
using testing::Random;

Time instant(int ms) { return Time(std::chrono::seconds(1'000'000)) + Milliseconds(ms); }

constexpr int kOwners = 3;
constexpr int kFramesEach = 5;

// Three owners in a row, five frames each, of which the second and the fourth move.
struct Robot {
  Robot(const testing::Join& given, Random& random, const std::string& orphan = {},
        const std::string& other_clock = {})
      : join(given) {
    std::string parent;
    for (int k = 0; k < kOwners; ++k) {
      const std::string owner = "owner" + std::to_string(k);
      std::vector<FrameSpec> frames;
      for (int i = 0; i < kFramesEach; ++i) {
        const std::string id = frame(k, i);
        const bool missing = id == orphan;
        frames.push_back({id, missing ? "gantry_mount" : parent, random.transform()});
        parent = id;
        if (moves(i)) frames.back().timing = EdgeTiming{};
        if (moves(i)) frames.back().timing->moving = true;
      }
      Options options;
      if (owner == other_clock) options.clock = ClockKind::kExternal;
      nodes[owner].emplace(Node::open(join(owner), owner, frames, options).value());
    }
  }
  [[nodiscard]] static bool moves(int i) { return i == 1 || i == 3; }
  [[nodiscard]] static std::string frame(int k, int i) {
    static const std::vector<std::string> names = {"plate", "slider", "bracket", "pivot", "flange"};
    static const std::vector<std::string> sides = {"left", "middle", "right"};
    return sides[static_cast<std::size_t>(k)] + "_" + names[static_cast<std::size_t>(i)];
  }
  [[nodiscard]] static std::string owner_of(int k) { return "owner" + std::to_string(k); }
  // Samples of all moving edges from one instant to another, but not of one of them.
  void move(int from, int to, const std::string& but = {}) {
    for (int ms = from; ms <= to; ms += 10) {
      for (int k = 0; k < kOwners; ++k) {
        for (int i = 0; i < kFramesEach; ++i) {
          if (!moves(i) || frame(k, i) == but) continue;
          REQUIRE(nodes[owner_of(k)]->update(frame(k, i), Transform::exact({}), instant(ms)));
        }
      }
    }
  }

  testing::Join join;
  std::map<std::string, std::optional<Node>> nodes;
};

struct Injected {
  Obstacle obstacle = Obstacle::kOther;
  std::string frame;      // empty: any
  std::string partition;  // empty: any
  std::string similar;    // that must be the first; empty: any
  std::string a = Robot::frame(0, 0);
  std::string b = Robot::frame(kOwners - 1, kFramesEach - 1);
  std::optional<Time> at;
};

std::string misspelt(std::string name, Random& random) {
  const std::size_t i = random.index(name.size() - 1);
  switch (random.index(3)) {
    case 0:
      std::swap(name[i], name[i + 1]);
      if (name[i] == name[i + 1]) name[i] = '9';
      break;
    case 1:
      name.erase(i, 1);
      break;
    default:
      name[i] = name[i] == 'x' ? 'y' : 'x';
  }
  return name;
}

// Injects a cause of this kind. @return what has to be found
Injected inject(std::size_t kind, std::optional<Robot>& robot, const testing::Join& join,
                Random& random) {
  Injected cause;
  const int k = static_cast<int>(random.index(kOwners));
  const int moving = random.index(2) == 0 ? 1 : 3;
  const std::string edge = Robot::frame(k, moving);
  const auto blame = [&](Obstacle obstacle, const std::string& frame) {
    cause.obstacle = obstacle;
    cause.frame = frame;
    cause.partition = Robot::owner_of(k);
  };
  switch (kind) {
    case 0: {  // a name is nearly another
      robot.emplace(join, random);
      robot->move(0, 50);
      const std::string meant = Robot::frame(k, static_cast<int>(random.index(kFramesEach)));
      cause.obstacle = Obstacle::kUnknownFrame;
      cause.similar = meant;
      cause.frame = misspelt(meant, random);
      (random.index(2) == 0 ? cause.a : cause.b) = cause.frame;
      break;
    }
    case 1: {  // a parent that nobody has; not that of the root
      const int i = k == 0 ? 1 + static_cast<int>(random.index(kFramesEach - 1))
                           : static_cast<int>(random.index(kFramesEach));
      robot.emplace(join, random, Robot::frame(k, i));
      blame(Obstacle::kMissingParent, Robot::frame(k, i));
      break;
    }
    case 2:  // the owner was stopped
      robot.emplace(join, random);
      robot->move(0, 50);
      cause.obstacle = Obstacle::kOwnerStopped;
      cause.partition = Robot::owner_of(k);
      break;
    case 3:  // no sample yet
      robot.emplace(join, random);
      robot->move(0, 50, edge);
      blame(Obstacle::kNoSample, edge);
      cause.at = instant(30);
      break;
    case 4:  // a stream has ended
      robot.emplace(join, random);
      robot->move(0, 20);
      robot->move(30, 60, edge);
      blame(Obstacle::kEndsBefore, edge);
      cause.at = instant(50);
      break;
    case 5:  // a stream has begun later
      robot.emplace(join, random);
      robot->move(0, 50, edge);
      REQUIRE(robot->nodes[Robot::owner_of(k)]->update(edge, Transform::exact({}), instant(40)));
      REQUIRE(robot->nodes[Robot::owner_of(k)]->update(edge, Transform::exact({}), instant(50)));
      blame(Obstacle::kBeginsAfter, edge);
      cause.at = instant(20);
      break;
    case 6:  // a stream has ended before another one began
      robot.emplace(join, random);
      REQUIRE(robot->nodes[Robot::owner_of(k)]->update(edge, Transform::exact({}), instant(-500)));
      robot->move(0, 50, edge);
      blame(Obstacle::kNoCommonInstant, edge);
      break;
    case 7: {  // another clock
      robot.emplace(join, random, "", Robot::owner_of(k));
      REQUIRE(robot->nodes[Robot::owner_of(k)]->set_time(ExternalTime(std::chrono::seconds(10))));
      for (int other = 0; other < kOwners; ++other) {
        const Time stamp = other == k ? Time(std::chrono::seconds(5)) : instant(0);
        for (const int i : {1, 3}) {
          REQUIRE(robot->nodes[Robot::owner_of(other)]->update(Robot::frame(other, i),
                                                               Transform::exact({}), stamp));
        }
      }
      cause.obstacle = Obstacle::kOtherClock;
      cause.partition = Robot::owner_of(k);
      if (random.index(2) == 0) cause.at = instant(0);
      break;
    }
    default: {  // two trees
      robot.emplace(join, random);
      const std::string island = "island" + std::to_string(random.index(100));
      REQUIRE(robot->nodes[Robot::owner_of(k)]->add(island, "", Transform(), Robot::owner_of(k)));
      cause.obstacle = Obstacle::kNotConnected;
      (random.index(2) == 0 ? cause.a : cause.b) = island;
    }
  }
  return cause;
}

TEST_CASE("why: shares of a source at different samples add up to the variance") {
  const auto join = testing::join_loopback();
  const auto moving = [](const std::string& id, const std::string& parent) {
    FrameSpec frame{id, parent, Transform::exact({})};
    frame.timing = EdgeTiming();
    frame.timing->moving = true;
    return frame;
  };
  auto robot = Node::open(join("robot"), "robot",
                          {{"base", "", {}}, moving("arm", "base"), moving("hand", "arm")});
  auto client = Client::open(join(""));
  REQUIRE((robot && client));
  const auto at = [](int ms) { return Time(std::chrono::milliseconds(ms)); };
  Correlation heat;
  Loading along_y = Loading::Zero(6, 1);
  along_y(1, 0) = 2e-3;
  heat.common_errors.push_back({"heat", false, along_y});
  REQUIRE(robot->correlate("arm", heat));
  heat.common_errors[0].loading *= -1;
  REQUIRE(robot->correlate("hand", heat));
  for (const int ms : {1000, 2000}) REQUIRE(robot->update("arm", Transform::exact({}), at(ms)));
  for (const int ms : {1000, 1500, 2000}) {
    REQUIRE(robot->update("hand", Transform::exact({}), at(ms)));
  }
  WhyQuery query;
  query.at = at(1500);
  const Explanation why = client->why("base", "hand", query);
  REQUIRE(why.X_AB);
  CHECK(why.variance == Approx(16e-6));
  REQUIRE(why.sources.size() == 1);
  CHECK(why.sources[0].name == "heat");
  CHECK(why.sources[0].variance == Approx(16e-6));
}

}  // namespace

TEST_CASE("why: injected causes are named, in time for people") {
  Random random(4610);
  INFO("seed " << random.seed());
  constexpr int kCauses = 200;
  int named = 0;
  std::chrono::steady_clock::duration longest{0};
  for (int n = 0; n < kCauses; ++n) {
    const auto join = testing::join_loopback();
    const std::size_t kind = static_cast<std::size_t>(n) % 9;
    std::optional<Robot> robot;
    const Injected injected = inject(kind, robot, join, random);
    auto client = Client::open(join(""));
    REQUIRE(client);
    REQUIRE(client->frames());  // all is discovered
    if (injected.obstacle ==
        Obstacle::kNotConnected) {  // an owner announces changes a little later
      REQUIRE(testing::eventually(
          [&] { return client->exists(injected.a) && client->exists(injected.b); }));
    }
    if (injected.obstacle == Obstacle::kOwnerStopped) robot->nodes[injected.partition].reset();
    WhyQuery query;
    query.at = injected.at;
    const auto begin = std::chrono::steady_clock::now();
    const Explanation why = client->why(injected.a, injected.b, query);
    longest = std::max(longest, std::chrono::steady_clock::now() - begin);
    INFO("cause " << n << ": " << to_string(injected.obstacle) << " of " << injected.frame);
    REQUIRE(why.cause);
    const bool right =
        why.cause->obstacle == injected.obstacle &&
        (injected.frame.empty() || why.cause->frame == injected.frame) &&
        (injected.partition.empty() || why.cause->partition == injected.partition) &&
        (injected.similar.empty() ||
         (!why.cause->similar.empty() && why.cause->similar.front() == injected.similar)) &&
        !why.cause->needs.empty();
    if (right) {
      ++named;
    } else {
      UNSCOPED_INFO("cause " << n << ": " << to_string(injected.obstacle) << " of "
                             << injected.frame << " of " << injected.partition << ", said "
                             << to_string(why.cause->obstacle) << " of " << why.cause->frame
                             << " of " << why.cause->partition << ": " << why.cause->needs << " ("
                             << why.cause->error.message << ")");
    }
  }
  CHECK(named >= 195);
  const double longest_ms = std::chrono::duration<double, std::milli>(longest).count();
  INFO("longest " << longest_ms << " ms");
#ifndef TFDUDE_THREAD_SANITIZER
  CHECK(longest_ms < 100);
#endif
}

TEST_CASE("why: of edges with one stamp it names the one that its message names") {
  Random random(4612);
  const auto join = testing::join_loopback();
  Robot robot(join, random);
  auto client = Client::open(join(""));
  REQUIRE(client);
  REQUIRE(client->frames());
  const auto check = [&](const std::string& a, const std::string& b, std::optional<Time> at) {
    WhyQuery query;
    query.at = at;
    const Explanation why = client->why(a, b, query);
    REQUIRE(why.cause);
    INFO(a << " to " << b << ": " << why.cause->error.message << "; " << why.cause->needs);
    CHECK_FALSE(why.cause->error.frame.empty());
    CHECK(why.cause->frame == why.cause->error.frame);
    CHECK_THAT(why.cause->needs, ContainsSubstring("'" + why.cause->frame + "'"));
  };
  const auto check_all = [&](std::optional<Time> at) {
    for (int k = 0; k < kOwners; ++k) {
      check(Robot::frame(0, 0), Robot::frame(k, kFramesEach - 1), at);
      check(Robot::frame(k, kFramesEach - 1), Robot::frame(0, 0), at);
    }
  };
  check_all(instant(20));  // none has a sample
  robot.move(0, 50);
  check_all(instant(70));
  check_all(instant(-20));
}

TEST_CASE("why: an edge without a sample is no cause if its first value holds") {
  Random random(4613);
  const auto join = testing::join_loopback();
  Robot robot(join, random);
  // The pivot has no sample; the two others have no instant in common.
  REQUIRE(robot.nodes["owner1"]->update("middle_slider", Transform::exact({}), instant(0)));
  REQUIRE(robot.nodes["owner1"]->update("middle_bracket", Transform::exact({}), instant(50)));
  auto client = Client::open(join(""));
  REQUIRE(client);
  REQUIRE(client->frames());
  const Explanation why = client->why("middle_plate", "middle_flange");
  REQUIRE(why.cause);
  INFO(why.cause->error.message << "; " << why.cause->needs);
  CHECK(why.cause->obstacle == Obstacle::kNoCommonInstant);
  CHECK(why.cause->frame != "middle_pivot");
}

TEST_CASE("why: an answer beside an edge that had no sample yet is divided, too") {
  const auto join = testing::join_loopback();
  const auto of = [](double deviation) {
    Transform X;
    X.covariance = Covariance::from_stddev({deviation, deviation, deviation, 0, 0, 0}).value();
    return X;
  };
  FrameSpec eye{"eye", "base", of(0.001)};
  eye.timing.emplace().moving = true;
  Node robot =
      Node::open(join("robot"), "robot", {{"map", "", {}}, {"base", "map", of(0.01)}, eye}).value();
  REQUIRE(robot.update("base", of(0.01), instant(0)));
  const Explanation why = Client::open(join("")).value().why("map", "eye");
  REQUIRE_FALSE(why.cause);
  REQUIRE(why.edges.size() == 2);
  CHECK(why.edges[0].name == "base");
  CHECK(why.best);
}

TEST_CASE("why: it says that samples were rejected, as of another clock") {
  const auto join = testing::join_loopback();
  Node robot =
      Node::open(join("robot"), "robot", {{"map", "", {}}, {"base", "map", Transform()}}).value();
  const Time now = robot.now().value();
  REQUIRE(robot.update("base", Transform(), now));
  REQUIRE_FALSE(robot.update("base", Transform(), now + std::chrono::minutes(2)));
  WhyQuery query;
  query.at = now + std::chrono::seconds(1);
  const Explanation why = robot.why("map", "base", query);
  REQUIRE(why.cause);
  CHECK(why.cause->obstacle == Obstacle::kEndsBefore);
  CHECK_THAT(why.cause->needs, ContainsSubstring("too far ahead of the owner's clock: 1"));
}

TEST_CASE("why: the clock of an owner without a dynamic edge on the path is no cause") {
  const auto join = testing::join_loopback();
  const Node base =
      Node::open(join("base"), "base", {{"world", "", {}}, {"base", "world", Transform()}}).value();
  NodeOptions options;
  options.clock = ClockKind::kExternal;
  const Node sim =
      Node::open(join("sim"), "sim", {{"mount", "base", Transform::exact({})}}, options).value();
  Client client = Client::open(join("")).value();
  REQUIRE(client.update("base", Transform::exact({}), instant(0)));
  REQUIRE(testing::eventually([&] { return client.lookup("world", "mount").has_value(); }));
  WhyQuery query;
  query.at = instant(500);
  const Explanation why = client.why("world", "mount", query);
  REQUIRE(why.cause);
  INFO(why.cause->error.message << "; " << why.cause->needs);
  CHECK(why.cause->obstacle == Obstacle::kEndsBefore);
  CHECK(why.cause->partition == "base");
}

TEST_CASE("why: a sensor that is worse than none, or no number, is rejected") {
  Client client = Client::open(testing::join_loopback()("")).value();
  WhyQuery query;
  query.sensor[4] = GENERATE(-1.0, std::nan(""), std::numeric_limits<double>::infinity());
  const Explanation why = client.why("world", "base", query);
  REQUIRE(why.cause);
  CHECK(why.cause->error.code == Errc::kInvalidInput);
}

TEST_CASE("why: an owner that hangs is named, soon") {
  Random random(4611);
  const auto join = testing::join_loopback();
  Robot robot(join, random);
  robot.move(0, 20);
  std::atomic<bool> deaf{false};
  auto client = Client::open(std::make_unique<testing::LossyRequests>(
      join(""), [&](const Request&) { return deaf.load(); }));
  REQUIRE(client);
  REQUIRE(client->lookup(Robot::frame(0, 0), Robot::frame(0, 4)));
  deaf = true;
  const auto begin = std::chrono::steady_clock::now();
  const Explanation why = client->why(Robot::frame(1, 0), Robot::frame(1, 4));
  CHECK(std::chrono::steady_clock::now() - begin < std::chrono::seconds(1));
  REQUIRE(why.cause);
  CHECK(why.cause->obstacle == Obstacle::kOwnerSilent);
  CHECK(why.cause->partition == "owner1");
}

TEST_CASE("why: the variance of an answer is divided among edges, sources and joints") {
  const auto join = testing::join_loopback();
  const auto of = [](double x, double sigma) {
    return Transform{Pose::trusted(Eigen::Quaterniond::Identity(), {x, 0, 0}),
                     *Covariance::from_stddev({0, sigma, 0, 0, 0, 0})};
  };
  // The joint's axis is z: its error of 1 mrad moves the hand, 2 m away, by 2 mm along y.
  FrameSpec arm{"arm", "base", Transform::exact({})};
  arm.joint = testing::revolute_named("shoulder");
  arm.joint->variance = 1e-6;
  auto robot = Node::open(
      join("robot"), "robot",
      {{"base", "", {}}, arm, {"wrist", "arm", of(1, 1e-3)}, {"hand", "wrist", of(1, 0.5e-3)}});
  auto client = Client::open(join(""));
  REQUIRE((robot && client));
  const Explanation why = client->why("base", "hand");
  REQUIRE(why.X_AB);
  CHECK_FALSE(why.cause);
  CHECK((why.direction - Eigen::Vector3d::UnitY()).norm() < 1e-9);
  CHECK_FALSE(why.is_rotation);
  CHECK(why.variance == Approx(4e-6 + 1e-6 + 0.25e-6));
  REQUIRE(why.edges.size() == 3);
  CHECK(why.edges[0].name == "arm");
  CHECK(why.edges[0].variance == Approx(4e-6));
  CHECK(why.edges[0].share == Approx(4 / 5.25));
  CHECK(why.edges[1].name == "wrist");
  CHECK(why.edges[2].variance == Approx(0.25e-6));
  REQUIRE(why.joints.size() == 1);
  CHECK(why.joints[0].name == "shoulder");
  CHECK(why.joints[0].variance == Approx(4e-6));
  CHECK(why.assumed_joints == std::vector<std::string>{"shoulder"});
  REQUIRE(why.best);
  CHECK(why.best->b == "arm");
  // A sensor of 1 mrad halves the variance of the joint.
  CHECK(why.best->variance_after == Approx(2e-6 + 1.25e-6));
  REQUIRE(why.owners.size() == 1);
  CHECK(why.owners[0].partition == "robot");

  // Both edges shift along y with the temperature: their errors add up before they are squared.
  Correlation heat;
  Loading along_y = Loading::Zero(6, 1);
  along_y(1, 0) = 2e-3;
  heat.common_errors.push_back({"heat", false, along_y});
  REQUIRE(robot->correlate("wrist", heat));
  REQUIRE(robot->correlate("hand", heat));
  const Explanation hot = client->why("hand", "base");
  REQUIRE(hot.X_AB);
  REQUIRE(hot.sources.size() == 1);
  CHECK(hot.sources[0].name == "heat");
  CHECK(hot.sources[0].variance == Approx(16e-6));
  // Seen from the hand, the arm turns the base, which is 1 m away from it.
  CHECK(hot.variance == Approx(16e-6 + 2.25e-6));

  const Explanation nothing = client->why("base", "base");
  CHECK(nothing.X_AB);
  CHECK(nothing.edges.empty());
}

}  // namespace tfdude
