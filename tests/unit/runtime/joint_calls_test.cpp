// Positions of joints: sent to their owners, and received.

#include "runtime/joint_calls.hpp"

#include <cmath>
#include <string>
#include <vector>

#include "support/catch.hpp"
#include "support/forest_support.hpp"
#include "support/joint_frames.hpp"
#include "support/replica.hpp"
#include "support/rig.hpp"

namespace tfdude {
namespace {

using namespace std::chrono_literals;
using testing::ContainsSubstring;
using testing::moved_by;
using testing::outcome;
using testing::revolute_named;
using testing::Rig;
using testing::ScriptedOwner;

struct Mover : Rig {
  explicit Mover(LoopbackNetwork& network, const std::string& partition = "")
      : Rig(network.join(), partition), calls(context) {}
  JointCalls calls;
};

std::vector<FrameSpec> arm() {
  return {{"base", "", {}}, moved_by("fore", "base", revolute_named("elbow"))};
}

}  // namespace

TEST_CASE("joints: an update and a sample reach the owner of the joint") {
  LoopbackNetwork network;
  ScriptedOwner owner(network, "arm", arm());
  Mover mover(network);
  REQUIRE(mover.calls.update({{{"elbow", 0.5}}, {}}));
  CHECK(owner.node().joints("arm")->at(0).position == 0.5);
  REQUIRE(mover.calls.publish({{{"elbow", 0.25}}, {}}));
  CHECK(owner.node().joints("arm")->at(0).position == 0.25);
  const auto listed = mover.calls.list("arm");
  REQUIRE(listed);
  REQUIRE(listed->size() == 1);
  CHECK(listed->front().position == 0.25);
}

TEST_CASE("joints: those that are only shown are listed by name, and move no frame") {
  LoopbackNetwork network;
  ScriptedOwner owner(network, "arm", arm());
  Mover mover(network);
  const auto before = owner.node().lookup("base", "fore");
  JointInfo elbow = owner.node().joints("arm")->at(0);
  elbow.position = 0.5;
  JointInfo ankle = elbow;
  ankle.name = "ankle";
  owner.node().show_joints({elbow, ankle});
  const auto shown = mover.calls.list("arm");
  REQUIRE(shown);
  REQUIRE(shown->size() == 2);
  CHECK(shown->at(0).name == "ankle");
  CHECK(shown->at(1).position == 0.5);
  CHECK(owner.node().lookup("base", "fore")->pose.matrix() == before->pose.matrix());
  owner.node().show_joints({});
  CHECK(mover.calls.list("arm")->at(0).position == 0);
}

TEST_CASE("joints: an unknown joint is reported and the others are published") {
  LoopbackNetwork network;
  ScriptedOwner owner(network, "arm", arm());
  Mover mover(network);
  const auto sent = mover.calls.publish({{{"knee", 1}, {"elbow", 0.25}}, {}});
  CHECK(outcome(sent) == "unknown_joint");
  CHECK(owner.node().joints("arm")->at(0).position == 0.25);
  CHECK(outcome(mover.calls.update({{{"knee", 1}, {"elbow", 0.75}}, {}})) == "unknown_joint");
  CHECK(owner.node().joints("arm")->at(0).position == 0.25);
}

TEST_CASE("joints: an unknown joint may be that of an owner that was lost before") {
  LoopbackNetwork network;
  ScriptedOwner owner(network, "arm", arm());
  Mover mover(network);
  Presence presence = testing::presence_of("body", 1, 0);
  presence.absent = {{"leg", 0, Absent::Kind::kLost, 1}};
  mover.on_presence(presence);
  const JointUpdate update{{{"knee", 1}}, {}};
  for (const auto& moved : {mover.calls.publish(update), mover.calls.update(update)}) {
    CHECK(outcome(moved) == "unreachable");
    CHECK_THAT(moved.error().message,
               ContainsSubstring("no joint 'knee'; it may belong to partition 'leg'"));
  }
}

TEST_CASE("joints: an unreachable owner is named and gets nothing") {
  LoopbackNetwork network;
  ScriptedOwner owner(network, "arm", arm());
  Mover mover(network);
  REQUIRE(mover.discovery.await(Deadline(10s)));
  owner.leave();
  const auto sent = mover.calls.publish({{{"elbow", 0.25}}, {}});
  CHECK(outcome(sent) == "unreachable");
  CHECK_THAT(sent.error().message, ContainsSubstring("'arm'"));
  CHECK(outcome(mover.calls.update({{{"elbow", 0.25}}, {}})) == "unreachable");
}

TEST_CASE("joints: a list that is longer than one reply is requested in parts") {
  constexpr std::size_t kAll = kMaxItems + 904;
  LoopbackNetwork network;
  ScriptedOwner owner(
      network, "arm", arm(), [&](Transport& transport, const PeerId& from, const Request& request) {
        const auto* asked = std::get_if<JointsRequest>(&request.body);
        if (asked == nullptr) return false;
        std::vector<JointInfo> part;
        std::size_t next = asked->after.empty() ? 10000 : std::stoul(asked->after) + 1;
        for (; part.size() < kMaxItems && next < 10000 + kAll; ++next) {
          part.emplace_back().name = std::to_string(next);
        }
        transport.reply(from, {request.sequence, 0, part});
        return true;
      });
  Mover mover(network);
  const auto listed = mover.calls.list("arm");
  REQUIRE(outcome(listed) == "ok");
  REQUIRE(listed->size() == kAll);
  CHECK(listed->back().name == std::to_string(10000 + kAll - 1));
}

TEST_CASE("joints: a list that does not advance is not requested without end") {
  LoopbackNetwork network;
  ScriptedOwner owner(network, "arm", arm(),
                      [](Transport& transport, const PeerId& from, const Request& request) {
                        if (!std::holds_alternative<JointsRequest>(request.body)) return false;
                        const std::vector<JointInfo> same(kMaxItems);
                        transport.reply(from, {request.sequence, 0, same});
                        return true;
                      });
  Mover mover(network);
  const auto listed = mover.calls.list("arm");
  CHECK(outcome(listed) == "invalid_input");
  CHECK(owner.asked() <= 2);
}

TEST_CASE("joints: a participant without a partition ignores positions") {
  LoopbackNetwork network;
  Mover mover(network);
  mover.calls.on_joints({{{"elbow", std::nan("")}}, {}});
  CHECK(outcome(mover.calls.publish({{}, {}})) == "ok");
}

}  // namespace tfdude
