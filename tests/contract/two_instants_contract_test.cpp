// The uncertainty of a pose between two instants: an edge on both ways has one error, or one that
// is not known to be another. Closed forms.

#include <algorithm>
#include <chrono>
#include <cmath>
#include <string>
#include <vector>

#include "tfdude/client/client.hpp"
#include "tfdude/client/node.hpp"

#include "support/catch.hpp"
#include "support/networks.hpp"

namespace tfdude {
namespace {

using testing::Approx;

Query at(int seconds) {
  Query query;
  query.at = Time(std::chrono::seconds(seconds));
  return query;
}

Covariance of_deviations(double translation, double rotation) {
  return *Covariance::from_stddev(
      {translation, translation, translation, rotation, rotation, rotation});
}

Pose turned(double yaw, double x = 0) {
  return Pose::trusted(Eigen::Quaterniond(Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ())),
                       {x, 0, 0});
}

// map -> odom of one owner, base -> mount of another one. The base moves exactly.
struct Robot {
  Robot(const Covariance& of_odom, const Covariance& of_base, const Covariance& of_mount) {
    nodes.push_back(
        Node::open(join("map"), "map", {{"map", "", {}}, {"odom", "map", {Pose(), of_odom}}})
            .value());
    nodes.push_back(Node::open(join("base"), "base",
                               {{"base", "odom", {Pose(), of_base}},
                                {"mount", "base", {turned(0, 1), of_mount}}})
                        .value());
    REQUIRE(nodes[1].update("base", {Pose(), of_base}, *at(1).at));
    REQUIRE(nodes[1].update("base", {turned(std::acos(-1.0), 1), of_base}, *at(2).at));
    REQUIRE(nodes[1].update("base", {turned(std::acos(-1.0), 2), of_base}, *at(3).at));
  }
  [[nodiscard]] Twist variances(const std::string& frame, int from, int to,
                                const std::string& fixed) {
    const auto X = nodes[0].lookup(frame, at(from), frame, at(to), fixed);
    REQUIRE(X);
    bound = X->basis.bound;
    return X->covariance.of_specified().matrix().diagonal();
  }

  testing::Join join = testing::join_loopback();
  std::vector<Node> nodes;
  bool bound = false;
};

}  // namespace

TEST_CASE("two instants: a static edge has one error, which cancels or doubles") {
  Robot robot(Covariance(), Covariance(), of_deviations(0.01, 0));
  CHECK(robot.variances("mount", 2, 3, "odom").cwiseAbs().maxCoeff() < 1e-15);
  const Twist half_a_turn = robot.variances("mount", 1, 2, "odom");
  CHECK(half_a_turn[0] == Approx(0.02 * 0.02));
  CHECK(half_a_turn[1] == Approx(0.02 * 0.02));
  CHECK(std::abs(half_a_turn[2]) < 1e-15);
  CHECK_FALSE(robot.bound);
}

// What the observation has left cancels to nothing, from which nothing can be subtracted.
TEST_CASE("two instants: an observed static edge has one error, too") {
  Robot robot(Covariance(), Covariance(), of_deviations(0.01, 0.01));
  const Transform Z{turned(0, 1), of_deviations(0.001, 0.001)};
  const auto seen = robot.nodes[0].observe("map", "mount", Z, at(1).at);
  REQUIRE(seen);
  REQUIRE(seen->accepted);
  const double left = 1 / (1 / (0.01 * 0.01) + 1 / (0.001 * 0.001));
  const Twist straight = robot.variances("mount", 2, 3, "odom");
  CHECK(std::abs(straight[0]) < 1e-15);
  CHECK(straight[1] == Approx(left));  // of the yaw, 1 m on
  CHECK(straight.tail<3>().cwiseAbs().maxCoeff() < 1e-15);
  CHECK(robot.variances("mount", 1, 2, "odom")[0] == Approx(4 * left));
}

TEST_CASE("two instants: what is above the moving edges does not count") {
  Robot robot(of_deviations(1, 0.1), Covariance(), Covariance());
  CHECK(robot.variances("mount", 1, 3, "map").cwiseAbs().maxCoeff() < 1e-12);
  CHECK_FALSE(robot.bound);
}

TEST_CASE("two instants: the errors of a dynamic edge may be correlated in any way") {
  Robot robot(Covariance(), of_deviations(0.01, 0), Covariance());
  CHECK(robot.variances("base", 2, 3, "odom")[0] == Approx(0.02 * 0.02));
  CHECK(robot.bound);
  CHECK(robot.variances("base", 3, 3, "odom").cwiseAbs().maxCoeff() < 1e-15);
}

// In one dimension: the deviation grows by 10 mm in a second, from 2 mm on. The edge is observed at
// the third sample, to 3 mm; of the way from before to after that nobody knows the correlation.
TEST_CASE("two instants: what an edge has drifted up to its first observation counts") {
  constexpr double kStart = 0.002;
  constexpr double kRate = 0.01;
  constexpr double kSeen = 0.003;
  const auto join = testing::join_loopback();
  FrameSpec wheel{"wheel", "world", {Pose(), of_deviations(kStart, 0)}};
  wheel.timing.emplace().drifts = true;
  wheel.timing->process_noise = of_deviations(kRate, 0);
  Node node = Node::open(join("base"), "base", {{"world", "", {}}, wheel}).value();
  Client client = Client::open(join("")).value();
  const auto sample = [&](int second) {
    return node.update("wheel", {Pose(), of_deviations(kStart, 0)}, *at(second).at).has_value();
  };
  for (const int second : {1, 2, 3}) REQUIRE(sample(second));
  const auto seen = node.observe("world", "wheel", {Pose(), of_deviations(kSeen, 1)}, at(3).at);
  REQUIRE(seen);
  REQUIRE(seen->accepted);
  for (const int second : {4, 6}) REQUIRE(sample(second));
  // Of the errors at each second from the first on, before and after.
  const auto prior = [&](int i, int k) {
    return kStart * kStart + kRate * kRate * (std::min(i, k) - 1);
  };
  const auto posterior = [&](int i, int k) {
    return prior(i, k) - prior(i, 3) * prior(k, 3) / (prior(3, 3) + kSeen * kSeen);
  };
  for (Client* one : {&client, static_cast<Client*>(&node)}) {
    for (int a = 1; a < 6; ++a) {
      for (int b = a + 1; b <= 6; ++b) {
        INFO(a << " to " << b);
        const double right = posterior(a, a) + posterior(b, b) - 2 * posterior(a, b);
        const auto X = one->lookup("wheel", at(a), "wheel", at(b), "world");
        REQUIRE(X);
        const double claimed = X->covariance.of_specified().matrix()(0, 0);
        CHECK(claimed > right * (1 - 1e-9));
        const bool over = a < 3 && b >= 3;
        CHECK(X->basis.bound == over);
        if (!over) CHECK(claimed < right * 2);
        VelocityQuery query;
        query.over = std::chrono::seconds(b - a);
        query.at = *at(a).at + query.over / 2;
        const auto velocity = one->velocity("world", "wheel", query);
        REQUIRE(velocity);
        const double per_second = velocity->covariance.of_specified().matrix()(0, 0);
        CHECK(per_second * (b - a) * (b - a) > right * (1 - 1e-9));
      }
    }
  }
}

}  // namespace tfdude
