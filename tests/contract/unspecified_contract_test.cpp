// Edges whose covariance is unspecified: what callers elsewhere learn of them.

#include <chrono>
#include <optional>
#include <string>
#include <vector>

#include "tfdude/client/client.hpp"
#include "tfdude/client/node.hpp"

#include "support/catch.hpp"
#include "support/networks.hpp"
#include "support/pose_diff.hpp"
#include "support/process.hpp"
#include "support/random.hpp"

namespace tfdude {
namespace {

using namespace std::chrono_literals;
using testing::ContainsSubstring;
using testing::eventually;
using testing::Join;
using testing::Random;
using testing::TemporaryDirectory;
using testing::transform_diff;
using Names = std::vector<std::string>;

Time ms(std::int64_t milliseconds) { return Time(Milliseconds(milliseconds)); }

Transform unspecified(const Pose& X) { return {X, StatedCovariance::unspecified()}; }

// world ─ odom ─ base of one owner, arm ─ hand of another one. The edges of odom and hand are
// unspecified.
struct Robot {
  explicit Robot(Join joined, Random& random, const std::string& state = {})
      : join(std::move(joined)),
        odom(unspecified(random.pose())),
        base(random.transform(1.0, 0.01, 0.01)),
        arm(random.transform(1.0, 0.01, 0.01)),
        hand(unspecified(random.pose())) {
    NodeOptions options;
    options.state = state;
    robot.emplace(Node::open(join("robot"), "robot",
                             {{"world", "", {}}, {"odom", "world", odom}, {"base", "odom", base}},
                             options)
                      .value());
    arms.emplace(
        Node::open(join("arms"), "arms", {{"arm", "base", arm}, {"hand", "arm", hand}}, options)
            .value());
    client.emplace(Client::open(join("")).value());
  }
  // The path from the world to the hand, as if edges without covariance were exact.
  [[nodiscard]] Transform to_hand() const {
    return compose(compose(odom, base), compose(arm, hand));
  }

  Join join;
  Transform odom;
  Transform base;
  Transform arm;
  Transform hand;
  std::optional<Node> robot;
  std::optional<Node> arms;
  std::optional<Client> client;
};

Names unspecified_of(const Result<StampedTransform>& X) {
  REQUIRE(X);
  CHECK(X->covariance.complete() == X->basis.unspecified.empty());
  return X->basis.unspecified;
}

}  // namespace

TEST_CASE("unspecified: beyond a sample that an observation determined, the motion is not known") {
  const Join join = testing::joined_by(GENERATE(from_range(testing::networks())));
  FrameSpec moving{"cart", "world", {}};
  moving.timing = EdgeTiming();
  Node node = Node::open(join("robot"), "robot", {{"world", "", {}}, moving}).value();
  Client client = Client::open(join("")).value();
  const auto ahead = [](double x, const StatedCovariance& covariance) {
    return Transform{Pose::trusted(Eigen::Quaterniond::Identity(), {x, 0, 0}), covariance};
  };
  const StatedCovariance known = Covariance::trusted(Matrix6d::Identity() * 1e-4);
  const bool first_is_known = GENERATE(true, false);
  REQUIRE(node.update("cart", ahead(0, first_is_known ? known : StatedCovariance::unspecified()),
                      ms(100)));
  REQUIRE(node.update("cart", ahead(1, StatedCovariance::unspecified()), ms(200)));
  Query query;
  query.at = ms(200);
  REQUIRE(node.observe("world", "cart", ahead(1, known), query.at));
  query.extrapolate = 1s;
  for (Client* who : {&client, static_cast<Client*>(&node)}) {
    query.at = ms(200);
    CHECK(unspecified_of(who->lookup("world", "cart", query, 5s)).empty());
    query.at = ms(300);
    CHECK(unspecified_of(who->lookup("world", "cart", query, 5s)) == Names{"cart"});
  }
}

TEST_CASE(
    "unspecified: a lookup names the edges of all owners and has the covariance of the rest") {
  const Join join = testing::join_loopback();
  Random random(831);
  INFO("seed " << random.seed());
  Robot robot(join, random);
  for (Client* who : {&*robot.client, static_cast<Client*>(&*robot.robot)}) {
    const auto X = who->lookup("world", "hand", Query{});
    CHECK(unspecified_of(X) == Names{"odom", "hand"});
    CHECK(transform_diff(X.value(), robot.to_hand(), 1e-12) == "");
    CHECK_FALSE(who->lookup("world", "hand").value().covariance.complete());
    CHECK(unspecified_of(who->lookup("hand", "world", Query{})) == Names{"hand", "odom"});
    CHECK(unspecified_of(who->lookup("odom", "arm", Query{})).empty());
    // Both ways begin with one value of odom.
    const auto fixed = who->lookup("hand", {}, "arm", {}, "world");
    CHECK(unspecified_of(fixed) == Names{"hand"});
  }
}

TEST_CASE("unspecified: covariances are taken away and given by each kind of request") {
  const Join join = testing::join_loopback();
  Random random(832);
  INFO("seed " << random.seed());
  Robot robot(join, random);
  Client& client = *robot.client;
  const auto is_complete = [&](const std::string& from, const std::string& to) {
    const auto X = client.lookup(from, to);
    REQUIRE(X);
    return X->covariance.complete();
  };
  CHECK(is_complete("base", "arm"));
  REQUIRE(client.update("arm", unspecified(random.pose())));
  CHECK_FALSE(is_complete("base", "arm"));
  REQUIRE(client.update({{"arm", robot.arm}, {"base", unspecified(random.pose())}}));
  CHECK(is_complete("base", "arm"));
  CHECK_FALSE(is_complete("odom", "base"));
  REQUIRE(client.update_partial({{"base", {{}, {}, robot.base.covariance}}}));
  CHECK(is_complete("odom", "base"));
  REQUIRE(client.update_partial({{"base", {{}, {}, StatedCovariance::unspecified()}}}));
  CHECK_FALSE(is_complete("odom", "base"));
  REQUIRE(client.add("tool", "hand", unspecified(random.pose())));
  CHECK_FALSE(is_complete("hand", "tool"));
  REQUIRE(client.move("tool", "arm", {{}, {}, StatedCovariance::exact()}));
  CHECK(is_complete("arm", "tool"));
  REQUIRE(client.publish({{"tool", unspecified(random.pose())}}));
  CHECK(eventually([&] {
    const auto X = client.lookup("arm", "tool");
    return X && !X->covariance.complete();
  }));
}

TEST_CASE("unspecified: a watched path shows it, also between samples") {
  const Join join = testing::join_loopback();
  Random random(833);
  INFO("seed " << random.seed());
  Robot robot(join, random);
  const auto path = robot.client->watch("world", "hand");
  REQUIRE(path);
  CHECK(unspecified_of(path->latest()) == Names{"odom", "hand"});
  CHECK(transform_diff(path->latest().value(), robot.to_hand(), 1e-12) == "");
  REQUIRE(robot.arms->update("hand", random.transform(), ms(1000)));
  CHECK(eventually([&] { return unspecified_of(path->latest()) == Names{"odom"}; }));
  REQUIRE(robot.arms->update("hand", unspecified(random.pose()), ms(1100)));
  CHECK(eventually([&] { return unspecified_of(path->latest()) == Names{"odom", "hand"}; }));
  CHECK(unspecified_of(path->at(ms(1050))) == Names{"odom", "hand"});
  CHECK(unspecified_of(path->at(ms(1000))) == Names{"odom"});
  // The same covariance as before, of which only the number is sent.
  REQUIRE(robot.robot->update("odom", {robot.odom.pose, robot.base.covariance}));
  CHECK(eventually([&] { return unspecified_of(path->latest()) == Names{"hand"}; }));
  REQUIRE(robot.robot->update("odom", robot.odom));
  CHECK(eventually([&] { return unspecified_of(path->latest()) == Names{"odom", "hand"}; }));
  REQUIRE(robot.robot->update("odom", {robot.odom.pose, robot.base.covariance}));
  CHECK(eventually([&] { return unspecified_of(path->latest()) == Names{"hand"}; }));
}

TEST_CASE("unspecified: a segment that is pushed composed counts as a whole") {
  const Join join = testing::join_loopback();
  Random random(834);
  Robot robot(join, random);
  WatchOptions options;
  options.composed = true;
  const auto path = robot.client->watch("odom", "hand", options);
  REQUIRE(path);
  CHECK(unspecified_of(path->latest()) == Names{"hand"});
  CHECK(path->latest().value().covariance.of_specified().upper() != Covariance::Upper{});
  REQUIRE(robot.arms->update("hand", random.transform()));
  CHECK(eventually([&] { return unspecified_of(path->latest()).empty(); }));
}

TEST_CASE("unspecified: an observed edge takes what the measurement says") {
  const Join join = testing::join_loopback();
  Random random(835);
  INFO("seed " << random.seed());
  Robot robot(join, random);
  Client& client = *robot.client;
  const Transform Z{random.pose(), random.covariance(0.01, 0.01)};
  const auto both = client.observe("world", "hand", Z);
  REQUIRE_FALSE(both);
  CHECK_THAT(both.error().message,
             ContainsSubstring("the covariance of 2 edges of the path is unspecified"));
  const auto observed = client.observe("world", "arm", Z);
  REQUIRE(observed);
  CHECK(observed->accepted);
  CHECK(observed->dimensions == 0);
  const auto after = client.lookup("world", "arm", Query{});
  CHECK(unspecified_of(after).empty());
  CHECK(transform_diff(after.value(), Z, 1e-9, 1e-3) == "");
  // A second measurement weighs both.
  const auto again = client.observe("world", "arm", Z);
  REQUIRE(again);
  CHECK(again->dimensions == 6);
  const double once = after->covariance.of_specified().matrix().trace();
  CHECK(client.lookup("world", "arm").value().covariance.of_specified().matrix().trace() <
        0.6 * once);
  const auto fused = client.fuse("hand", Z);
  REQUIRE(fused);
  CHECK(transform_diff(client.lookup("arm", "hand").value(), Z, 1e-9) == "");
}

TEST_CASE("unspecified: a restarted owner still says so") {
  const Join join = testing::join_loopback();
  Random random(836);
  const TemporaryDirectory directory;
  Robot robot(join, random, directory.path());
  REQUIRE(robot.client->update("arm", unspecified(robot.arm.pose)));
  robot.arms.reset();
  NodeOptions options;
  options.state = directory.path();
  auto again = Node::open(join("arms"), "arms",
                          {{"arm", "base", robot.arm}, {"hand", "arm", robot.hand}}, options);
  REQUIRE(again);
  CHECK(unspecified_of(again->lookup("base", "hand", Query{})) == Names{"arm", "hand"});
}

}  // namespace tfdude
