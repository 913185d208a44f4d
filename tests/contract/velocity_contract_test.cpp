// Velocities of paths over partitions.

#include <chrono>
#include <cmath>
#include <optional>
#include <string>

#include "tfdude/client/client.hpp"
#include "tfdude/client/node.hpp"

#include "support/catch.hpp"
#include "support/forest_support.hpp"
#include "support/networks.hpp"
#include "support/process.hpp"

namespace tfdude {
namespace {

using namespace std::chrono_literals;
using testing::along_x;
using testing::Approx;
using testing::ContainsSubstring;
using testing::Join;
using testing::outcome;

Time ms(std::int64_t milliseconds) { return Time(Milliseconds(milliseconds)); }

Query when(std::int64_t milliseconds) {
  Query query;
  query.at = ms(milliseconds);
  return query;
}

Covariance isotropic(double metres, double radians) {
  return *Covariance::from_stddev({metres, metres, metres, radians, radians, radians});
}

// world -> base drives along x at 1 m/s; base -> arm turns about z at 2 rad/s; arm -> hand is
// static, half a metre ahead. Each is of another partition. Samples from 1 to 2 s, every 10 ms.
struct Robot {
  explicit Robot(const Join& join, const Covariance& base_error = {},
                 const Covariance& hand_error = {}) {
    base.emplace(
        Node::open(join("base"), "base", {{"world", "", {}}, {"base", "world", {}}}).value());
    arm.emplace(Node::open(join("arm"), "arm", {{"arm", "base", {}}}).value());
    const Transform X_AH{along_x(0.5).pose, hand_error};
    hand.emplace(Node::open(join("hand"), "hand", {{"hand", "arm", X_AH}}).value());
    client.emplace(Client::open(join("")).value());
    for (int t = 1000; t <= 2000; t += 10) {
      const double s = 1e-3 * t;
      const Eigen::Quaterniond q(Eigen::AngleAxisd(2 * (s - 1), Eigen::Vector3d::UnitZ()));
      REQUIRE(base->update("base", {along_x(s).pose, base_error}, ms(t)));
      REQUIRE(arm->update("arm", {Pose::trusted(q, {0, 0, 0}), Covariance()}, ms(t)));
    }
  }

  std::optional<Node> base;
  std::optional<Node> arm;
  std::optional<Node> hand;
  std::optional<Client> client;
};

TEST_CASE("velocity: it is in the axes of A at the origin of B") {
  Robot robot(testing::join_loopback());
  for (Client* caller : {&*robot.client, static_cast<Client*>(&*robot.arm)}) {
    const auto velocity = caller->velocity("world", "hand", {ms(1500), 2ms});
    REQUIRE(velocity);
    CHECK(velocity->begin == ms(1499));
    CHECK(velocity->end == ms(1501));
    // The hand points at 1 rad, and moves at 1 m/s to the left of that, besides the base's 1 m/s.
    CHECK(velocity->linear.x() == Approx(1 - std::sin(1.0)).epsilon(1e-5));
    CHECK(velocity->linear.y() == Approx(std::cos(1.0)).epsilon(1e-5));
    CHECK(std::abs(velocity->linear.z()) < 1e-12);
    CHECK((velocity->angular - Eigen::Vector3d(0, 0, 2)).norm() < 1e-9);
    CHECK(velocity->covariance.if_complete() != nullptr);
    // In the other direction the axes are those of the hand.
    const auto back = caller->velocity("hand", "world", {ms(1500), 2ms});
    REQUIRE(back);
    CHECK((back->angular - Eigen::Vector3d(0, 0, -2)).norm() < 1e-9);
  }
}

TEST_CASE("velocity: the interval ends at the latest common time") {
  Robot robot(testing::join_loopback());
  REQUIRE(robot.base->update("base", along_x(2.01), ms(2010)));
  const auto newest = robot.client->velocity("world", "hand");
  REQUIRE(newest);
  CHECK(newest->end == ms(2000));
  CHECK(newest->begin == ms(1900));
  const auto late = robot.client->velocity("world", "hand", {ms(1990), 40ms});
  REQUIRE(late);
  // By now the latest common time is predicted, which may make it a little older.
  CHECK(late->end >= ms(1990));
  CHECK(late->end <= ms(2000));
  CHECK(late->begin == *late->end - 40ms);
  CHECK(outcome(robot.client->velocity("world", "hand", {ms(2001), 100ms})) == "not_yet");
  CHECK(outcome(robot.client->velocity("world", "hand", {ms(1010), 100ms})) == "too_old");
  CHECK(outcome(robot.client->velocity("world", "hand", {ms(1010), 60s})) == "too_old");
  CHECK(outcome(robot.client->velocity("world", "hand", {std::nullopt, 0ms})) == "invalid_input");
  CHECK(outcome(robot.client->velocity("world", "hand", {ms(-1), 1ms})) == "invalid_input");
  CHECK(outcome(robot.client->velocity("world", "nobody")) == "unknown_end");
}

TEST_CASE("velocity: nobody has measured how an edge moves that has had no sample") {
  const Join join = testing::joined_by(GENERATE(from_range(testing::networks())));
  FrameSpec cart{"cart", "world", {along_x(1).pose, isotropic(0.1, 0.01)}};
  cart.timing = EdgeTiming();
  cart.timing->moving = true;
  Node node =
      Node::open(join("base"), "base", {{"world", "", {}}, cart, {"lamp", "world", along_x(2)}})
          .value();
  Client client = Client::open(join("")).value();
  for (Client* caller : {&client, static_cast<Client*>(&node)}) {
    REQUIRE(caller->lookup("world", "cart", Query{}, 20s));
    for (const char* frame : {"cart", "lamp"}) {
      const auto moves = caller->velocity("world", frame);
      CHECK(outcome(moves) == (std::string(frame) == "cart" ? "not_yet" : "ok"));
    }
    CHECK(outcome(caller->velocity("lamp", "cart")) == "not_yet");
  }
}

TEST_CASE("velocity: what turns by more than half a turn is asked for over less time") {
  const Join join = testing::join_loopback();
  Node node = Node::open(join("base"), "base", {{"world", "", {}}, {"wheel", "world", {}}}).value();
  Client client = Client::open(join("")).value();
  const double speed = GENERATE(32.0, 40.0, 63.0, 90.0);
  for (int t = 1000; t <= 1300; ++t) {
    const Eigen::Quaterniond q(Eigen::AngleAxisd(1e-3 * speed * t, Eigen::Vector3d::UnitY()));
    REQUIRE(node.update("wheel", {Pose::trusted(q, {0, 0, 0}), Covariance()}, ms(t)));
  }
  REQUIRE(client.lookup("world", "wheel", Query{}, 20s));
  for (Client* caller : {&client, static_cast<Client*>(&node)}) {
    const auto lost = caller->velocity("world", "wheel");
    CHECK(outcome(lost) == "invalid_input");
    CHECK_THAT(lost.error().message,
               ContainsSubstring("within 100.000 ms") && ContainsSubstring("wheel"));
    VelocityQuery query;
    query.over = 20ms;
    const auto found = caller->velocity("world", "wheel", query);
    REQUIRE(found);
    CHECK(found->angular.y() == Approx(speed).epsilon(1e-6));
    CHECK(caller->velocity("wheel", "world", query)->angular.y() == Approx(-speed).epsilon(1e-6));
  }
}

TEST_CASE("velocity: static edges do not move, whatever their errors are") {
  Robot robot(testing::join_loopback(), {}, isotropic(1, 1));
  for (const char* to : {"hand", "arm"}) {
    const auto still = robot.client->velocity("arm", to);
    REQUIRE(still);
    CHECK(still->linear.norm() == 0);
    CHECK(still->covariance == StatedCovariance::exact());
    CHECK(still->basis.unspecified.empty());
    CHECK_FALSE(still->begin);
    CHECK_FALSE(still->end);
  }
}

TEST_CASE("velocity: common errors of static edges cancel, and those of dynamic edges do not") {
  const Join join = testing::join_loopback();
  SECTION("only the hand's mount is uncertain") {
    Robot robot(join, {}, isotropic(0.01, 0));
    const auto velocity = robot.client->velocity("world", "hand", {ms(1500), 2ms});
    REQUIRE(velocity);
    // The lever is off by 1 cm: 2 rad/s make 2 cm/s of it, across the axis of rotation.
    const auto s = velocity->covariance.if_complete()->stddev();
    CHECK(s[0] == Approx(0.02).epsilon(1e-4));
    CHECK(s[1] == Approx(0.02).epsilon(1e-4));
    CHECK(s[2] < 1e-9);
    CHECK(s[5] < 1e-9);
    CHECK_FALSE(velocity->basis.bound);
  }
  SECTION("the base's samples are uncertain") {
    Robot robot(join, isotropic(0.01, 0), {});
    const auto velocity = robot.client->velocity("world", "hand", {ms(1500), 100ms});
    REQUIRE(velocity);
    const auto s = velocity->covariance.if_complete()->stddev();
    CHECK(s[0] == Approx(2 * 0.01 / 0.1).epsilon(1e-4));
    CHECK(velocity->basis.bound);
  }
  SECTION("a dynamic edge that stands still is not static") {
    Robot robot(join, {}, {});
    for (int t = 1000; t <= 2000; t += 500) {
      REQUIRE(robot.hand->update("hand", {along_x(0.5).pose, isotropic(0.01, 0)}, ms(t)));
    }
    const auto velocity = robot.client->velocity("arm", "hand", {ms(1500), 100ms});
    REQUIRE(velocity);
    CHECK(velocity->linear.norm() < 1e-12);
    CHECK(velocity->covariance.if_complete()->stddev()[0] == Approx(2 * 0.01 / 0.1));
  }
}

// 2 cm per √s, straight on along x at 1 m/s, after a start that is known to 10 cm.
TEST_CASE("velocity: of an edge that drifts, and over it at two instants, by its model") {
  const Join join = testing::joined_by(GENERATE(from_range(testing::networks())));
  EdgeTiming drifting;
  drifting.drifts = true;
  drifting.process_noise = isotropic(0.02, 0.001);
  FrameSpec base{"base", "world", {}};
  base.timing = drifting;
  auto node = Node::open(join("base"), "base", {{"world", "", {}}, base}).value();
  auto client = Client::open(join("")).value();
  for (int t = 1000; t <= 2000; t += 100) {
    REQUIRE(node.update("base", {along_x(1e-3 * t).pose, isotropic(0.1, 0.1)}, ms(t)));
  }
  for (Client* caller : {&client, static_cast<Client*>(&node)}) {
    const auto velocity = caller->velocity("world", "base", {ms(1500), 200ms});
    REQUIRE(velocity);
    const auto* sigma = velocity->covariance.if_complete();
    REQUIRE(sigma != nullptr);
    CHECK(velocity->linear.x() == Approx(1.0));
    CHECK(sigma->stddev()[0] == Approx(0.02 * std::sqrt(0.2) / 0.2));
    CHECK_FALSE(velocity->basis.bound);
    for (const auto& [from, to] : {std::pair(1200, 1450), std::pair(1450, 1200)}) {
      const auto moved = caller->lookup("base", when(from), "base", when(to), "world");
      REQUIRE(moved);
      CHECK_FALSE(moved->basis.bound);
      CHECK(moved->pose.translation().x() == Approx(1e-3 * (to - from)));
      CHECK(moved->covariance.if_complete()->stddev()[0] ==
            Approx(0.02 * std::sqrt(0.25)).epsilon(1e-3));
    }
  }
}

TEST_CASE("velocity: times of arrival tell none") {
  const Join join = testing::joined_by(GENERATE(from_range(testing::networks())));
  EdgeTiming moving;
  moving.moving = true;
  auto node =
      Node::open(join("arm"), "arm", {{"world", "", {}}, {"arm", "world", along_x(0), moving}})
          .value();
  auto client = Client::open(join("")).value();
  const auto watch = client.watch("world", "arm").value();
  REQUIRE(client.update("arm", along_x(1)));
  REQUIRE(client.update("arm", along_x(2)));
  const Time newest = *client.lookup("world", "arm", Query{})->stamp;
  REQUIRE(testing::eventually([&] { return watch.latest() && watch.latest()->stamp == newest; }));
  const Query beyond{newest + 1ms, 1s, {}};
  for (Client* caller : {&client, static_cast<Client*>(&node)}) {
    const auto velocity = caller->velocity("world", "arm", {std::nullopt, 1ns});
    CHECK(outcome(velocity) == "invalid_input");
    CHECK_THAT(velocity.error().message,
               ContainsSubstring("'arm'") && ContainsSubstring("without a stamp"));
    CHECK(outcome(caller->lookup("world", "arm", beyond)) == "not_yet");
  }
  CHECK(outcome(watch.lookup(beyond)) == "not_yet");
}

TEST_CASE("velocity: unspecified edges are named") {
  Robot robot(testing::join_loopback());
  REQUIRE(robot.hand->update("hand", {along_x(0.5).pose, StatedCovariance::unspecified()}));
  const auto velocity = robot.client->velocity("world", "hand");
  REQUIRE(velocity);
  CHECK_FALSE(velocity->covariance.complete());
  CHECK(velocity->basis.unspecified == std::vector<std::string>{"hand"});
  CHECK((velocity->angular - Eigen::Vector3d(0, 0, 2)).norm() < 1e-9);
}

TEST_CASE("velocity: without samples nobody has measured it, and what is unspecified is at rest") {
  FrameSpec waits{"waits", "world", {along_x(1).pose, isotropic(1, 1)}};
  waits.timing = EdgeTiming();
  waits.timing->moving = true;
  const FrameSpec loose{"loose", "world", {along_x(1).pose, StatedCovariance::unspecified()}};
  const auto join = testing::join_loopback();
  auto node = Node::open(join("base"), "base", {{"world", "", {}}, loose, waits}).value();
  const auto velocity = node.velocity("world", "loose").value();
  CHECK_FALSE(velocity.covariance.complete());
  CHECK(velocity.basis.unspecified == std::vector<std::string>{"loose"});
  CHECK(outcome(node.velocity("world", "waits")) == "not_yet");
  VelocityQuery then;
  then.at = Time(std::chrono::seconds(1));
  CHECK(outcome(node.velocity("world", "waits", then)) == "not_yet");
  CHECK(node.velocity("world", "world", then));
}

}  // namespace
}  // namespace tfdude
