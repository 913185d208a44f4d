// Streams that never wait, over each transport.

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "tfdude/client/client.hpp"
#include "tfdude/client/node.hpp"

#include "partition/messages.hpp"
#include "support/catch.hpp"
#include "support/forest_support.hpp"
#include "support/joint_frames.hpp"
#include "support/networks.hpp"
#include "support/process.hpp"
#include "support/tip_nodes.hpp"

namespace tfdude {
namespace {

using testing::along_x;
using testing::eventually;
using testing::following;
using testing::is_at;
using testing::Join;
using testing::joined_by;
using testing::moved_by;
using testing::open_with_tip;
using testing::outcome;
using testing::revolute_named;
using testing::yaw;
using Clock = std::chrono::steady_clock;

// "1 unreachable gone", one after the other.
std::string text(const std::vector<NotSent>& all) {
  std::string lines;
  for (const NotSent& one : all) {
    if (!lines.empty()) lines += ", ";
    lines += std::to_string(one.index) + " " + std::string(to_string(one.why));
    if (!one.partition.empty()) lines += " " + std::string(one.partition);
  }
  return lines.empty() ? "all sent" : lines;
}

// A stream of edges along x, and the time of each call.
struct Loop {
  EdgeStream stream;
  std::vector<Clock::duration> times;

  std::string send(std::vector<double> x) {
    std::vector<Transform> values;
    for (const double one : x) values.push_back(along_x(one));
    const auto begin = Clock::now();
    const auto& not_sent = stream.try_publish(values);
    times.push_back(Clock::now() - begin);
    return text(not_sent);
  }

  [[nodiscard]] std::ptrdiff_t slower_than(Milliseconds limit) const {
    return std::count_if(times.begin(), times.end(), [&](auto time) { return time > limit; });
  }
};

}  // namespace

TEST_CASE("streams: an edge is followed from owner to owner and no call waits") {
  const Join join = joined_by(GENERATE(from_range(testing::networks())));
  auto client = Client::open(join("")).value();
  Loop loop{client.stream({"gone_tip", "a_tip"}).value(), {}};
  CHECK(loop.send({1, 1}) == "0 unknown_frame, 1 unknown_frame");
  Node a = open_with_tip(join, "a");
  CHECK(eventually([&] { return loop.send({2, 2}) == "0 unknown_frame"; }));
  CHECK(eventually([&] { return is_at(a, "a_base", "a_tip", 2); }));

  std::optional<Node> gone = open_with_tip(join, "gone");
  CHECK(eventually([&] { return loop.send({3, 3}) == "all sent"; }));
  CHECK(eventually([&] { return is_at(*gone, "gone_base", "gone_tip", 3); }));

  gone.reset();
  CHECK(eventually([&] { return loop.send({4, 4}) == "0 unreachable gone"; }));
  CHECK(eventually([&] { return is_at(a, "a_base", "a_tip", 4); }));

  gone = open_with_tip(join, "gone");
  // Also if DDS has discovered only its predecessor, for which DDS waits longer than we do.
  CHECK(eventually([&] {
    return loop.send({5, 5}) == "all sent" && is_at(*gone, "gone_base", "gone_tip", 5);
  }));

  REQUIRE(outcome(client.remove("gone_tip")) == "ok");
  REQUIRE(outcome(client.add("gone_tip", "a_base", along_x(0))) == "ok");
  CHECK(eventually([&] {
    return loop.send({6, 6}) == "all sent" && is_at(a, "a_base", "gone_tip", 6);
  }));
  // A busy computer may delay one or two calls. There were three matches, and waiting for one
  // would take some 30 ms.
  CHECK(loop.slower_than(Milliseconds(20)) < 3);
}

TEST_CASE("streams: all edges of a sample get the stamp of the source") {
  const Join join = joined_by(GENERATE(from_range(testing::networks())));
  Node a = open_with_tip(join, "a");
  Node b = open_with_tip(join, "b");
  REQUIRE(eventually([&] { return b.exists("a_tip"); }));
  // One edge of another owner and one of its own.
  auto stream = b.stream({"a_tip", "b_tip"}).value();
  auto stamp = std::chrono::time_point_cast<Time::duration>(std::chrono::system_clock::now());
  REQUIRE(eventually([&] {
    stamp += Milliseconds(1);
    return stream.try_publish({along_x(7), along_x(8)}, stamp).empty();
  }));
  CHECK(is_at(b, "b_base", "b_tip", 8));
  CHECK(eventually([&] { return is_at(a, "a_base", "a_tip", 7); }));
  const auto history = a.history("a_tip");
  REQUIRE(history);
  REQUIRE(history->size() == 1);
  CHECK(history->front().newest == stamp);
  // The result for its own edge is known at once.
  CHECK(text(stream.try_publish({along_x(7), along_x(8)}, stamp)) == "1 stamp_taken b");
}

TEST_CASE("streams: nothing of a sample is sent if one value is invalid") {
  const Join join = joined_by(GENERATE(from_range(testing::networks())));
  Node a = open_with_tip(join, "a");
  auto client = Client::open(join("")).value();
  auto stream = client.stream({"a_tip", "a_base"}).value();
  REQUIRE(eventually([&] { return stream.try_publish({along_x(1), along_x(1)}).empty(); }));
  REQUIRE(eventually([&] { return is_at(a, "a_base", "a_tip", 1); }));
  const double nan = std::numeric_limits<double>::quiet_NaN();
  CHECK(text(stream.try_publish({along_x(2), along_x(nan)})) == "1 invalid_input");
  CHECK(text(stream.try_publish({along_x(2)})) == "0 invalid_input, 1 invalid_input");
  REQUIRE(stream.try_publish({along_x(3), along_x(3)}).empty());
  CHECK(eventually([&] { return is_at(a, "a_base", "a_tip", 3); }));

  CHECK(outcome(client.stream({"a_tip", "a_tip"})) == "invalid_input");
  CHECK(outcome(client.stream({""})) == "invalid_input");
  CHECK(outcome(client.stream_joints(std::vector<std::string>(kMaxItems + 1, "j"))) ==
        "invalid_input");
  CHECK(client.stream({}).value().try_publish({}).empty());
}

TEST_CASE("streams: joint positions reach all owners and missing ones are named") {
  const Join join = joined_by(GENERATE(from_range(testing::networks())));
  JointSpec elbow = revolute_named("elbow");
  elbow.coupled = true;
  Node arm = Node::open(join("arm"), "arm",
                        {{"world", "", {}},
                         moved_by("upper", "world", revolute_named("shoulder")),
                         moved_by("fore", "upper", elbow)})
                 .value();
  std::optional<Node> tool =
      Node::open(join("tool"), "tool",
                 {moved_by("hand", "fore", following("wrist", "elbow", -1, 0))})
          .value();
  auto client = Client::open(join("")).value();
  auto stream = client.stream_joints({"shoulder", "elbow", "knee"}).value();
  const auto send = [&](double shoulder, double elbow_position) {
    return text(stream.try_publish({shoulder, elbow_position, 0}, {0, 1e-4, 0}));
  };
  // At first it may know of one owner only.
  CHECK(eventually([&] {
    return send(0.1, 0.2) == "2 unknown_joint" &&
           std::abs(yaw(arm.lookup("world", "upper")) - 0.1) < 1e-12 &&
           std::abs(yaw(arm.lookup("upper", "fore")) - 0.2) < 1e-12 &&
           std::abs(yaw(tool->lookup("fore", "hand")) + 0.2) < 1e-12;
  }));
  CHECK(text(stream.try_publish({0, std::nan(""), 0}, {0, 0, -1})) ==
        "1 invalid_input, 2 invalid_input");
  tool.reset();
  REQUIRE(eventually([&] { return send(0.3, 0.4) == "2 unknown_joint, 1 unreachable tool"; }));
  CHECK(eventually([&] { return std::abs(yaw(arm.lookup("upper", "fore")) - 0.4) < 1e-12; }));
  // The owner itself.
  auto own = arm.stream_joints({"shoulder"}).value();
  CHECK(eventually([&] { return text(own.try_publish({0.5}, {0})) == "all sent"; }));
  CHECK(std::abs(yaw(arm.lookup("world", "upper")) - 0.5) < 1e-12);
}

TEST_CASE("streams: a joint of two partitions is not moved until its name says which") {
  const Join join = joined_by(GENERATE(from_range(testing::networks())));
  const auto serve = [&](const std::string& name) {
    return *Node::open(join(name), name,
                       {{name + "_base", "", {}},
                        moved_by(name + "_tip", name + "_base", revolute_named("elbow"))});
  };
  Node left = serve("left");
  std::optional<Node> right = serve("right");
  const auto turned = [](Node& node, double angle) {
    const std::string& name = node.partition();
    return std::abs(yaw(node.lookup(name + "_base", name + "_tip")) - angle) < 1e-12;
  };
  auto client = *Client::open(join(""));
  auto bare = *client.stream_joints({"elbow"});
  auto scoped = *client.stream_joints({"left/elbow", "right/elbow"});
  REQUIRE(eventually([&] { return text(bare.try_publish({0.9}, {0})) == "0 ambiguous_joint"; }));
  REQUIRE(eventually([&] { return scoped.try_publish({0.1, 0.2}, {0, 0}).empty(); }));
  CHECK(eventually([&] { return turned(left, 0.1) && turned(*right, 0.2); }));

  const auto published = client.publish_joints({"elbow"}, {0.9}, {0});
  CHECK(outcome(published) == "ambiguous_joint");
  CHECK(published.error().message.find("say 'left/elbow' or 'right/elbow'") != std::string::npos);
  CHECK(outcome(client.update_joints({"elbow"}, {0.9}, {0})) == "ambiguous_joint");
  CHECK(outcome(left.update_joints({"elbow"}, {0.9}, {0})) == "ambiguous_joint");
  REQUIRE(client.update_joints({"left/elbow", "right/elbow"}, {0.3, 0.4}, {0, 0}));
  CHECK((turned(left, 0.3) && turned(*right, 0.4)));
  REQUIRE(client.publish_joints({"right/elbow"}, {0.5}, {0}));
  CHECK(eventually([&] { return turned(*right, 0.5); }));
  CHECK(turned(left, 0.3));
  // Which robot was meant is not known only because one of them is away.
  right.reset();
  CHECK(outcome(client.update_joints({"elbow"}, {0.9}, {0})) == "ambiguous_joint");
  REQUIRE(client.update_joints({"left/elbow"}, {0.6}, {0}));
  CHECK(turned(left, 0.6));
}

TEST_CASE("streams: a stream that outlives its client sends nothing") {
  const Join join = joined_by(GENERATE(from_range(testing::networks())));
  Node a = open_with_tip(join, "a");
  std::optional<Client> client = Client::open(join("")).value();
  auto stream = client->stream({"a_tip"}).value();
  REQUIRE(eventually([&] { return stream.try_publish({along_x(1)}).empty(); }));
  client.reset();
  CHECK(text(stream.try_publish({along_x(2)})) == "0 transport");
}

}  // namespace tfdude
