// What is seen of a partition while frames are imported into it, and after that has failed.

#include "tfdude/importing.hpp"

#include <array>
#include <chrono>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "tfdude/client/node.hpp"
#include "tfdude/transport/loopback.hpp"

#include "support/catch.hpp"
#include "support/lossy_requests.hpp"

namespace tfdude::cli {
namespace {

using testing::Approx;
using testing::ContainsSubstring;

Transform known_to(double deviation, double x = 1) {
  std::array<double, 6> stddev{};
  stddev.fill(deviation);
  const auto sigma = Covariance::from_stddev(stddev);
  return {Pose::trusted(Eigen::Quaterniond::Identity(), {x, 0, 0}), *sigma};
}

Correlation shared(double deviation) {
  Loading loading = Loading::Zero(6, 1);
  loading(0, 0) = deviation;
  return {false, {{"mount", false, loading}}, {}};
}

// The frames w, a (with the source "mount") and b of an owner, and a client of it.
struct Robot {
  explicit Robot(std::size_t limit = 100) {
    NodeOptions options;
    options.limits.frames = limit;
    const std::vector<FrameSpec> frames = {{"w", "", Transform::exact({})},
                                           {"a", "w", known_to(0.001), {}, shared(0.5)},
                                           {"b", "w", known_to(0.1)}};
    node.emplace(*Node::open(network.join(), "arm", frames, options));
    ClientOptions common;
    common.timeout = Milliseconds(300);
    auto transport = std::make_unique<testing::LossyRequests>(
        network.join(), [this](const Request& request) { return before(request); });
    client.emplace(*Client::open(std::move(transport), common));
  }

  // The deviation of the edge from w to a [m]; nothing: unspecified.
  std::optional<double> claimed() {
    const auto found = node->lookup("w", "a", Query());
    REQUIRE(found);
    if (!found->covariance.complete()) return std::nullopt;
    return found->covariance.of_specified().stddev()[0];
  }

  // Of each frame its parent.
  std::vector<std::string> structure() {
    std::vector<std::string> list;
    const auto frames = node->frames();
    REQUIRE(frames);
    for (const Frame& frame : *frames) list.push_back(frame.id + " in " + frame.parent);
    return list;
  }

  LoopbackNetwork network;
  std::function<bool(const Request&)> before = [](const Request&) { return false; };
  std::optional<Node> node;
  std::optional<Client> client;
};

}  // namespace

TEST_CASE("importing: an edge never claims more than before and after") {
  Robot robot;
  const bool moves = GENERATE(false, true);
  CAPTURE(moves);
  std::vector<FrameSpec> frames = {{"a", moves ? "b" : "w", known_to(0.2, 5)}};
  for (int i = 0; i < 20; ++i) frames.push_back({"n" + std::to_string(i), "w", known_to(0.2)});
  int seen = 0;
  robot.before = [&](const Request&) {
    const auto claimed = robot.claimed();
    CHECK(claimed.value_or(1) > 0.19);
    ++seen;
    return false;
  };
  REQUIRE(import_frames(*robot.client, "arm", frames));
  CHECK(seen > 20);
  const auto found = robot.node->lookup(moves ? "b" : "w", "a", Query());
  REQUIRE(found);
  CHECK(found->basis.sources.empty());
  CHECK(found->covariance.of_specified().stddev()[0] == Approx(0.2));
  CHECK(found->pose.translation().x() == Approx(5));
}

TEST_CASE("importing: an edge that shares no error has its value of before until the new one") {
  Robot robot;
  robot.before = [&](const Request&) {
    const auto found = robot.node->lookup("w", "b", Query());
    REQUIRE(found);
    CHECK(found->covariance.of_specified().stddev()[0] == Approx(0.1));
    return false;
  };
  REQUIRE(import_frames(*robot.client, "arm", {{"b", "w", known_to(0.3)}, {"c", "b", {}}}));
  robot.before = [](const Request&) { return false; };
  CHECK(robot.node->lookup("w", "b", Query())->covariance.of_specified().stddev()[0] ==
        Approx(0.3));
}

TEST_CASE("importing: what fails before edges change leaves nothing behind") {
  Robot robot(5);
  const auto before = robot.structure();
  const auto done = import_frames(
      *robot.client, "arm",
      {{"a", "b", known_to(0.2, 5)}, {"c", "other", known_to(0.2)}, {"d", "c", known_to(0.2)}});
  REQUIRE_FALSE(done);
  CHECK(done.error().code == Errc::kTooMuch);
  CHECK_THAT(done.error().message, ContainsSubstring("frame 'd' is not added"));
  CHECK(robot.structure() == before);
  CHECK(robot.claimed().value_or(0) == Approx(0.5).epsilon(1e-3));
}

TEST_CASE("importing: the error names what stays without a covariance") {
  Robot robot;
  robot.before = [](const Request& request) {
    return request.id == "a" && std::holds_alternative<CorrelateRequest>(request.body);
  };
  const std::vector<FrameSpec> frames = {
      {"a", "w", known_to(0.2, 5)}, {"b", "w", known_to(0.3)}, {"c", "w", known_to(0.2)}};
  const auto done = import_frames(*robot.client, "arm", frames);
  REQUIRE_FALSE(done);
  CHECK(done.error().code == Errc::kTimeout);
  CHECK_THAT(done.error().message,
             ContainsSubstring("; without a covariance until a next import stay: 'a', 'c'"));
  CHECK_FALSE(robot.claimed());
  CHECK_FALSE(robot.node->lookup("w", "c")->covariance.complete());
  CHECK(robot.node->lookup("w", "b")->covariance.of_specified().stddev()[0] == Approx(0.1));
  robot.before = [](const Request&) { return false; };
  REQUIRE(import_frames(*robot.client, "arm", frames));
  CHECK(robot.claimed().value_or(0) == Approx(0.2));
}

TEST_CASE("importing: sources of samples do not change") {
  Robot robot;
  const auto stamp = robot.node->now();
  REQUIRE(stamp);
  REQUIRE(robot.node->update("a", known_to(0.001), *stamp));
  const std::vector<FrameSpec> frames = {{"c", "w", {}}, {"a", "w", known_to(0.2, 5)}};
  const auto done = import_frames(*robot.client, "arm", frames);
  REQUIRE_FALSE(done);
  CHECK_THAT(done.error().message,
             ContainsSubstring("frame 'a' has samples, whose error sources would change"));
  CHECK_FALSE(robot.node->exists("c"));
  // As the error says.
  REQUIRE(robot.client->move("a", "w"));
  CHECK(robot.claimed().value_or(0) == Approx(0.5).epsilon(1e-3));
  REQUIRE(import_frames(*robot.client, "arm", frames));
  CHECK(robot.claimed().value_or(0) == Approx(0.2));
}

TEST_CASE("importing: the structure of a deep tree is checked in linear time") {
  Robot robot(10);
  std::vector<FrameSpec> chain;
  for (int i = 0; i < 8000; ++i) {
    chain.push_back({"n" + std::to_string(i), i == 0 ? "w" : "n" + std::to_string(i - 1), {}});
  }
  chain.front().parent = "n7999";
  const auto start = std::chrono::steady_clock::now();
  const auto done = import_frames(*robot.client, "arm", chain);
  REQUIRE_FALSE(done);
  CHECK(done.error().code == Errc::kCycle);
  CHECK_THAT(done.error().message,
             ContainsSubstring("frame 'n0': its new parent 'n7999' lies below it"));
  // Two frames that change places are none.
  REQUIRE(robot.client->add("z", "a", known_to(0.1)));
  REQUIRE(
      import_frames(*robot.client, "arm", {{"a", "z", known_to(0.2)}, {"z", "w", known_to(0.2)}}));
  chain.front().parent = "w";
  CHECK(import_frames(*robot.client, "arm", chain).error().code == Errc::kTooMuch);
  CHECK(std::chrono::steady_clock::now() - start < std::chrono::seconds(2));
}

TEST_CASE("importing: no frame is moved below itself on the way") {
  Robot robot;
  REQUIRE(robot.client->add("z", "a", known_to(0.1)));
  REQUIRE(robot.client->add("y", "z", known_to(0.1)));
  REQUIRE(
      import_frames(*robot.client, "arm", {{"a", "y", known_to(0.2)}, {"z", "w", known_to(0.2)}}));
  CHECK(robot.node->lookup("w", "a")->pose.translation().x() == Approx(3));
}

}  // namespace tfdude::cli
