// The function tests of the thesis, over each transport: two owners and a client without frames.

#include <array>
#include <cmath>
#include <optional>
#include <string>
#include <unistd.h>
#include <vector>

#include "tfdude/client/client.hpp"
#include "tfdude/client/node.hpp"
#include "tfdude/description/config.hpp"

#include "partition/messages.hpp"
#include "support/catch.hpp"
#include "support/networks.hpp"
#include "support/pose_diff.hpp"
#include "support/process.hpp"
#include "support/random.hpp"
#include "tree/forest.hpp"

namespace tfdude {
namespace {

using testing::Join;
using testing::joined_by;

struct Robot {
  explicit Robot(const Join& join) {
    robot.emplace(Node::open(join("robot"), "robot",
                             load_config(TFDUDE_EXAMPLES "/thesis/robot.yaml")->frames)
                      .value());
    arms.emplace(
        Node::open(join("arms"), "arms", load_config(TFDUDE_EXAMPLES "/thesis/arms.yaml")->frames)
            .value());
    client.emplace(Client::open(join("")).value());
    // Earlier participants hear of the frames of a new participant a moment later.
    for (Client* one : all())
      REQUIRE(testing::eventually([&] { return one->frames().value().size() == 9; }));
  }
  std::vector<Client*> all() { return {&*robot, &*arms, &*client}; }

  std::optional<Node> robot;
  std::optional<Node> arms;
  std::optional<Client> client;
};

const Transform kX{exp((Twist() << 0.1, -0.2, 0.3, 0.4, 0.5, -0.6).finished()),
                   *Covariance::from_stddev({1e-3, 2e-3, 3e-3, 4e-3, 5e-3, 6e-3})};

}  // namespace

TEST_CASE("every participant looks up every pair of frames as one tree would") {
  const int transport = GENERATE(from_range(testing::networks()));
  Robot r(joined_by(transport));
  Forest oracle;
  for (const char* file : {"/thesis/robot.yaml", "/thesis/arms.yaml"}) {
    const auto config = load_config(std::string(TFDUDE_EXAMPLES) + file);
    for (const FrameSpec& frame : config->frames) {
      REQUIRE(oracle.add(frame.id, frame.parent, frame.X_PC, Forest::MissingParent::kAllow));
    }
  }
  const auto frames = r.client->frames().value();
  REQUIRE(frames.size() == 9);
  for (Client* caller : r.all()) {
    for (const Frame& a : frames) {
      for (const Frame& b : frames) {
        const auto X_AB = caller->lookup(a.id, b.id);
        REQUIRE(X_AB);
        CHECK(testing::transform_diff(*X_AB, oracle.lookup(a.id, b.id).value(), 1e-9) == "");
      }
    }
  }
}

TEST_CASE("frames are added, updated and moved from anywhere") {
  const int transport = GENERATE(from_range(testing::networks()));
  Robot r(joined_by(transport));
  int callers = 0;
  for (Client* caller : r.all()) {
    // Uses its own names, because a caller hears of another one's removal only a moment later.
    const std::string tool = "tool" + std::to_string(++callers);
    const std::string hand = "hand" + std::to_string(callers);
    REQUIRE(caller->add(tool, "camera", kX));
    REQUIRE(caller->add(hand, "arm_2", kX));
    CHECK(testing::transform_diff(caller->lookup("camera", tool).value(), kX, 1e-12) == "");
    CHECK(testing::transform_diff(caller->lookup("arm_2", hand).value(), kX, 1e-12) == "");
    CHECK(caller->add(hand, "camera", kX).error().code == Errc::kAlreadyExists);
    CHECK(caller->add("x", "missing", kX).error().code == Errc::kUnknownParent);
    CHECK_FALSE(caller->exists("x"));
    REQUIRE(caller->update({{tool, inverse(kX)}, {hand, inverse(kX)}, {"arm_1", kX}}));
    CHECK(testing::transform_diff(caller->lookup("robot_1", "arm_1").value(), kX, 1e-12) == "");
    CHECK(testing::transform_diff(caller->lookup("arm_2", hand).value(), inverse(kX), 1e-12) == "");
    REQUIRE(caller->update({{caller->find(tool).value(), kX}, {caller->find(hand).value(), kX}}));
    CHECK(testing::transform_diff(caller->lookup("camera", tool).value(), kX, 1e-12) == "");
    CHECK(testing::pose_diff(caller->lookup_pose("arm_2", hand).value(), kX.pose, 1e-12) == "");
    REQUIRE(caller->move(hand, "camera"));
    CHECK(caller->parent(hand).value() == "camera");
    CHECK(caller->move("robot_1", "hand_left").error().code == Errc::kCycle);
    REQUIRE(caller->remove(tool));
    REQUIRE(caller->remove(hand));
  }
}

TEST_CASE("a value that is not finite is rejected before it is sent") {
  const int transport = GENERATE(from_range(testing::networks()));
  Robot r(joined_by(transport));
  const Transform bad{Pose::trusted(Eigen::Quaterniond::Identity(), {NAN, 0, 0}), {}};
  for (Client* caller : r.all()) {
    for (const Result<void>& refused :
         {caller->add("x", "camera", bad), caller->update("arm_1", bad),
          caller->publish({{"camera", kX}, {"arm_1", bad}}),
          caller->move("arm_2", "camera", bad)}) {
      REQUIRE_FALSE(refused);
      CHECK(refused.error().code == Errc::kInvalidInput);
      CHECK(refused.error().message.find("translation.x is not a finite number") !=
            std::string::npos);
    }
    CHECK_FALSE(caller->exists("x"));
    CHECK(caller->lookup("world", "hand_left"));
  }
}

TEST_CASE("a lookup whose covariance is semi-definite only up to rounding succeeds") {
  // An edge without translation seen from its child: the variances of the translation are zero,
  // except for rounding errors of the variances of rotation over a lever.
  const int transport = GENERATE(from_range(testing::networks()));
  Robot r(joined_by(transport));
  const auto edge = [](const Eigen::Vector3d& p, const Eigen::Vector3d& rpy,
                       const std::array<double, 6>& stddev) {
    return Transform{*Pose::create(from_rpy(rpy[0], rpy[1], rpy[2]), p),
                     *Covariance::from_stddev(stddev)};
  };
  REQUIRE(r.client->add("e", "arm_2",
                        edge({0, 0, 0}, {0.36, -0.63, 1.1}, {0, 0, 0, 5e-5, 2.4e-4, 9.7e-3})));
  REQUIRE(r.client->add("f", "e", edge({0, -0.78, 0}, {-2.4, 0.4, -2}, {})));
  REQUIRE(r.client->add("a", "arm_2",
                        edge({0, 0, 0}, {1.1, -0.072, -0.28}, {0, 0, 0, 2.1e-3, 0, 5.3e-3})));
  REQUIRE(r.client->add("b", "a", edge({0, 0, 0.3}, {0, 0, 0}, {0, 0, 0, 0, 1.3e-5, 0})));
  // Farther than a user may place a frame, because two such edges add up.
  const auto far = edge({9e8, 0, 0}, {0, 0, 0}, {9e8, 9e8, 9e8, 1, 1, 1});
  REQUIRE(r.client->add("far1", "arm_2", far));
  REQUIRE(r.client->add("far2", "far1", far));
  for (const char* end : {"f", "b", "far2"}) {
    CAPTURE(end);
    const auto asked = r.client->lookup(end, "arm_2");
    INFO((asked ? "" : asked.error().message));
    REQUIRE(asked);
    CHECK(testing::transform_diff(*asked, r.arms->lookup(end, "arm_2").value(), 1e-12) == "");
  }
}

TEST_CASE("a removal removes all frames below and an emptied partition stays usable") {
  const int transport = GENERATE(from_range(testing::networks()));
  Robot r(joined_by(transport));
  REQUIRE(r.arms->remove("robot_2"));
  CHECK_FALSE(r.arms->exists("camera"));
  REQUIRE(r.robot->remove("arm_left"));
  CHECK_FALSE(r.robot->exists("hand_left"));
  REQUIRE(r.client->remove("robot_1"));
  CHECK(r.client->frames().value().size() == 1);
  REQUIRE(r.client->add("arm_1", "world", kX, "arms"));
  CHECK(testing::transform_diff(r.client->lookup("world", "arm_1").value(), kX, 1e-12) == "");
}

TEST_CASE("unknown start, unknown end and no common root are three errors") {
  const int transport = GENERATE(from_range(testing::networks()));
  Robot r(joined_by(transport));
  REQUIRE(r.client->add("island", "", kX, "arms"));
  for (Client* caller : r.all()) {
    CHECK(caller->lookup("nope", "world").error().code == Errc::kUnknownStart);
    CHECK(caller->lookup("world", "nope").error().code == Errc::kUnknownEnd);
  }
  CHECK(r.client->lookup("world", "island").error().code == Errc::kNotConnected);
}

TEST_CASE("an update has any number of edges up to the limit") {
  const int transport = GENERATE(from_range(testing::networks()));
  Robot r(joined_by(transport));
  const std::size_t count = GENERATE(as<std::size_t>{}, 3, 100, kMaxItems, kMaxItems + 1);
  const std::vector<EdgeUpdate> edges(count, EdgeUpdate{"arm_2", kX});
  const auto updated = r.client->update(edges);
  if (count <= kMaxItems) {
    REQUIRE(updated);
    CHECK(testing::transform_diff(r.client->lookup("arm_1", "arm_2").value(), kX, 1e-12) == "");
    return;
  }
  REQUIRE_FALSE(updated);
  CHECK(updated.error().code == Errc::kInvalidInput);
  CHECK(updated.error().message.find("'arms'") != std::string::npos);
  CHECK(updated.error().message.find(std::to_string(kMaxItems)) != std::string::npos);
}

TEST_CASE("a partition has one owner at a time") {
  const int transport = GENERATE(from_range(testing::networks()));
  const Join join = joined_by(transport);
  std::optional<Node> first(Node::open(join("arms"), "arms").value());
  const auto second = Node::open(join("arms"), "arms");
  REQUIRE_FALSE(second);
  CHECK(second.error().code == Errc::kPartitionTaken);
  CHECK(second.error().message.find(std::to_string(getpid())) != std::string::npos);
}

}  // namespace tfdude
