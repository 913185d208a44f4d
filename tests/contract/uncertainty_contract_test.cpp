// Uncertainty over partitions: shared sources, bounds, orders, measurements.

#include <cmath>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "tfdude/client/client.hpp"
#include "tfdude/client/node.hpp"
#include "tfdude/math/fusion.hpp"

#include "math/semidefinite.hpp"
#include "support/catch.hpp"
#include "support/networks.hpp"
#include "support/pose_diff.hpp"
#include "support/process.hpp"
#include "support/random.hpp"
#include "support/sampling.hpp"

namespace tfdude {
namespace {

using namespace std::chrono_literals;
using testing::cholesky_root;
using testing::ContainsSubstring;
using testing::covariance_diff;
using testing::eventually;
using testing::Gaussian;
using testing::Join;
using testing::Random;
using testing::squared_distance;
using testing::transform_diff;

// world -> base -> arm -> hand -> tool, of three partitions, and a client without frames.
struct Robot {
  Robot(const Join& join, Random& random, double size = 0.003) {
    for (Transform* X : {&X_world_base, &X_base_arm, &X_arm_hand, &X_hand_tool}) {
      *X = random.transform(1.0, size, size);
    }
    base.emplace(
        Node::open(join("base"), "base", {{"world", "", {}}, {"base", "world", X_world_base}})
            .value());
    arm.emplace(
        Node::open(join("arm"), "arm", {{"arm", "base", X_base_arm}, {"hand", "arm", X_arm_hand}})
            .value());
    tool.emplace(Node::open(join("tool"), "tool", {{"tool", "hand", X_hand_tool}}).value());
    client.emplace(Client::open(join("")).value());
  }
  Transform X_world_base;
  Transform X_base_arm;
  Transform X_arm_hand;
  Transform X_hand_tool;
  std::optional<Node> base;
  std::optional<Node> arm;
  std::optional<Node> tool;
  std::optional<Client> client;
};

Belief with(const Transform& X, std::vector<CommonError> common_errors = {}) {
  return {X.pose, X.covariance.of_specified(), std::nullopt, std::move(common_errors)};
}

CommonError common_error(Random& random, const std::string& source) {
  return {source, false,
          Loading::NullaryExpr(6, 2, [&](auto, auto) { return 0.01 * random.normal(); })};
}

Belief composed(const std::vector<Belief>& edges, Order order = Order::kSecond) {
  Belief X;
  for (const Belief& edge : edges) X = compose(X, edge, order);
  return X;
}

}  // namespace

TEST_CASE("uncertainty: a source that edges of several owners share is counted once") {
  const Join join = testing::join_loopback();
  Random random(661);
  INFO("seed " << random.seed());
  Robot robot(join, random);
  const CommonError a = common_error(random, "calibration");
  const CommonError b = common_error(random, "calibration");
  REQUIRE(robot.base->correlate("base", {false, {a}, {}}));
  REQUIRE(robot.tool->correlate("tool", {false, {b}, {}}));
  const Belief expected = composed({with(robot.X_world_base, {a}), with(robot.X_base_arm),
                                    with(robot.X_arm_hand), with(robot.X_hand_tool, {b})});
  for (Client* who : {&*robot.client, static_cast<Client*>(&*robot.arm)}) {
    const auto X = who->lookup("world", "tool", Query{});
    REQUIRE(X);
    CHECK(transform_diff(*X, collapse(expected), 1e-9) == "");
    CHECK(X->basis.sources == std::vector<std::string>{"calibration"});
    const auto back = who->lookup("tool", "world");
    REQUIRE(back);
    CHECK(transform_diff(*back, inverse(collapse(expected)), 1e-9) == "");
  }
  // Independent errors would give another answer.
  const auto X = robot.client->lookup("world", "tool");
  REQUIRE(X);
  const Transform independent =
      compose(compose(collapse(with(robot.X_world_base, {a})), robot.X_base_arm),
              compose(robot.X_arm_hand, collapse(with(robot.X_hand_tool, {b}))));
  CHECK(covariance_diff(X->covariance, independent.covariance, 1e-3) != "");
}

TEST_CASE("uncertainty: opposite errors of one source cancel exactly over two owners") {
  const Join join = testing::join_loopback();
  Random random(662);
  INFO("seed " << random.seed());
  Robot robot(join, random, 0.0);
  // One encoder error turns the base, and turns the arm back by the same angle, about the same axis
  // in the same place.
  CommonError forth{"encoder", false, Loading::Zero(6, 1)};
  forth.loading(5, 0) = 0.05;
  CommonError back = forth;
  back.loading = -(adjoint(robot.X_base_arm.pose.inverse()) * forth.loading);
  REQUIRE(robot.base->correlate("base", {false, {forth}, {}}));
  REQUIRE(robot.arm->correlate("arm", {false, {back}, {}}));
  const auto to_arm = robot.client->lookup("world", "arm");
  const auto to_base = robot.client->lookup("world", "base");
  REQUIRE(to_arm);
  REQUIRE(to_base);
  CHECK(to_base->covariance.of_specified().stddev()[5] == testing::Approx(0.05));
  CHECK(to_arm->covariance.of_specified().matrix().cwiseAbs().maxCoeff() < 1e-30);
}

TEST_CASE("uncertainty: unknown correlation over owners gives a bound and is reported") {
  const Join join = testing::join_loopback();
  Random random(663);
  INFO("seed " << random.seed());
  Robot robot(join, random);
  REQUIRE(robot.base->correlate("base", {true, {}, {}}));
  REQUIRE(robot.tool->correlate("tool", {true, {}, {}}));
  const auto X = robot.client->lookup("world", "tool", Query{});
  REQUIRE(X);
  CHECK(X->basis.bound);
  // The worst case: both errors are the same one, in the tool.
  const Pose X_tool_base =
      (robot.X_base_arm.pose * robot.X_arm_hand.pose * robot.X_hand_tool.pose).inverse();
  const Matrix6d of_base =
      robot.X_world_base.covariance.transported(X_tool_base).of_specified().matrix();
  const Matrix6d of_tool = robot.X_hand_tool.covariance.of_specified().matrix();
  const Matrix6d root_base = cholesky_root(of_base);
  const Matrix6d root_tool = cholesky_root(of_tool);
  const Matrix6d sum = root_base + root_tool;
  CHECK(testing::domination(X->covariance.of_specified().matrix(), sum * sum.transpose()) > 0);
  const auto independent = robot.client->lookup("base", "hand", Query{});
  REQUIRE(independent);
  CHECK_FALSE(independent->basis.bound);
}

TEST_CASE("uncertainty: all owners use the order of the lookup") {
  const Join join = testing::join_loopback();
  Random random(664);
  INFO("seed " << random.seed());
  Robot robot(join, random, 0.2);
  Query query;
  query.order = Order::kFourth;
  const auto fourth = robot.client->lookup("world", "tool", query);
  const auto second = robot.client->lookup("world", "tool", Query{});
  REQUIRE(fourth);
  REQUIRE(second);
  CHECK(fourth->basis.order == Order::kFourth);
  CHECK(second->basis.order == Order::kSecond);
  const Transform expected = collapse(composed({with(robot.X_world_base), with(robot.X_base_arm),
                                                with(robot.X_arm_hand), with(robot.X_hand_tool)},
                                               Order::kFourth));
  // Owners compose their segments first, which differs in sixth order.
  const Matrix6d exact = expected.covariance.of_specified().matrix();
  const double of_fourth = (fourth->covariance.of_specified().matrix() - exact).norm();
  const double of_second = (second->covariance.of_specified().matrix() - exact).norm();
  INFO("differ by " << of_fourth << " and " << of_second << " of " << exact.norm());
  CHECK(of_fourth < 0.2 * of_second);
}

TEST_CASE("uncertainty: a watched path has the correlation of its edges") {
  const Join join = testing::join_loopback();
  const bool composed_by_owners = GENERATE(false, true);
  Random random(665);
  INFO("seed " << random.seed());
  Robot robot(join, random);
  REQUIRE(robot.base->correlate("base", {false, {common_error(random, "s")}, {}}));
  REQUIRE(robot.tool->correlate("tool", {false, {common_error(random, "s")}, {}}));
  WatchOptions options;
  options.composed = composed_by_owners;
  const auto path = robot.client->watch("world", "tool", options);
  REQUIRE(path);
  const auto as_looked_up = [&] {
    const auto watched = path->latest();
    const auto found = robot.client->lookup("world", "tool");
    return watched && found && transform_diff(*watched, *found, 1e-9) == "";
  };
  CHECK(eventually(as_looked_up));
  REQUIRE(robot.tool->correlate("tool", {true, {}, {}}));
  REQUIRE(robot.tool->update("tool", random.transform(1.0, 0.003, 0.003)));
  CHECK(eventually(as_looked_up));
}

TEST_CASE("uncertainty: a measurement of a path over owners gives the fused covariance") {
  const Join join = testing::join_loopback();
  Random random(666);
  INFO("seed " << random.seed());
  Robot robot(join, random);
  REQUIRE(robot.base->update("world", {}));
  const auto before = robot.client->lookup("world", "tool");
  REQUIRE(before);
  const Transform Z{before->pose * exp(Gaussian(before->covariance)(random)),
                    random.covariance(0.0005, 0.0005)};
  const auto observed = robot.client->observe("world", "tool", Z);
  REQUIRE(observed);
  CHECK(observed->accepted);
  CHECK(observed->dimensions == 6);
  CHECK(observed->corrected == std::vector<std::string>{"base", "arm", "hand", "tool"});
  // The path is the fusion of both estimates.
  const auto fused = fuse({before->transform(), Z});
  const auto after = robot.client->lookup("world", "tool", Query{});
  REQUIRE(fused);
  REQUIRE(after);
  CHECK(testing::pose_diff(after->pose, fused->X.pose, 1e-4) == "");
  CHECK(covariance_diff(after->covariance, fused->X.covariance, 0.02) == "");
  CHECK(after->basis.sources.size() == 1);
  // The same measurement again, from the other end, counts as a second, independent one.
  const auto again = robot.arm->observe("tool", "world", inverse(Z));
  REQUIRE(again);
  const auto twice = robot.client->lookup("world", "tool");
  const auto thrice_fused = fuse({before->transform(), Z, Z});
  REQUIRE(twice);
  REQUIRE(thrice_fused);
  CHECK(covariance_diff(twice->covariance, thrice_fused->X.covariance, 0.02) == "");
  const auto edge = robot.client->lookup("base", "arm");
  REQUIRE(edge);
  CHECK(testing::domination(robot.X_base_arm.covariance.of_specified().matrix(),
                            edge->covariance.of_specified().matrix()) > 0);
  // A new value is not correlated with it.
  REQUIRE(robot.client->update("arm", robot.X_base_arm));
  const auto fresh = robot.client->lookup("base", "arm", Query{});
  REQUIRE(fresh);
  CHECK(fresh->basis.sources.empty());
  CHECK(transform_diff(*fresh, robot.X_base_arm, 1e-9) == "");
}

TEST_CASE("uncertainty: a measurement that the gate rejects changes nothing and is counted") {
  const Join join = testing::join_loopback();
  Random random(667);
  INFO("seed " << random.seed());
  Robot robot(join, random);
  const auto before = robot.client->lookup("world", "tool");
  REQUIRE(before);
  const Transform wrong{before->pose * exp(0.5 * Twist::Unit(4)), random.covariance(0.001, 0.001)};
  const auto refused = robot.client->observe("world", "tool", wrong);
  REQUIRE(refused);
  CHECK_FALSE(refused->accepted);
  CHECK(refused->distance_squared > 10 * refused->limit);
  CHECK(refused->corrected.empty());
  const auto after = robot.client->lookup("world", "tool");
  REQUIRE(after);
  CHECK(transform_diff(*after, *before, 1e-12) == "");
  REQUIRE(robot.client->observe("world", "tool", {before->pose, wrong.covariance}));
  const auto consistency = robot.client->consistency("arm");
  REQUIRE(consistency);
  REQUIRE(consistency->size() == 2);
  CHECK(consistency->at(0).id == "arm");
  CHECK(consistency->at(0).observations == 2);
  CHECK(consistency->at(0).refused == 1);
  CHECK(consistency->at(0).sum.squares > consistency->at(0).sum.expected);
  CHECK(robot.client->consistency("base").value().size() == 1);
  CHECK_FALSE(robot.client->consistency("nobody"));
}

TEST_CASE("uncertainty: concurrent measurements of one path by two clients each count once") {
  const Join join = testing::join_loopback();
  Random random(671);
  INFO("seed " << random.seed());
  Robot robot(join, random);
  auto other = Client::open(join(""));
  REQUIRE(other);
  const auto before = robot.client->lookup("world", "tool");
  REQUIRE(before);
  const Transform Z{before->pose, random.covariance(0.002, 0.002)};
  constexpr int kEach = 10;
  const auto observe_all = [&Z](Client& client, int& done) {
    for (int i = 0; i < kEach; ++i) {
      if (const auto observed = client.observe("world", "tool", Z)) ++done;
    }
  };
  int mine = 0;
  int others = 0;
  std::thread thread([&] { observe_all(*other, others); });
  observe_all(*robot.client, mine);
  thread.join();
  // A caller that finds the edge changed each time gives up, and has changed nothing.
  CHECK(mine + others > kEach);
  const std::vector<Transform> all(static_cast<std::size_t>(mine + others), Z);
  std::vector<Transform> estimates = {before->transform()};
  estimates.insert(estimates.end(), all.begin(), all.end());
  const auto fused = fuse(estimates);
  const auto after = robot.client->lookup("world", "tool");
  REQUIRE(fused);
  REQUIRE(after);
  CHECK(covariance_diff(after->covariance, fused->X.covariance, 0.02) == "");
}

TEST_CASE("uncertainty: four clients measure overlapping paths at once, and each counts once") {
  const Join join = testing::join_loopback();
  Random random(672);
  INFO("seed " << random.seed());
  Robot robot(join, random);
  const std::vector<std::pair<std::string, std::string>> paths = {
      {"world", "tool"}, {"base", "hand"}, {"arm", "tool"}, {"world", "arm"}};
  std::vector<Client> clients;
  std::vector<Transform> Z;
  for (const auto& [a, b] : paths) {
    clients.push_back(Client::open(join("")).value());
    const auto before = robot.client->lookup(a, b);
    REQUIRE(before);
    Z.push_back({before->pose, random.covariance(0.002, 0.002)});
  }
  constexpr std::size_t kEach = 10;
  std::vector<std::size_t> done(paths.size());
  std::vector<std::thread> threads;
  for (std::size_t k = 0; k < paths.size(); ++k) {
    threads.emplace_back([&, k] {
      for (std::size_t i = 0; i < kEach; ++i) {
        if (clients[k].observe(paths[k].first, paths[k].second, Z[k])) ++done[k];
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  CHECK(done == std::vector<std::size_t>(paths.size(), kEach));
  // The same in an owner of all edges, by one client.
  auto all = Node::open(testing::join_loopback()("all"), "all",
                        {{"world", "", {}},
                         {"base", "world", robot.X_world_base},
                         {"arm", "base", robot.X_base_arm},
                         {"hand", "arm", robot.X_arm_hand},
                         {"tool", "hand", robot.X_hand_tool}});
  REQUIRE(all);
  for (std::size_t i = 0; i < kEach; ++i) {
    for (std::size_t k = 0; k < paths.size(); ++k)
      REQUIRE(all->observe(paths[k].first, paths[k].second, Z[k]));
  }
  for (const auto& [a, b] : paths) {
    const auto expected = all->lookup(a, b);
    const auto found = robot.client->lookup(a, b);
    REQUIRE(expected);
    REQUIRE(found);
    CHECK(covariance_diff(found->covariance, expected->covariance, 1e-3) == "");
  }
}

TEST_CASE("uncertainty: fuse combines another owner's edge with a measurement of it") {
  const Join join = testing::join_loopback();
  Random random(668);
  INFO("seed " << random.seed());
  Robot robot(join, random);
  const Transform Z{robot.X_arm_hand.pose * exp(0.001 * random.twist(1.0, 1.0)),
                    random.covariance(0.003, 0.003)};
  REQUIRE(robot.client->fuse("hand", Z));
  const auto expected = fuse({robot.X_arm_hand, Z});
  const auto found = robot.client->lookup("arm", "hand", Query{});
  REQUIRE(found);
  CHECK(transform_diff(*found, expected->X, 1e-9, 1e-6) == "");
  CHECK(found->basis.sources.empty());
  const auto root = robot.client->fuse("world", Z);
  REQUIRE_FALSE(root);
  CHECK_THAT(root.error().message, ContainsSubstring("root"));
  const auto nobody = robot.client->fuse("nobody", Z);
  REQUIRE_FALSE(nobody);
  CHECK(nobody.error().code == Errc::kUnknownFrame);
  const auto far = robot.client->observe("hand", "hand", Z);
  REQUIRE_FALSE(far);
  CHECK(far.error().code == Errc::kInvalidInput);
}

TEST_CASE("uncertainty: dynamic edges are corrected by a sample with the measurement's stamp") {
  const Join join = testing::join_loopback();
  Random random(669);
  INFO("seed " << random.seed());
  Robot robot(join, random);
  const auto at = [](int ms) { return Time(1'000'000s + ms * 1ms); };
  for (const int ms : {0, 10, 20}) {
    REQUIRE(robot.client->update({{"arm", robot.X_base_arm}, {"tool", robot.X_hand_tool}}, at(ms)));
  }
  const auto path = robot.client->lookup("world", "tool");
  REQUIRE(path);
  const Transform Z{path->pose * exp(0.002 * random.twist(1.0, 1.0)),
                    random.covariance(0.0005, 0.0005)};
  for (const int ms : {5, 10, 20}) {
    INFO(ms << " ms");
    const auto observed = robot.client->observe("world", "tool", Z, at(ms));
    REQUIRE(observed);
    CHECK(observed->stamp == at(ms));
    Query query;
    query.at = at(ms);
    const auto then = robot.client->lookup("world", "tool", query);
    REQUIRE(then);
    // The path agrees with the measurement, within the measurement's covariance.
    const Twist e = log(then->pose.inverse() * Z.pose);
    CHECK(squared_distance(e, Z.covariance.of_specified().matrix()) < 25.0);
    REQUIRE(robot.client->update({{"base", robot.X_world_base}, {"hand", robot.X_arm_hand}}));
  }
  const auto late = robot.client->observe("world", "tool", Z, at(30));
  REQUIRE_FALSE(late);
  CHECK(late.error().code == Errc::kNotYet);
}

TEST_CASE("uncertainty: covariances stay consistent over 100 robots with two observed paths") {
  Random random(670);
  INFO("seed " << random.seed());
  double sum = 0;
  constexpr int kRuns = 100;
  for (int run = 0; run < kRuns; ++run) {
    Robot robot(testing::join_loopback(), random);
    const auto truth = [&](const Transform& X) {
      return X.pose * exp(Gaussian(X.covariance)(random));
    };
    const Pose base = truth(robot.X_world_base);
    const Pose arm = base * truth(robot.X_base_arm);
    const Pose hand = arm * truth(robot.X_arm_hand);
    const Pose tool = hand * truth(robot.X_hand_tool);
    const auto measured = [&](const Pose& X) {
      const Covariance R = random.covariance(0.001, 0.001);
      return Transform{X * exp(Gaussian(R)(random)).inverse(), R};
    };
    const ObserveOptions all{1.0, true};
    REQUIRE(robot.client->observe("world", "hand", measured(hand), {}, all));
    REQUIRE(robot.client->observe("base", "tool", measured(base.inverse() * tool), {}, all));
    REQUIRE(robot.tool->observe("world", "hand", measured(hand), {}, all));
    const auto X = robot.client->lookup("world", "tool");
    REQUIRE(X);
    const Twist e = log(X->pose.inverse() * tool);
    sum += e.dot(pseudo_inverse(X->covariance.of_specified().matrix()) * e);
  }
  INFO("mean " << sum / kRuns);
  CHECK(sum > chi_squared_quantile(0.005, 6 * kRuns));
  CHECK(sum < chi_squared_quantile(0.995, 6 * kRuns));
}

}  // namespace tfdude
