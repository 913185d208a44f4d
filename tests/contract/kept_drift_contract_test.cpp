// What owners keep of edges that move, over a restart: beside an owner that never ends.

#include <chrono>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "tfdude/client/node.hpp"

#include "support/catch.hpp"
#include "support/forest_support.hpp"
#include "support/networks.hpp"
#include "support/process.hpp"
#include "support/random.hpp"

namespace tfdude {
namespace {

using testing::along_x;
using testing::Random;
using testing::TemporaryDirectory;

constexpr double kStart = 0.09;      // variance of the base
constexpr double kDensity = 1e-4;    // of its drift, per second
constexpr double kSighting = 25e-6;  // variance

Time at(int step) { return Time(std::chrono::milliseconds(100 * (step + 1))); }

Covariance variance(double each) { return Covariance::trusted(each * Matrix6d::Identity()); }

// One owner of a base that drifts, a mark whose place is exact, and one whose place is not.
class Owner {
 public:
  explicit Owner(bool restarts) : restarts_(restarts) { start(); }

  void drive(const Pose& told, int step) {
    REQUIRE(node_->update("base", Transform{told, variance(kStart)}, at(step)));
    restart();
  }
  void see(const std::string& mark, const Pose& seen, int step) {
    const auto found = node_->observe("base", mark, {seen, variance(kSighting)}, at(step));
    REQUIRE(found);
    REQUIRE(found->accepted);
    restart();
  }
  [[nodiscard]] Transform lookup(const std::string& a, const std::string& b, int step) {
    Query query;
    query.at = at(step);
    return node_->lookup(a, b, query).value().transform();
  }
  [[nodiscard]] Node& node() { return *node_; }
  void restart() {
    if (!restarts_) return;
    node_.reset();
    start();
  }

 private:
  void start() {
    FrameSpec base{"base", "odom", Transform{{}, variance(kStart)}};
    base.timing = EdgeTiming();
    base.timing->moving = true;
    base.timing->drifts = true;
    base.timing->process_noise = variance(kDensity);
    FrameSpec tool{"tool", "odom", along_x(1)};
    tool.timing = EdgeTiming();
    tool.timing->moving = true;
    NodeOptions options;
    options.state = directory_.path();
    node_.emplace(Node::open(network_.join(), "robot",
                             {{"odom", "", {}},
                              base,
                              {"exact", "odom", along_x(2)},
                              {"rough", "odom", {along_x(2).pose, variance(0.01)}},
                              tool},
                             options)
                      .value());
  }

  const bool restarts_;
  LoopbackNetwork network_;
  TemporaryDirectory directory_;
  std::optional<Node> node_;
};

void check_same(const Transform& a, const Transform& b) {
  CHECK((a.pose.matrix() - b.pose.matrix()).cwiseAbs().maxCoeff() < 1e-9);
  const Matrix6d P = a.covariance.of_specified().matrix();
  const Matrix6d Q = b.covariance.of_specified().matrix();
  CHECK((P - Q).norm() <= 1e-9 * P.norm());
}

}  // namespace

TEST_CASE("kept: odometry goes on from what was seen, whenever its owner restarts") {
  Random random(691);
  INFO("seed " << random.seed());
  const bool uncertain = GENERATE(false, true);
  CAPTURE(uncertain);
  const std::string mark = uncertain ? "rough" : "exact";
  Owner stays(false);
  Owner restarts(true);
  Pose told;
  const Pose ahead = along_x(0.2).pose;  // of what the odometry says
  for (int step = 0; step < 12; ++step) {
    CAPTURE(step);
    for (Owner* owner : {&stays, &restarts}) owner->drive(told, step);
    if (step % 4 == 2) {
      const Pose seen = (ahead * told).inverse() * along_x(2).pose;
      for (Owner* owner : {&stays, &restarts}) owner->see(mark, seen, step);
    }
    for (const std::string& to : {std::string("base"), mark}) {
      check_same(stays.lookup("odom", to, step), restarts.lookup("odom", to, step));
    }
    told = told * random.pose(0.05);
  }
}

TEST_CASE("kept: a frame that was moved by request stays static, whenever its owner restarts") {
  Owner owner(true);
  Query later;
  later.at = at(50);
  const auto x = [&] { return owner.node().lookup("odom", "tool", later); };
  REQUIRE(!x());
  REQUIRE(owner.node().move("tool", "exact", along_x(3)));
  for (int life = 0; life < 3; ++life) {
    CAPTURE(life);
    const auto X = x();
    REQUIRE(X);
    CHECK(X->pose.translation().x() == 5);
    owner.restart();
  }
  // From its next sample on it is dynamic again.
  REQUIRE(owner.node().update("tool", along_x(4), at(0)));
  CHECK(!x());
}

}  // namespace tfdude
