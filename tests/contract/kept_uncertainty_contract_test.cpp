// The uncertainty that owners keep over a restart.

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "tfdude/client/client.hpp"
#include "tfdude/client/node.hpp"

#include "support/catch.hpp"
#include "support/joint_frames.hpp"
#include "support/networks.hpp"
#include "support/observed_chain.hpp"
#include "support/process.hpp"
#include "support/random.hpp"

namespace tfdude {
namespace {

using testing::eventually;
using testing::Join;
using testing::ObservedChain;
using testing::Random;
using testing::TemporaryDirectory;

constexpr std::size_t kEdges = 5;

std::string frame(std::size_t i) { return "frame_" + std::to_string(i); }

// A chain of three owners that store their state; edge i leads to frame i + 1.
class Kept {
 public:
  Kept(const Join& join, const ObservedChain& chain) : join_(join) {
    frames_["a"] = {{frame(0), "", {}}, entry(chain, 0), entry(chain, 1)};
    frames_["b"] = {entry(chain, 2), entry(chain, 3)};
    frames_["c"] = {entry(chain, 4)};
    for (const auto& [name, frames] : frames_) start(name, frames);
    client.emplace(Client::open(join_("")).value());
  }

  /// @param configured  with its configuration, or with none
  void restart(const std::string& name, bool configured) {
    nodes_.erase(name);
    start(name, configured ? frames_.at(name) : std::vector<FrameSpec>());
  }
  void restart_all(bool configured) {
    for (const auto& [name, frames] : frames_) restart(name, configured);
  }

  std::optional<Client> client;

 private:
  // Only the first edge has its common errors in the configuration.
  static FrameSpec entry(const ObservedChain& chain, std::size_t edge) {
    const Belief& X = chain.edges()[edge].X_PC;
    FrameSpec spec{frame(edge + 1), frame(edge), {X.pose, X.own}};
    if (edge == 0) spec.correlation.common_errors = X.common_errors;
    return spec;
  }
  void start(const std::string& name, const std::vector<FrameSpec>& frames) {
    NodeOptions options;
    options.state = directory_.path();
    auto node = Node::open(join_(name), name, frames, options);
    INFO((node ? "" : node.error().message));
    REQUIRE(node);
    nodes_.emplace(name, *std::move(node));
  }

  const Join join_;
  TemporaryDirectory directory_;
  std::map<std::string, std::vector<FrameSpec>> frames_;
  std::map<std::string, Node> nodes_;
};

// The covariance of a path, from the dense filter's covariance of all edges.
Matrix6d of_path(const ObservedChain& chain, const Eigen::MatrixXd& P, std::size_t from,
                 std::size_t to) {
  Eigen::MatrixXd H = Eigen::MatrixXd::Zero(6, P.cols());
  for (std::size_t i = from; i < to; ++i) {
    H.middleCols<6>(static_cast<Eigen::Index>(6 * i)) = adjoint(chain.believed(to, i + 1).pose);
  }
  return H * P * H.transpose();
}

// The largest relative difference of a path from its expected value.
double difference(Client& client, const ObservedChain& chain, const Eigen::MatrixXd& P) {
  double worst = 0;
  for (std::size_t from = 0; from < kEdges; ++from) {
    for (std::size_t to = from + 1; to <= kEdges; ++to) {
      const Matrix6d expected = of_path(chain, P, from, to);
      const auto X = client.lookup(frame(from), frame(to));
      if (!X) return std::numeric_limits<double>::infinity();
      worst = std::max(worst,
                       (X->covariance.of_specified().matrix() - expected).norm() / expected.norm());
    }
  }
  return worst;
}

}  // namespace

TEST_CASE("kept: owners that restart between observations agree with one dense filter") {
  const Join join = testing::join_loopback();
  Random random(0x4e97);
  INFO("seed " << random.seed());
  ObservedChain chain(random, kEdges);
  chain.add_source("supply", {0, 3}, random);
  Kept robot(join, chain);
  // One owner has it in its configuration, the other gets it by a request.
  REQUIRE(eventually([&] {
    return robot.client->correlate(frame(4), {false, chain.edges()[3].X_PC.common_errors, {}})
        .has_value();
  }));
  Eigen::MatrixXd P = chain.dense();
  robot.restart_all(true);
  REQUIRE(eventually([&] { return difference(*robot.client, chain, P) < 1e-6; }));
  constexpr std::array<std::pair<std::size_t, std::size_t>, 4> kObserved{
      {{0, 5}, {0, 5}, {1, 4}, {0, 3}}};
  bool configured = false;
  for (const auto& [from, to] : kObserved) {
    INFO("observed from " << from << " to " << to);
    const Covariance R = random.covariance(0.001, 0.001);
    P = chain.dense_update(P, from, to, R);
    const Transform Z{chain.believed(from, to).pose, R};
    REQUIRE(robot.client->observe(frame(from), frame(to), Z, {}, {1.0, true}));
    chain.observe_exactly(from, to, R);
    CHECK(difference(*robot.client, chain, P) < 1e-6);
    robot.restart_all(configured);
    configured = !configured;
    CHECK(eventually([&] { return difference(*robot.client, chain, P) < 1e-6; }));
    INFO("differs by " << difference(*robot.client, chain, P));
  }
}

TEST_CASE("kept: a correlation set by request survives a restart and can be removed") {
  const Join join = testing::join_loopback();
  Random random(0x4e98);
  INFO("seed " << random.seed());
  const ObservedChain chain(random, kEdges);
  Kept robot(join, chain);
  const auto bound = [&] {
    const auto X = robot.client->lookup(frame(1), frame(4), Query{});
    return X && X->basis.bound;
  };
  REQUIRE(eventually([&] {
    return robot.client->correlate(frame(3), {true, {}, {}}).has_value();
  }));
  CHECK(bound());
  robot.restart("b", true);
  CHECK(eventually(bound));
  REQUIRE(robot.client->correlate(frame(3), {}));
  CHECK_FALSE(bound());
  robot.restart("b", false);
  REQUIRE(eventually([&] { return robot.client->lookup(frame(1), frame(4)).has_value(); }));
  CHECK_FALSE(bound());
}

namespace {

// An arm that a joint moves, and a mount on it that another owner has. Both are of one axis in
// effect: the joint turns about z, and the mount is turned about it, too.
struct JointedArm {
  explicit JointedArm(const Join& join) : join_(join) {
    start();
    StatedCovariance mounted(*Covariance::from_stddev({0.01, 0.01, 0.01, 0.01, 0.01, 0.1}));
    FrameSpec mount{"mount", "arm", {Pose(), mounted}};
    camera.emplace(Node::open(join("camera"), "camera", {mount}).value());
  }
  // @param origin  of the joint, along x, beyond what is described at first
  // @param up  of its axis
  void start(double origin = 0, double up = 1) {
    node_.reset();
    NodeOptions options;
    options.state = directory_.path();
    JointSpec joint = testing::revolute_named("turn");
    joint.joint = revolute_joint(testing::along_x(1 + origin), {0, 0, up});
    const std::vector<FrameSpec> frames{{"world", "", {}},
                                        testing::moved_by("arm", "world", joint)};
    node_.emplace(Node::open(join_("arm"), "arm", frames, options).value());
  }
  void move(double position) {
    REQUIRE(eventually([&] {
      return camera->update_joints({{"turn", position, 1e-4}}, stamp).has_value();
    }));
  }
  void observe() {
    const Transform seen{X("world", "mount").pose,
                         *Covariance::from_stddev({1e-3, 1e-3, 1e-3, 1e-3, 1e-3, 1e-3})};
    REQUIRE(camera->observe("world", "mount", seen, stamp, {1.0, true}));
  }
  StampedTransform X(const char* a, const char* b) {
    std::optional<StampedTransform> found;
    REQUIRE(eventually([&] {
      Query query;
      query.at = stamp;
      const auto one = camera->lookup(a, b, query);
      if (one) found = *one;
      return one.has_value();
    }));
    return *found;
  }
  // The variance of the rotation about z [rad²].
  double variance(const char* a, const char* b) {
    return X(a, b).covariance.of_specified().matrix()(5, 5);
  }

  const Time stamp{std::chrono::seconds(1'000'000'000)};
  std::optional<Node> camera;

 private:
  const Join join_;
  TemporaryDirectory directory_;
  std::optional<Node> node_;
};

}  // namespace

// Its joint's position is stored, and what an observation has made of it.
TEST_CASE("kept: what was observed over a joint counts once, however often its owner restarts") {
  JointedArm arm(testing::join_loopback());
  arm.move(0.4);
  for (int i = 1; i <= 5; ++i) {
    arm.observe();
    // The scalar filter of the joint's angle and the mount's.
    const double seen = 1e-6 / i;
    const double sum = 1 / (1 / (1e-4 + 1e-2) + 1 / seen);
    const auto posterior = [](double own, double rest, double whole) {
      return own * rest / (own + rest) + own * own / ((own + rest) * (own + rest)) * whole;
    };
    CHECK(arm.variance("world", "mount") == testing::Approx(sum).epsilon(1e-3));
    CHECK(arm.variance("arm", "mount") ==
          testing::Approx(posterior(1e-2, 1e-4, sum)).epsilon(1e-3));
    CHECK(arm.variance("world", "arm") ==
          testing::Approx(posterior(1e-4, 1e-2, sum)).epsilon(1e-3));
    arm.start();
  }
  SECTION("the joint's next value is new") {
    arm.move(0.5);
    CHECK(arm.variance("world", "arm") == testing::Approx(1e-4).epsilon(1e-3));
  }
  SECTION("a joint that is described otherwise says nothing that is independent") {
    const bool is_turned = GENERATE(false, true);
    arm.start(is_turned ? 0 : 0.01, is_turned ? -1 : 1);
    CHECK(arm.variance("world", "arm") == testing::Approx(1e-4).epsilon(1e-3));
    CHECK(arm.X("world", "mount").basis.bound);
    const double before = arm.variance("arm", "mount");
    arm.observe();
    CHECK(arm.variance("arm", "mount") >= 0.9 * before);
    arm.move(0.5);
    CHECK_FALSE(arm.X("world", "arm").basis.bound);
  }
}

TEST_CASE("kept: an invalid correlation of another owner's edge is rejected") {
  const Join join = testing::join_loopback();
  Random random(0x4e99);
  INFO("seed " << random.seed());
  const ObservedChain chain(random, kEdges);
  Kept robot(join, chain);
  REQUIRE(eventually([&] { return robot.client->exists(frame(5)); }));
  const auto refused = [&](const std::string& id, const Correlation& correlation) {
    const auto said = robot.client->correlate(id, correlation);
    return said ? std::string("ok") : std::string(to_string(said.error().code));
  };
  const CommonError common_error{"supply", false, Loading::Ones(6, 1)};
  CHECK(refused("nobody", {}) == "unknown_frame");
  CHECK(refused(frame(5), {false, {common_error, common_error}, {}}) == "invalid_input");
  CHECK(refused(frame(5), {false, {{"observed:1", true, common_error.loading}}, {}}) ==
        "invalid_input");
  CHECK(refused(frame(5), {false, {}, {frame(4)}}) == "invalid_input");
  CHECK(refused(frame(5), {false, {{"supply", false, Loading::Constant(6, 1, NAN)}}, {}}) ==
        "invalid_input");
  CHECK(refused(frame(5), {false, {common_error}, {}}) == "ok");
}

}  // namespace tfdude
