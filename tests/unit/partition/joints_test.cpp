#include "partition/joints.hpp"

#include <cmath>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "partition/partition.hpp"
#include "partition/reconfigure.hpp"
#include "partition/routing.hpp"
#include "support/catch.hpp"
#include "support/forest_support.hpp"
#include "support/joint_frames.hpp"
#include "support/memory_store.hpp"
#include "support/pose_diff.hpp"
#include "support/replica.hpp"

namespace tfdude {
namespace {

using testing::along_x;
using testing::Approx;
using testing::ContainsSubstring;
using testing::following;
using testing::moved_by;
using testing::outcome;
using testing::pose_diff;
using testing::Replica;
using testing::revolute_named;

constexpr Time kNow{std::chrono::seconds(100)};

using Lines = std::vector<std::string>;

Lines described(const StoredState& state, const std::vector<FrameSpec>& configured) {
  Lines lines;
  for (const auto& change : configured_changes(state, configured))
    lines.push_back(describe(change));
  return lines;
}

Time at(int milliseconds) { return kNow + Milliseconds(milliseconds); }

// base - upper - fore - hand, the latter two coupled, beside them a rail.
struct Arm : Replica {
  Arm() : Replica("arm"), partition("arm", 7, forest, directory) {}

  std::vector<FrameSpec> frames() const {
    JointSpec elbow = revolute_named("elbow");
    elbow.coupled = true;
    JointSpec rail = revolute_named("rail");
    rail.type = JointType::kPrismatic;
    rail.joint = prismatic_joint(along_x(0), {0, 1, 0});
    return {{"base", "", {}},
            moved_by("upper", "base", revolute_named("shoulder")),
            moved_by("fore", "upper", elbow),
            moved_by("hand", "fore", following("wrist", "elbow", -0.5, 0.125)),
            moved_by("cart", "base", rail)};
  }
  void load() { REQUIRE(partition.load(frames(), kNow)); }

  Transform edge(const std::string& parent, const std::string& id) const {
    return forest.lookup(parent, id)->transform();
  }
  JointInfo info(const std::string& name) {
    const Reply reply = partition.answer(Request{1, "arm", JointsRequest{}}, kNow);
    for (const JointInfo& one : std::get<std::vector<JointInfo>>(reply.body)) {
      if (one.name == name) return one;
    }
    FAIL("no joint " << name);
    return {};
  }

  Partition partition;
};

TEST_CASE("before its first sample a joint is at rest with the variance of its limits") {
  Arm arm;
  arm.load();
  CHECK(pose_diff(arm.edge("base", "upper").pose, along_x(1).pose, 1e-15) == "");
  CHECK(arm.edge("base", "upper").covariance.of_specified().stddev()[5] == 0.5);
  CHECK_FALSE(arm.info("shoulder").measured);
  CHECK(arm.info("shoulder").frame == "upper");
}

TEST_CASE("positions move the joints' edges as one commit") {
  Arm arm;
  arm.load();
  const auto moved = arm.partition.apply(
      JointUpdate{{{"shoulder", 0.5, 1e-4}, {"rail", -0.25, 4e-6}, {"of_others", 1, 1}}, at(1)});
  REQUIRE(moved);
  CHECK(*moved == 2);
  const Transform upper = arm.edge("base", "upper");
  CHECK(upper.pose.rotation().angularDistance(
            Eigen::Quaterniond(Eigen::AngleAxisd(0.5, Eigen::Vector3d::UnitZ()))) < 1e-15);
  CHECK(upper.covariance.of_specified().stddev()[5] == 0.01);
  CHECK(arm.edge("base", "cart").pose.translation().y() == -0.25);
  CHECK(arm.edge("base", "cart").covariance.of_specified().stddev()[1] == 0.002);
  CHECK(arm.info("shoulder").position == 0.5);
  CHECK(arm.info("shoulder").measured);
  REQUIRE(arm.partition.apply(JointUpdate{{{"shoulder", 0.7, 1e-4}}, at(3)}));
  const auto between = arm.forest.lookup("base", "upper", Query{at(2), {}, {}, {}});
  REQUIRE(between);
  CHECK(std::abs(2 * std::atan2(between->pose.rotation().z(), between->pose.rotation().w()) - 0.6) <
        1e-12);
}

TEST_CASE("a position without a variance leaves the edges that it moves unspecified") {
  Arm arm;
  arm.load();
  REQUIRE(arm.partition.apply(JointUpdate{{{"shoulder", 0.5}, {"elbow", 0.25}}, {}}));
  for (const auto& [parent, id] :
       {std::pair{"base", "upper"}, {"upper", "fore"}, {"fore", "hand"}}) {
    INFO(id);
    CHECK_FALSE(arm.edge(parent, id).covariance.complete());
  }
  CHECK(arm.edge("base", "cart").covariance.complete());
  for (const char* name : {"shoulder", "elbow", "wrist"}) CHECK_FALSE(arm.info(name).variance);
  REQUIRE(arm.partition.apply(JointUpdate{{{"elbow", 0.25, 0.04}}, {}}));
  CHECK(arm.edge("upper", "fore").covariance.complete());
  CHECK(arm.edge("fore", "hand").covariance.complete());
  CHECK(arm.info("wrist").variance == 0.25 * 0.04);
}

TEST_CASE("a mimic joint moves with its source joint and shares its error") {
  Arm arm;
  arm.load();
  REQUIRE(arm.partition.apply(JointUpdate{{{"elbow", 0.5, 0.04}}, {}}));
  CHECK(std::abs(arm.info("wrist").position - (-0.5 * 0.5 + 0.125)) < 1e-15);
  CHECK(std::abs(*arm.info("wrist").variance - 0.25 * 0.04) < 1e-15);
  // About one axis, the error of both is (1 - 0.5) times that of the elbow: not the root of the sum
  // of squares.
  const auto X = arm.forest.lookup("upper", "hand", Query{});
  REQUIRE(X);
  CHECK(std::abs(X->covariance.of_specified().stddev()[5] - 0.5 * 0.2) < 1e-12);
  CHECK(X->basis.sources == std::vector<std::string>{"joint elbow"});
  // A new variance changes the common error together with the value.
  REQUIRE(arm.partition.apply(JointUpdate{{{"elbow", 0.5, 0.01}}, {}}));
  CHECK(std::abs(arm.forest.lookup("upper", "hand")->covariance.of_specified().stddev()[5] -
                 0.5 * 0.1) < 1e-12);
  CHECK(std::abs(arm.forest.lookup("upper", "fore")->covariance.of_specified().stddev()[5] - 0.1) <
        1e-12);
  // And a certain joint shares nothing.
  REQUIRE(arm.partition.apply(JointUpdate{{{"elbow", 0.5, 0}}, {}}));
  CHECK(arm.forest.lookup("upper", "hand", Query{})->basis.sources.empty());
  const auto correlate = [&](const std::string& id) {
    const Reply reply =
        arm.partition.answer(Request{0, id, CorrelateRequest{{true, {}, {}}}}, Time{});
    return std::holds_alternative<Done>(reply.body);
  };
  CHECK_FALSE(correlate("hand"));
  CHECK(correlate("upper"));
}

TEST_CASE("values for a mimic joint are ignored") {
  Arm arm;
  arm.load();
  const auto moved = arm.partition.apply(JointUpdate{{{"wrist", 1, 1}, {"elbow", 0.5, 0.04}}, {}});
  REQUIRE(moved);
  CHECK(*moved == 2);
  CHECK(std::abs(arm.info("wrist").position + 0.125) < 1e-15);
  const Reply alone =
      arm.partition.answer(Request{2, "arm", JointUpdate{{{"wrist", 1, 1}}, {}}}, kNow);
  CHECK_THAT(std::get<Error>(alone.body).message,
             ContainsSubstring("joint 'wrist' moves no frame"));
}

TEST_CASE("a position outside the limits is applied and counted unless the joint is strict") {
  Arm arm;
  auto frames = arm.frames();
  frames[1].joint->strict = true;
  REQUIRE(arm.partition.load(frames, kNow));
  REQUIRE(arm.partition.apply(JointUpdate{{{"elbow", 2.5, 0.04}}, {}}));
  CHECK(arm.info("elbow").position == 2.5);
  CHECK(arm.info("elbow").outside == 1);
  // The wrist's position is -1.125, below its lower limit of -1.
  CHECK(arm.info("wrist").outside == 1);
  const auto refused =
      arm.partition.apply(JointUpdate{{{"elbow", 0, 0}, {"shoulder", 2.01, 0}}, {}});
  CHECK(outcome(refused) == "invalid_input");
  CHECK_THAT(refused.error().message,
             ContainsSubstring("joint 'shoulder': position 2.01 is outside its limits, -1 to 2"));
  CHECK(arm.info("elbow").position == 2.5);
  CHECK(arm.info("shoulder").refused == 1);
  REQUIRE(arm.partition.apply(JointUpdate{{{"shoulder", 2, 0}}, {}}));
}

TEST_CASE("a continuous joint, and one that mimics it, take the shorter way between positions") {
  Arm arm;
  auto frames = arm.frames();
  frames[2].joint->type = JointType::kContinuous;
  frames[2].joint->limits.reset();
  frames[3].joint->mimic->of_continuous = true;
  frames[3].joint->limits.reset();
  REQUIRE(arm.partition.load(frames, kNow));
  REQUIRE(arm.partition.apply(JointUpdate{{{"elbow", 3.1, 0}, {"shoulder", 1.9, 0}}, at(0)}));
  REQUIRE(arm.partition.apply(JointUpdate{{{"elbow", -3.1, 0}, {"shoulder", -0.9, 0}}, at(100)}));
  const double pi = std::acos(-1.0);
  const auto yaw_of = [&](const char* parent, const char* frame, int milliseconds) {
    Query query;
    query.at = at(milliseconds);
    return std::remainder(testing::yaw(arm.forest.lookup(parent, frame, query)), 2 * pi);
  };
  CHECK(std::abs(yaw_of("upper", "fore", 50)) == Approx(pi));
  CHECK(yaw_of("upper", "fore", 75) == Approx(-3.1 - 0.25 * (2 * pi - 6.2)));
  // -0.5 · 3.1 + 0.125, then -0.5 · -3.1 + 0.125.
  CHECK(yaw_of("fore", "hand", 0) == Approx(-1.425));
  CHECK(yaw_of("fore", "hand", 50) == Approx(1.675 + 0.25 * (2 * pi - 6.2)));
  CHECK(yaw_of("fore", "hand", 100) == Approx(1.675));
  // A revolute one does not.
  CHECK(yaw_of("base", "upper", 50) == Approx(0.5));
}

TEST_CASE("invalid positions are rejected by name and change nothing") {
  Arm arm;
  arm.load();
  const double nan = std::nan("");
  for (const JointValue& bad :
       {JointValue{"elbow", nan, 0}, JointValue{"elbow", INFINITY, 0}, JointValue{"elbow", 2e9, 0},
        JointValue{"elbow", 0, nan}, JointValue{"elbow", 0, -1}, JointValue{"elbow", 0, 2e18}}) {
    const auto refused = arm.partition.apply(JointUpdate{{{"shoulder", 1, 0}, bad}, {}});
    CHECK(outcome(refused) == "invalid_input");
    CHECK_THAT(refused.error().message, ContainsSubstring("joint 'elbow'"));
  }
  CHECK(arm.info("shoulder").position == 0);
  CHECK(pose_diff(arm.edge("base", "upper").pose, along_x(1).pose, 1e-15) == "");
}

TEST_CASE("a position that gives a mimic joint an invalid position is rejected") {
  Arm arm;
  auto frames = arm.frames();
  frames[3].joint->mimic->multiplier = 4;
  REQUIRE(arm.partition.load(frames, kNow));
  const auto refused = arm.partition.apply(JointUpdate{{{"elbow", 9e8, 0}}, {}});
  CHECK(outcome(refused) == "invalid_input");
  CHECK_THAT(refused.error().message, ContainsSubstring("joint 'wrist': position"));
  CHECK(arm.info("elbow").position == 0);
}

TEST_CASE("a joint that is named twice in one update is rejected") {
  Arm arm;
  arm.load();
  const JointUpdate twice{{{"elbow", 0.1, 0}, {"shoulder", 0.1, 0}, {"elbow", 0.2, 0}}, at(1)};
  CHECK_THAT(arm.partition.apply(twice).error().message,
             ContainsSubstring("joint 'elbow' is named twice"));
  REQUIRE(arm.partition.apply(JointUpdate{{{"elbow", 0.2, 0}}, at(1)}));
}

TEST_CASE("invalid descriptions of joints are rejected by frame and joint") {
  const auto refused = [](auto change) {
    Arm arm;
    auto frames = arm.frames();
    change(*frames[3].joint);
    const auto loaded = arm.partition.load(frames, kNow);
    REQUIRE_FALSE(loaded);
    CHECK_THAT(loaded.error().message, ContainsSubstring("frame 'hand'"));
    return loaded.error().message;
  };
  CHECK_THAT(refused([](JointSpec& joint) { joint.name.clear(); }), ContainsSubstring("joint"));
  CHECK_THAT(refused([](JointSpec& joint) { joint.joint.S *= 2; }), ContainsSubstring("twist"));
  CHECK_THAT(refused([](JointSpec& joint) { joint.coupled = false; }),
             ContainsSubstring("coupled"));
  CHECK_THAT(refused([](JointSpec& joint) {
               joint.limits = JointLimits{1, 0};
             }),
             ContainsSubstring("lower limit is above its upper limit"));
  CHECK_THAT(refused([](JointSpec& joint) { joint.variance = -1; }), ContainsSubstring("variance"));
  CHECK_THAT(refused([](JointSpec& joint) { joint.mimic->joint.assign(250, 'x'); }),
             ContainsSubstring("too long"));
}

TEST_CASE("a late sample is added to the history and does not change the newest position") {
  Arm arm;
  arm.load();
  REQUIRE(arm.partition.apply(JointUpdate{{{"elbow", 0.5, 0.04}}, at(1)}));
  REQUIRE(arm.partition.apply(JointUpdate{{{"elbow", 0.9, 0.01}}, at(5)}));
  REQUIRE(arm.partition.apply(JointUpdate{{{"elbow", 0.7, 0.09}}, at(3)}));
  CHECK(arm.info("elbow").position == 0.9);
  CHECK(std::abs(arm.forest.lookup("upper", "fore")->covariance.of_specified().stddev()[5] - 0.1) <
        1e-12);
  CHECK(outcome(arm.partition.apply(JointUpdate{{{"elbow", 0.8, 0.01}}, at(3)})) == "stamp_taken");
}

TEST_CASE("after a history was cleared, an earlier sample is the newest, with its variance") {
  Arm arm;
  arm.load();
  REQUIRE(arm.partition.apply(JointUpdate{{{"elbow", 0.5, 0.04}}, at(5000)}));
  REQUIRE(arm.forest.clear_histories(Time::min()) == 2);
  REQUIRE(arm.partition.apply(JointUpdate{{{"elbow", 0.25, 0.01}}, at(1)}));
  CHECK(arm.info("elbow").position == 0.25);
  CHECK(std::abs(arm.edge("upper", "fore").covariance.of_specified().stddev()[5] - 0.1) < 1e-12);
  CHECK(std::abs(arm.edge("upper", "hand").covariance.of_specified().stddev()[5] - 0.5 * 0.1) <
        1e-12);
}

TEST_CASE("a frame that is removed or moved by request leaves its joint") {
  Arm arm;
  arm.load();
  SECTION("removed") {
    REQUIRE(std::holds_alternative<Done>(
        arm.partition.answer(Request{1, "hand", RemoveRequest{{"hand"}}}, kNow).body));
    // A new frame of the same name has no joint.
    REQUIRE(std::holds_alternative<Done>(
        arm.partition.answer(Request{2, "hand", AddRequest{"fore", along_x(3)}}, kNow).body));
  }
  SECTION("moved") {
    REQUIRE(std::holds_alternative<Done>(
        arm.partition.answer(Request{1, "hand", MoveRequest{"base", along_x(3)}}, kNow).body));
  }
  const auto moved = arm.partition.apply(JointUpdate{{{"elbow", 0.5, 0.04}}, {}});
  REQUIRE(moved);
  CHECK(*moved == 1);
  CHECK(pose_diff(arm.forest.lookup(arm.forest.info("hand")->parent, "hand")->pose, along_x(3).pose,
                  1e-15) == "");
}

TEST_CASE("a partition restores the positions of its joints") {
  testing::MemoryStore store;
  {
    Arm arm;
    REQUIRE(arm.partition.restore(*store.load(), arm.frames(), kNow));
    REQUIRE(store.save(testing::unsaved(arm.partition, true)));
    REQUIRE(
        arm.partition.apply(JointUpdate{{{"shoulder", 0.5, 1e-4}, {"elbow", 0.75, 0.04}}, at(0)}));
    REQUIRE(store.save(testing::unsaved(arm.partition, true)));
    CHECK(arm.partition.take_unsaved(true).joints.empty());
  }
  Arm arm;
  SECTION("with the same description") {
    REQUIRE(arm.partition.restore(*store.load(), arm.frames(), kNow));
    CHECK(arm.info("shoulder").position == 0.5);
    CHECK(arm.info("shoulder").measured);
    CHECK_FALSE(arm.info("rail").measured);
    CHECK(std::abs(arm.edge("base", "upper").covariance.of_specified().stddev()[5] - 0.01) < 1e-12);
    CHECK(std::abs(arm.info("wrist").position + 0.25) < 1e-15);
    CHECK(std::abs(arm.edge("upper", "hand").covariance.of_specified().stddev()[5] - 0.1) < 1e-12);
    // Later samples are applied.
    CHECK(*arm.partition.apply(JointUpdate{{{"elbow", 0.25, 0.01}}, {}}) == 2);
  }
  SECTION("with a changed description") {
    auto frames = arm.frames();
    // Another origin, which shows at rest. An opposite axis and another multiplier, which show only
    // away from rest.
    JointSpec longer = *frames[1].joint;
    longer.joint = revolute_joint(along_x(2), {0, 0, 1});
    frames[1] = moved_by("upper", "base", longer);
    JointSpec reversed = *frames[2].joint;
    reversed.joint = revolute_joint(along_x(1), {0, 0, -1});
    frames[2] = moved_by("fore", "upper", reversed);
    frames[3].joint->mimic = Mimic{"elbow", 2, 0.125};
    REQUIRE(arm.partition.restore(*store.load(), frames, kNow));
    CHECK(arm.info("shoulder").position == 0.5);
    CHECK(pose_diff(arm.edge("base", "upper").pose, joint_transform(longer.joint, 0.5, 0).pose,
                    1e-15) == "");
    CHECK(pose_diff(arm.edge("upper", "fore").pose, joint_transform(reversed.joint, 0.75, 0).pose,
                    1e-15) == "");
    CHECK(arm.info("wrist").position == 2 * 0.75 + 0.125);
    CHECK(std::abs(arm.edge("upper", "hand").covariance.of_specified().stddev()[5] - 0.2) < 1e-12);
  }
  SECTION("with narrower limits: the position is kept and counted") {
    auto frames = arm.frames();
    frames[1].joint->limits = JointLimits{-0.25, 0.25};
    REQUIRE(arm.partition.restore(*store.load(), frames, kNow));
    CHECK(arm.info("shoulder").position == 0.5);
    CHECK(arm.info("shoulder").outside == 1);
    CHECK(arm.info("elbow").outside == 0);
  }
  SECTION("with another type of joint: the position is dropped") {
    auto frames = arm.frames();
    const FrameSpec before = frames[2];
    frames[2].joint->type = JointType::kPrismatic;
    frames[2].joint->joint = prismatic_joint(along_x(1), {0, 0, 1});
    // With the same variance at rest, or another one.
    frames[2].joint->variance = GENERATE(0.25, 0.09);
    const auto changes = configured_changes(*store.load(), frames);
    REQUIRE(changes.size() >= 2);
    CHECK(
        describe(changes[0]) ==
        "frame 'fore': starts at its initial position; the stored one is dropped: joint 'elbow' is "
        "prismatic, and was revolute");
    REQUIRE(arm.partition.restore(*store.load(), frames, kNow));
    CHECK(arm.info("elbow").position == 0);
    CHECK_FALSE(arm.info("elbow").measured);
    CHECK(arm.info("wrist").position == frames[3].joint->position);
    CHECK_FALSE(arm.info("wrist").measured);
    CHECK(pose_diff(arm.edge("upper", "fore").pose, along_x(1).pose, 1e-15) == "");
    CHECK(arm.info("shoulder").position == 0.5);
    // Its first sample is stored with the new type.
    REQUIRE(arm.partition.apply(JointUpdate{{{"elbow", 0.125, 1e-4}}, {}}));
    REQUIRE(store.save(testing::unsaved(arm.partition, true)));
    Arm next;
    REQUIRE(next.partition.restore(*store.load(), frames, kNow));
    CHECK(next.info("elbow").position == 0.125);
    CHECK(next.info("elbow").measured);
  }
  SECTION("with a link that became fixed: it is as its entry says") {
    auto frames = arm.frames();
    frames[1].joint.reset();
    CHECK(described(*store.load(), frames) ==
          Lines{"frame 'upper': changed to its new entry, under 'base'"});
    REQUIRE(arm.partition.restore(*store.load(), frames, kNow));
    CHECK(pose_diff(arm.edge("base", "upper").pose, along_x(1).pose, 1e-15) == "");
    CHECK_FALSE(arm.forest.kept("upper")->time.stamp);
    REQUIRE(store.save(testing::unsaved(arm.partition, true)));
    CHECK(described(*store.load(), frames).empty());
    // And back: the joint is a new one.
    CHECK(described(*store.load(), arm.frames()) ==
          Lines{"frame 'upper': changed to its new entry, under 'base'"});
  }
  SECTION("with a renamed joint: it is a new one") {
    auto frames = arm.frames();
    frames[1].joint->name = "lift";
    CHECK(described(*store.load(), frames) ==
          Lines{"frame 'upper': changed to its new entry, under 'base'"});
    REQUIRE(arm.partition.restore(*store.load(), frames, kNow));
    CHECK(pose_diff(arm.edge("base", "upper").pose, along_x(1).pose, 1e-15) == "");
    CHECK_FALSE(arm.forest.kept("upper")->time.stamp);
    CHECK(arm.info("lift").position == 0);
    CHECK_FALSE(arm.info("lift").measured);
  }
  SECTION("with a state that does not say which joints there were: the position is kept") {
    auto state = *store.load();
    for (auto& [id, joint] : state.configured_joints) joint = {};
    auto frames = arm.frames();
    frames[1].joint.reset();
    CHECK(described(state, frames).empty());
    REQUIRE(arm.partition.restore(state, frames, kNow));
    CHECK(testing::yaw(arm.forest.lookup("base", "upper")) == Approx(0.5));
  }
  SECTION("with a revolute joint that lost its limits: the position is kept") {
    auto frames = arm.frames();
    frames[1].joint->type = JointType::kContinuous;
    frames[1].joint->limits.reset();
    REQUIRE(arm.partition.restore(*store.load(), frames, kNow));
    CHECK(arm.info("shoulder").position == 0.5);
    CHECK(arm.info("shoulder").measured);
  }
}

// What a process of "arm" with this configuration does, stored.
template <class Act>
void live(testing::MemoryStore& store, const std::vector<FrameSpec>& configured, Act act) {
  Arm arm;
  REQUIRE(arm.partition.restore(*store.load(), configured, kNow));
  REQUIRE(store.save(testing::unsaved(arm.partition, true)));
  act(arm);
  REQUIRE(store.save(testing::unsaved(arm.partition, true)));
}

Lines stored_joints(testing::MemoryStore& store) {
  Lines names;
  const StoredState state = *store.load();
  for (const StoredJoint& joint : state.joints) names.push_back(joint.name);
  return names;
}

void move_elbow(Arm& arm, double position, int milliseconds) {
  const JointUpdate update{{{"elbow", position, 0.04}}, at(milliseconds)};
  REQUIRE(arm.partition.apply(update));
}

TEST_CASE("a mimic joint is where it was left, whatever became of the joint that it follows") {
  testing::MemoryStore store;
  const std::vector<FrameSpec> frames = Arm().frames();
  live(store, frames, [](Arm& arm) { move_elbow(arm, 0.75, 0); });
  CHECK(stored_joints(store) == Lines{"elbow", "wrist"});
  // Another partition has that link from now on, or it only was given to another one.
  std::vector<FrameSpec> later = frames;
  SECTION("it was left out of the configuration") {
    later.erase(later.begin() + 2);
    live(store, later, [](Arm& arm) { move_elbow(arm, 1.25, 1); });
  }
  SECTION("it was released") {
    live(store, later, [](Arm& arm) {
      REQUIRE(arm.partition.release({"fore"}, kNow));
      move_elbow(arm, 1.25, 1);
    });
  }
  SECTION("it was moved") {
    live(store, later, [](Arm& arm) {
      const Reply reply =
          arm.partition.answer(Request{1, "fore", MoveRequest{"base", along_x(1)}}, kNow);
      REQUIRE(std::holds_alternative<Done>(reply.body));
      move_elbow(arm, 1.25, 1);
    });
  }
  CHECK(stored_joints(store) == Lines{"wrist"});
  live(store, later, [](Arm& arm) {
    CHECK(arm.info("wrist").position == -0.5 * 1.25 + 0.125);
    CHECK(arm.info("wrist").measured);
    CHECK(arm.forest.kept("hand")->time.stamp == at(1));
  });
}

TEST_CASE("a joint whose frame returns as a new entry is at rest") {
  testing::MemoryStore store;
  const std::vector<FrameSpec> frames = Arm().frames();
  live(store, frames, [](Arm& arm) { move_elbow(arm, 0.75, 0); });
  live(store, {frames[0], frames[1]}, [](Arm&) {});
  CHECK(stored_joints(store).empty());
  live(store, frames, [](Arm& arm) {
    CHECK(arm.info("elbow").position == 0);
    CHECK_FALSE(arm.info("elbow").measured);
  });
}

TEST_CASE("without a configuration the positions of joints stay stored") {
  testing::MemoryStore store;
  const std::vector<FrameSpec> frames = Arm().frames();
  live(store, frames, [](Arm& arm) { move_elbow(arm, 0.75, 0); });
  live(store, {}, [](Arm&) {});
  live(store, frames, [](Arm& arm) { CHECK(arm.info("elbow").position == 0.75); });
}

TEST_CASE("a joint that mimics another one than before is at rest until a sample of that comes") {
  testing::MemoryStore store;
  const std::vector<FrameSpec> frames = Arm().frames();
  live(store, frames, [](Arm& arm) { move_elbow(arm, 0.75, 0); });
  std::vector<FrameSpec> later = frames;
  later[2].joint->name = "bend";
  later[3].joint->mimic->joint = "bend";
  CHECK(described(*store.load(), later) ==
        Lines{"frame 'fore': changed to its new entry, under 'upper'",
              "frame 'hand': starts at its initial position; the stored one is dropped: joint "
              "'wrist' mimics 'bend', and mimicked 'elbow'"});
  for (int life = 0; life < 2; ++life) {
    INFO("life " << life);
    live(store, later, [&](Arm& arm) {
      CHECK(stored_joints(store).empty());
      for (const char* name : {"bend", "wrist"}) CHECK_FALSE(arm.info(name).measured);
      CHECK(arm.info("wrist").position == later[3].joint->position);
      CHECK(pose_diff(arm.edge("fore", "hand").pose, value_of(later[3]).pose, 1e-15) == "");
      CHECK_FALSE(arm.forest.kept("hand")->time.stamp);
    });
  }
  CHECK(described(*store.load(), later).empty());
}

TEST_CASE("a position is sent to the owners of the joint and of its mimic joints") {
  Replica caller;
  const auto page = [](const std::string& name, std::vector<PageEntry> entries,
                       std::vector<PageJoint> joints) {
    return Page{name, 0, 1, 1, std::move(entries), {}, {}, std::move(joints)};
  };
  caller.directory.apply(Presence{"arm", 1, "host", 1, 1, true}, kNow);
  caller.directory.apply(Presence{"tool", 1, "host", 2, 1, true}, kNow);
  caller.directory.apply(page("arm", {{"upper", ""}}, {{"shoulder", ""}, {"elbow", ""}}));
  caller.directory.apply(page("tool", {{"finger", ""}}, {{"grip", "elbow"}}));
  const auto routed = [&](std::vector<JointValue> joints) {
    return route_joints(caller.directory, {std::move(joints), kNow});
  };
  const auto parts = routed({{"shoulder", 1, 0}, {"elbow", 2, 0}});
  REQUIRE(parts);
  REQUIRE(parts->size() == 2);
  CHECK(std::get<JointUpdate>((*parts)[0].request.body).joints.size() == 2);
  CHECK((*parts)[1].partition == "tool");
  CHECK(std::get<JointUpdate>((*parts)[1].request.body).joints[0].name == "elbow");
  CHECK(*std::get<JointUpdate>((*parts)[1].request.body).stamp == kNow);
  CHECK(outcome(routed({{"knee", 1, 0}})) == "unknown_joint");
  CHECK(outcome(routed({{"elbow", std::nan(""), 0}})) == "invalid_input");
  // A page that no longer has a joint takes it away; a new life replaces the old.
  caller.directory.apply(Page{"tool", 0, 1, 2, {{"finger", ""}}, {}, {}, {}});
  CHECK(routed({{"elbow", 2, 0}})->size() == 1);
  caller.directory.apply(Page{"arm", 0, 2, 3, {{"upper", ""}}, {}, {}, {{"elbow", ""}}});
  caller.directory.apply(Presence{"arm", 2, "host", 3, 1, true}, kNow);
  CHECK(outcome(routed({{"shoulder", 1, 0}})) == "unknown_joint");
  CHECK(routed({{"elbow", 2, 0}})->size() == 1);
}

TEST_CASE("an owner's pages list the joints that move its frames") {
  Arm arm;
  arm.load();
  const auto joints = [&] {
    std::set<std::pair<std::string, std::string>> all;
    for (const Page& page : arm.partition.take_pages()) {
      for (const PageJoint& joint : page.joints) all.emplace(joint.name, joint.follows);
    }
    return all;
  };
  using Listed = std::set<std::pair<std::string, std::string>>;
  CHECK(joints() == Listed{{"rail", ""}, {"elbow", ""}, {"wrist", "elbow"}, {"shoulder", ""}});
  (void)arm.partition.answer(Request{1, "hand", MoveRequest{"base", {}}}, kNow);
  CHECK(joints() == Listed{{"rail", ""}, {"elbow", ""}, {"shoulder", ""}});
  CHECK(outcome(arm.directory.route_joint("wrist")) == "unknown_joint");
  CHECK(arm.directory.route_joint("elbow").value().owners.size() == 1);
}

}  // namespace
}  // namespace tfdude
