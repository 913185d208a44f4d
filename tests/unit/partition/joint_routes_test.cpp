// Joints of equal names in several partitions.

#include <chrono>
#include <string>
#include <utility>
#include <vector>

#include "partition/partition.hpp"
#include "partition/routing.hpp"
#include "support/catch.hpp"
#include "support/forest_support.hpp"
#include "support/joint_frames.hpp"
#include "support/replica.hpp"

namespace tfdude {
namespace {

using testing::moved_by;
using testing::outcome;
using testing::presence_of;
using testing::Replica;
using testing::revolute_named;
using Lines = std::vector<std::string>;
using Joints = std::vector<PageJoint>;

constexpr Time kNow{std::chrono::seconds(100)};

struct Caller : Replica {
  explicit Caller(const std::string& own = {}) : Replica(own) {}

  /// A partition has a frame, and these joints.
  void meet(const std::string& partition, const Joints& joints, std::uint64_t epoch = 1) {
    directory.apply(presence_of(partition, 1, 1), kNow);
    directory.apply(Page{partition, 0, 1, epoch, {{"frame of " + partition, ""}}, {}, {}, joints});
  }
  /// "PARTITION gets JOINT" for each message, or the error.
  Lines routes(const std::string& joint) const {
    const auto parts = route_joints(directory, {{{joint, 0.5, {}}}, kNow});
    if (!parts) return {parts.error().message};
    Lines lines;
    for (const Part& part : *parts) {
      for (const JointValue& value : std::get<JointUpdate>(part.request.body).joints) {
        lines.push_back(part.partition + " gets " + value.name);
      }
    }
    return lines;
  }
  Lines conflicts() {
    Lines lines;
    for (const Change& one : directory.changes().take()) {
      if (one.kind != ChangeKind::kJointConflict) continue;
      lines.push_back(one.joint + ": " + one.partition + ", " + one.rival);
    }
    return lines;
  }
};

const std::string kSay =
    "partitions 'left' and 'right' have a joint 'elbow': say 'left/elbow' or 'right/elbow'";

}  // namespace

TEST_CASE("joint routes: a joint of two partitions is rejected until its name says which") {
  Caller caller;
  caller.meet("right", {{"elbow", ""}, {"lift", ""}});
  CHECK(caller.routes("elbow") == Lines{"right gets elbow"});
  caller.meet("left", {{"elbow", ""}});
  CHECK(caller.routes("elbow") == Lines{kSay});
  CHECK(outcome(route_joints(caller.directory, {{{"elbow", 0.5, {}}}, kNow})) == "ambiguous_joint");
  CHECK(caller.routes("left/elbow") == Lines{"left gets elbow"});
  CHECK(caller.routes("right/elbow") == Lines{"right gets elbow"});
  // Always possible.
  CHECK(caller.routes("right/lift") == Lines{"right gets lift"});
  CHECK(caller.routes("left/lift") == Lines{"no joint 'left/lift'"});
  CHECK(caller.routes("nobody/elbow") == Lines{"no joint 'nobody/elbow'"});
  caller.meet("left", {}, 2);
  CHECK(caller.routes("elbow") == Lines{"right gets elbow"});
}

TEST_CASE("joint routes: a joint that mimics one of another partition is no conflict") {
  Caller caller;
  caller.meet("arm", {{"grip", ""}});
  caller.meet("hand", {{"finger", "grip"}});
  CHECK(caller.routes("grip") == Lines{"arm gets grip", "hand gets grip"});
  CHECK(caller.routes("arm/grip") == Lines{"arm gets grip", "hand gets grip"});
  // Which of two it mimics cannot be known.
  caller.meet("leg", {{"grip", ""}});
  const Lines rename{
      "partitions 'arm' and 'leg' have a joint 'grip', and a joint of 'hand' mimics one of them: "
      "give them different names"};
  for (const char* name : {"grip", "arm/grip", "leg/grip"}) CHECK(caller.routes(name) == rename);
  // One that moves with its own.
  caller.meet("hand", {}, 2);
  caller.meet("leg", {{"grip", ""}, {"toe", "grip"}}, 2);
  CHECK(caller.routes("leg/grip") == Lines{"leg gets grip"});
  CHECK(caller.routes("arm/grip") == Lines{"arm gets grip"});
}

TEST_CASE("joint routes: a joint's own name may have slashes and comes first") {
  Caller caller;
  caller.meet("a", {{"b/c", ""}});
  CHECK(caller.routes("b/c") == Lines{"a gets b/c"});
  CHECK(caller.routes("a/b/c") == Lines{"a gets b/c"});
  caller.meet("b", {{"c", ""}});
  CHECK(caller.routes("b/c") == Lines{"a gets b/c"});
  caller.meet("x/y", {{"z", ""}});
  CHECK(caller.routes("x/y/z") == Lines{"x/y gets z"});
}

TEST_CASE("joint routes: a partition that has lost all its frames moves nothing") {
  Caller caller;
  caller.meet("left", {{"elbow", ""}});
  caller.meet("right", {{"elbow", ""}});
  REQUIRE(caller.directory.lost("left", 1, kNow));
  // The owner may return at any moment.
  CHECK(caller.routes("elbow") == Lines{kSay});
  REQUIRE(caller.directory.forget("left", 1, kNow));
  CHECK(caller.routes("elbow") == Lines{"right gets elbow"});
}

TEST_CASE(
    "joint routes: who has taken over all frames of a lost partition moves its joints alone") {
  const bool mimics = GENERATE(false, true);
  CAPTURE(mimics);
  Caller caller;
  caller.meet("arm", {{"elbow", ""}});
  if (mimics) caller.meet("hand", {{"finger", "elbow"}});
  const std::string lost = mimics ? "hand" : "arm";
  REQUIRE(caller.directory.lost(lost, 1, kNow));
  caller.directory.apply(presence_of("new", 1, 1), kNow);
  const Joints joints{mimics ? PageJoint{"finger", "elbow"} : PageJoint{"elbow", ""}};
  caller.directory.apply(Page{"new", 0, 1, 1, {{"frame of " + lost, ""}}, {}, {}, joints});
  const Lines expected =
      mimics ? Lines{"arm gets elbow", "new gets elbow"} : Lines{"new gets elbow"};
  CHECK(caller.routes("elbow") != expected);
  const auto begin = std::chrono::steady_clock::time_point() + std::chrono::hours(1);
  for (auto t = begin; t < begin + 2 * Absences::kTakeover; t += Absences::kGrace / 4) {
    (void)caller.directory.look_for_gone(t);
  }
  CHECK(caller.routes("elbow") == expected);
  CHECK(caller.routes(mimics ? "arm/elbow" : "new/elbow") == expected);
}

TEST_CASE("joint routes: a conflict is told once to those who listen") {
  Caller caller;
  caller.directory.changes().watch();
  caller.meet("right", {{"elbow", ""}});
  caller.meet("left", {{"elbow", ""}, {"lift", ""}});
  CHECK(caller.conflicts() == Lines{"elbow: left, right"});
  caller.meet("left", {{"elbow", ""}, {"lift", ""}}, 2);
  CHECK(caller.conflicts().empty());
  caller.meet("middle", {{"elbow", ""}});
  CHECK(caller.conflicts().size() == 1);
  caller.meet("middle", {}, 2);
  caller.meet("left", {}, 3);
  caller.meet("left", {{"elbow", ""}}, 4);
  CHECK(caller.conflicts() == Lines{"elbow: left, right"});
  Caller other;
  other.meet("right", {{"elbow", ""}});
  other.meet("left", {{"elbow", ""}});
  CHECK(other.conflicts().empty());
}

TEST_CASE("joint routes: an owner is always told of a conflict") {
  Caller own("left");
  own.meet("right", {{"elbow", ""}});
  Partition left("left", 7, own.forest, own.directory);
  REQUIRE(left.load({{"base", "", {}}, moved_by("fore", "base", revolute_named("elbow"))}, kNow));
  CHECK(own.conflicts() == Lines{"elbow: left, right"});
  CHECK(own.routes("elbow") == Lines{kSay});
  CHECK(own.routes("left/elbow") == Lines{"left gets elbow"});
}

}  // namespace tfdude
