// Clients that keep only some frames, and ask for all others.

#include "runtime/on_demand.hpp"

#include <atomic>
#include <optional>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "tfdude/client/client.hpp"
#include "tfdude/client/node.hpp"
#include "tfdude/transport/loopback.hpp"

#include "support/catch.hpp"
#include "support/forest_support.hpp"
#include "support/process.hpp"
#include "support/relay.hpp"
#include "support/rig.hpp"

namespace tfdude {
namespace {

using namespace std::chrono_literals;
using testing::along_x;
using testing::ContainsSubstring;
using testing::eventually;
using testing::outcome;
using testing::Relay;
using testing::ScriptedOwner;
using testing::x_of;
using Names = std::vector<std::string>;

// Counts what a client asks for.
class Counter final : public Relay {
 public:
  using Relay::Relay;
  using Relay::send;
  Result<void> send(const std::string& partition, const Request& request,
                    Deadline deadline) override {
    if (const auto* asked = std::get_if<FramesRequest>(&request.body)) {
      ++requests;
      frames += asked->ids.size();
    }
    return Relay::send(partition, request, deadline);
  }
  std::atomic<std::size_t> requests{0};
  std::atomic<std::size_t> frames{0};
};

struct Follower {
  explicit Follower(LoopbackNetwork& network, const Names& follow = {}) {
    auto counting = std::make_unique<Counter>(network.join());
    counter = counting.get();
    ClientOptions options = testing::quick();
    options.timeout = 2s;
    options.follow = follow;
    auto opened = Client::open(std::move(counting), options);
    REQUIRE(opened);
    client.emplace(*std::move(opened));
  }
  Client* operator->() { return &*client; }

  Counter* counter = nullptr;
  std::optional<Client> client;
};

// world(base) - mount(base) - hand(arm) - finger(arm); each edge 1 m along x.
struct Robot {
  [[nodiscard]] Node open_arm(const std::string& parent = "mount", double x = 1) {
    return *Node::open(network.join(), "arm",
                       {{"hand", parent, along_x(x)}, {"finger", "hand", along_x(1)}});
  }
  LoopbackNetwork network;
  Node base =
      *Node::open(network.join(), "base", {{"world", "", {}}, {"mount", "world", along_x(1)}});
  std::optional<Node> arm{open_arm()};
};

bool answers_unsupported(Transport& transport, const PeerId& from, const Request& request) {
  if (!std::holds_alternative<FramesRequest>(request.body)) return false;
  transport.reply(from, {request.sequence, 0, Error{Errc::kUnsupported, "not known"}});
  return true;
}

Names ids_of(const Result<std::vector<Frame>>& frames) {
  Names ids;
  for (const Frame& frame : frames.value()) ids.push_back(frame.id);
  return ids;
}

}  // namespace

TEST_CASE("on demand: a client asks once for a frame that it does not follow") {
  Robot robot;
  Follower client(robot.network);
  CHECK(x_of(client->lookup("world", "finger")) == 3);
  CHECK(client.counter->requests == 1);
  CHECK(client.counter->frames == 2);
  CHECK(x_of(client->lookup("world", "finger")) == 3);
  CHECK(x_of(client->lookup("hand", "mount")) == -1);  // known as frames above the first
  CHECK(client.counter->requests == 1);
  CHECK(client->frames()->empty());
}

TEST_CASE("on demand: a client follows trees and frames whose ids begin so") {
  Robot robot;
  Follower client(robot.network, {"hand", "wor*"});
  CHECK(ids_of(client->frames()) == Names{"finger", "hand", "mount", "world"});
  const std::size_t asked = client.counter->requests;
  CHECK(x_of(client->lookup("mount", "finger")) == 2);
  CHECK(client.counter->requests == asked);
  REQUIRE(robot.arm->add("nail", "finger", along_x(1)));
  REQUIRE(robot.arm->add("lamp", "world", along_x(1), "arm"));
  CHECK(eventually([&] {
    return ids_of(client->frames()) == Names{"finger", "hand", "mount", "nail", "world"};
  }));
  CHECK(eventually([&] { return x_of(client->lookup("world", "lamp")) == 1; }));
}

TEST_CASE("on demand: what does not exist is asked for, each time") {
  Robot robot;
  Follower client(robot.network);
  CHECK_FALSE(client->exists("tool"));
  CHECK(outcome(client->parent("tool")) == "unknown_frame");
  CHECK(outcome(client->lookup("world", "tool")) == "unknown_end");
  CHECK(outcome(client->update("tool", along_x(1))) == "unknown_frame");
  REQUIRE(robot.arm->add("tool", "finger", along_x(1)));
  CHECK(eventually([&] { return client->exists("tool"); }));
  CHECK(client->parent("tool") == "finger");
  CHECK(x_of(client->lookup("world", "tool")) == 4);
  REQUIRE(robot.arm->remove("tool"));
  CHECK(eventually([&] { return outcome(client->lookup("world", "tool")) == "unknown_end"; }));
  CHECK_FALSE(client->exists("tool"));
}

TEST_CASE("on demand: a client that is alone says that nobody answers") {
  LoopbackNetwork network;
  Follower client(network);
  const auto nothing = client->parent("hand");
  CHECK(outcome(nothing) == "unknown_frame");
  CHECK_THAT(nothing.error().message, ContainsSubstring("no partition answers"));
}

TEST_CASE("on demand: a frame that was moved is found again, with its owner or another") {
  Robot robot;
  Follower client(robot.network);
  const auto finger = client->find("finger");
  REQUIRE(finger);
  CHECK(x_of(client->lookup("world", "finger")) == 3);
  // Within its owner: the known route is right.
  REQUIRE(robot.arm->move("hand", "world", along_x(10)));
  CHECK(x_of(client->lookup("world", "finger")) == 11);
  CHECK(eventually([&] { return client->parent("hand") == "world"; }));
  // To another owner.
  REQUIRE(robot.arm->remove("hand"));
  REQUIRE(eventually([&] { return !robot.base.exists("hand") && !robot.base.exists("finger"); }));
  REQUIRE(robot.base.add("hand", "mount", along_x(100)));
  REQUIRE(robot.base.add("finger", "hand", along_x(1)));
  CHECK(x_of(client->lookup("world", "finger")) == 102);
  CHECK(x_of(client->lookup(*client->find("world"), *finger)) == 102);
  CHECK(client->path("world", "finger")->size() == 1);
}

TEST_CASE("on demand: an owner that restarts with another structure is asked again") {
  Robot robot;
  Follower client(robot.network);
  CHECK(x_of(client->lookup("world", "finger")) == 3);
  robot.arm.reset();
  const auto lost = client->lookup("world", "finger");
  CHECK(outcome(lost) == "unreachable");
  CHECK_THAT(lost.error().message, ContainsSubstring("arm"));
  robot.arm.emplace(robot.open_arm("world", 5));
  CHECK(eventually([&] { return x_of(client->lookup("mount", "finger")) == 5; }));
}

TEST_CASE("on demand: a client sees its own changes, whoever is asked") {
  Robot robot;
  Follower client(robot.network);
  for (int i = 0; i < 20; ++i) {
    const std::string id = "tool_" + std::to_string(i);
    REQUIRE(client->add(id, "finger", along_x(1)));
    REQUIRE(client->exists(id));
    CHECK(outcome(client->add(id, "finger", along_x(1))) == "already_exists");
    REQUIRE(client->move(id, "world", along_x(7)));
    REQUIRE(client->parent(id) == "world");
    REQUIRE(x_of(client->lookup("world", id)) == 7);
  }
  CHECK(outcome(client->add("other", "nothing", along_x(1))) == "unknown_parent");
  CHECK(outcome(client->add("other", "", along_x(1), "leg")) == "unknown_partition");
  CHECK(outcome(client->move("world", "finger")) == "cycle");
}

TEST_CASE("on demand: values are set and streamed") {
  Robot robot;
  Follower client(robot.network);
  REQUIRE(client->update("hand", along_x(2)));
  CHECK(x_of(client->lookup("world", "finger")) == 4);
  REQUIRE(client->update({{"mount", along_x(5)}, {"finger", along_x(6)}}));
  CHECK(x_of(client->lookup("world", "finger")) == 13);
  REQUIRE(client->publish({{"hand", along_x(3)}}));
  CHECK(eventually([&] { return x_of(client->lookup("world", "finger")) == 14; }));
  CHECK(client->history("hand")->empty());
  CHECK(client->histories("arm"));
}

TEST_CASE("on demand: a watched path takes a new route") {
  Robot robot;
  Follower client(robot.network);
  const auto path = client->watch("world", "finger");
  REQUIRE(path);
  CHECK(x_of(path->latest()) == 3);
  REQUIRE(robot.arm->update("hand", along_x(2)));
  CHECK(eventually([&] { return x_of(path->latest()) == 4; }));
  REQUIRE(robot.arm->remove("hand"));
  REQUIRE(eventually([&] { return !robot.base.exists("hand"); }));
  REQUIRE(robot.base.add("hand", "mount", along_x(100)));
  REQUIRE(robot.base.add("finger", "hand", along_x(1)));
  CHECK(eventually([&] { return x_of(path->latest()) == 102; }));
}

TEST_CASE("on demand: a lookup waits for a frame that appears") {
  Robot robot;
  Follower client(robot.network);
  auto waiting = client->lookup_async("world", "tool", {}, 20s);
  CHECK(outcome(client->lookup("world", "tool", {}, 30ms)) == "unknown_end");
  CHECK(waiting.wait_for(0s) == std::future_status::timeout);
  REQUIRE(robot.arm->add("tool", "finger", along_x(1)));
  REQUIRE(waiting.wait_for(20s) == std::future_status::ready);
  CHECK(x_of(waiting.get()) == 4);
}

TEST_CASE("on demand: an observation corrects edges") {
  Robot robot;
  Transform X = along_x(1);
  X.covariance = Covariance::from_stddev({1, 1, 1, 0.1, 0.1, 0.1}).value();
  REQUIRE(robot.arm->update("hand", X));
  Follower client(robot.network);
  Transform measured = along_x(2.5);
  measured.covariance = X.covariance;
  const auto observed = client->observe("world", "hand", measured);
  REQUIRE(observed);
  CHECK(observed->corrected == Names{"hand"});
  CHECK(x_of(client->lookup("world", "hand")) == testing::Approx(2.25));
}

TEST_CASE("on demand: an owner of an earlier version is passed over") {
  LoopbackNetwork network;
  const ScriptedOwner old(network, "a_base", {{"world", "", {}}}, answers_unsupported);
  Follower client(network);
  CHECK(outcome(client->lookup("world", "world")) == "unsupported");
  const Node arm = *Node::open(network.join(), "arm", {{"hand", "world", along_x(1)}});
  CHECK(eventually([&] { return x_of(client->lookup("world", "hand")) == 1; }));
}

TEST_CASE("on demand: an owner that loses requests is not the only one that is asked") {
  LoopbackNetwork network;
  const ScriptedOwner mute(network, "a_base", {{"world", "", {}}},
                           [](Transport&, const PeerId&, const Request& request) {
                             return std::holds_alternative<FramesRequest>(request.body);
                           });
  const Node arm = *Node::open(network.join(), "arm", {{"hand", "world", along_x(1)}});
  Follower client(network);
  CHECK(x_of(client->lookup("world", "hand")) == 1);
}

TEST_CASE("on demand: what needs all frames is refused") {
  Robot robot;
  Follower client(robot.network, {"hand"});
  CHECK(outcome(client->remove("hand")) == "invalid_input");
  CHECK(outcome(client->roots()) == "invalid_input");
  CHECK(outcome(client->children("hand")) == "invalid_input");
  CHECK(outcome(client->stream({"hand"})) == "invalid_input");
  CHECK(outcome(client->stream_joints({"elbow"})) == "invalid_input");
  CHECK(outcome(client->publish_joints({"elbow"}, {0}, {0})) == "invalid_input");
  CHECK(outcome(client->update_joints({"elbow"}, {0}, {0})) == "invalid_input");
  CHECK(robot.base.exists("hand"));
  CHECK(client->partitions()->size() == 2);
  CHECK(client->joints("arm")->empty());
}

TEST_CASE("on demand: invalid entries are refused") {
  // A Node needs all frames, and a Client keeps no partition.
  STATIC_REQUIRE_FALSE(std::is_convertible_v<ClientOptions, NodeOptions>);
  STATIC_REQUIRE_FALSE(std::is_convertible_v<NodeOptions, ClientOptions>);
  LoopbackNetwork network;
  ClientOptions options = testing::quick();
  options.follow = Names{""};
  CHECK(outcome(Client::open(network.join(), options)) == "invalid_input");
  options.follow = Names(kMaxItems + 1, "hand");
  CHECK(outcome(Client::open(network.join(), options)) == "invalid_input");
}

}  // namespace tfdude
