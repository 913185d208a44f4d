// A client that follows only some frames, beside real daemons.

#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "tfdude/client/client.hpp"
#include "tfdude/client/node.hpp"
#include "tfdude/transport/fastdds.hpp"

#include "support/catch.hpp"
#include "support/forest_support.hpp"
#include "support/relay.hpp"
#include "support/test_domain.hpp"

namespace tfdude {
namespace {

using testing::along_x;
using testing::await_ready;
using testing::ContainsSubstring;
using testing::eventually;
using testing::outcome;
using testing::Process;
using testing::TemporaryDirectory;
using testing::TestDomain;
using testing::x_of;

// A base, an arm, and a daemon that may own the arm's frames in its place.
struct Robot {
  Robot() {
    const std::string arm_frames =
        "frames:\n  - {id: arm, parent: world, xyz: [1, 0, 0]}\n"
        "  - {id: hand, parent: arm, xyz: [10, 0, 0]}\n";
    const std::string left_frames =
        "frames:\n  - {id: rail, parent: world, xyz: [100, 0, 0]}\n"
        "  - {id: arm, parent: rail, xyz: [1, 0, 0]}\n"
        "  - {id: hand, parent: arm, xyz: [10, 0, 0]}\n";
    base_config = directory.write("base.yaml", "partition: base\nframes:\n  - {id: world}\n");
    arm_config = directory.write("arm.yaml", "partition: arm\n" + arm_frames);
    left_config = directory.write("left.yaml", "partition: left\n" + left_frames);
    base.emplace(domain.serve(base_config));
    arm.emplace(domain.serve(arm_config));
  }
  [[nodiscard]] Client follower(const std::vector<std::string>& follow) const {
    ClientOptions options = domain.options();
    options.follow = follow;
    return Client::open(options).value();
  }

  TestDomain domain;
  TemporaryDirectory directory;
  std::string base_config;
  std::string arm_config;
  std::string left_config;
  std::optional<Process> base;
  std::optional<Process> arm;
  std::optional<Process> left;
};

// Makes an owner answer as one of an earlier version, which does not know requests for single
// frames.
class Earlier final : public testing::Relay {
 public:
  using Relay::Relay;

 private:
  void on_request(const PeerId& from, const Request& request) override {
    if (!std::holds_alternative<FramesRequest>(request.body)) {
      Relay::on_request(from, request);
      return;
    }
    Reply reply;
    reply.sequence = request.sequence;
    reply.body = Error{Errc::kUnsupported, "this kind of request is not known"};
    real().reply(from, reply);
  }
};

Node earlier(const Options& options, const std::string& partition,
             const std::vector<FrameSpec>& frames) {
  auto real = *make_fastdds_transport({options.domain, options.profile, partition, nullptr});
  return Node::open(std::make_unique<Earlier>(std::move(real)), partition, frames, options).value();
}

}  // namespace

TEST_CASE("follow: the command line also finds frames if all owners are of an earlier version") {
  const TestDomain domain;
  const Node base = earlier(domain.options(), "base", {{"world", "", {}}});
  const Node arm = earlier(domain.options(), "arm", {{"hand", "world", along_x(11)}});

  ClientOptions options = domain.options();
  options.follow.emplace();
  auto client = Client::open(options);
  REQUIRE(client);
  CHECK(outcome(client->lookup("world", "hand")) == "unsupported");

  const auto found = domain.cli({"--json", "lookup", "world", "hand"});
  CHECK(found.status == 0);
  CHECK_THAT(found.out, ContainsSubstring("11"));
  CHECK(domain.cli({"exists", "hand"}).out == "yes\n");
  const auto foot = domain.cli({"exists", "foot"});
  CHECK(foot.status == 1);
  CHECK(foot.out == "no\n");
  CHECK_THAT(domain.cli({"lookup", "world", "foot"}).err, ContainsSubstring("'foot'"));
}

TEST_CASE("follow: a new client finds frames and is certain about those that do not exist") {
  const Robot robot;
  Client client = robot.follower({});
  CHECK(x_of(client.lookup("world", "hand")) == 11);
  CHECK(outcome(client.parent("foot")) == "unknown_frame");
  CHECK(client.frames().value().empty());
  Client other = robot.follower({"arm"});
  const auto frames = other.frames();
  REQUIRE(frames);
  REQUIRE(frames->size() == 3);
  CHECK(frames->at(1).id == "hand");
  CHECK(frames->at(1).partition == "arm");
  CHECK(x_of(other.lookup("world", "hand")) == 11);
  REQUIRE(other.add("tool", "hand", along_x(1)));
  CHECK(other.exists("tool"));
  CHECK(x_of(other.lookup("world", "tool")) == 12);
}

TEST_CASE("follow: frames that another daemon takes over are found with a new route") {
  Robot robot;
  Client client = robot.follower({});
  const auto path = client.watch("world", "hand");
  REQUIRE(path);
  CHECK(x_of(client.lookup("world", "hand")) == 11);
  robot.arm->kill();
  // Never a wrong pose: the old one is known until the loss is.
  CHECK(eventually([&] {
    const auto X = client.lookup("world", "hand");
    return outcome(X) == "unreachable";
  }));
  robot.left.emplace(robot.domain.serve(robot.left_config));
  CHECK(eventually([&] { return x_of(client.lookup("world", "hand")) == 111; }));
  CHECK(eventually([&] { return x_of(path->latest()) == 111; }));
  CHECK(client.path("world", "hand").value().front().partition == "left");
}

TEST_CASE("follow: a daemon that restarts is found again") {
  Robot robot;
  Client client = robot.follower({"hand"});
  CHECK(x_of(client.lookup("world", "hand")) == 11);
  robot.arm->kill();
  const auto moved = robot.directory.write(
      "moved.yaml", "partition: arm\nframes:\n  - {id: hand, parent: world, xyz: [5, 0, 0]}\n");
  robot.arm.emplace(robot.domain.serve(moved));
  CHECK(eventually([&] { return x_of(client.lookup("world", "hand")) == 5; }));
  CHECK(outcome(client.lookup("world", "arm")) == "unknown_end");
}

}  // namespace tfdude
