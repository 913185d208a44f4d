#include "tree/forest.hpp"

#include <limits>
#include <string>
#include <type_traits>

#include "support/catch.hpp"
#include "support/forest_support.hpp"
#include "support/pose_diff.hpp"

namespace tfdude {
namespace {

using testing::along_x;
using testing::ids_of;
using testing::outcome;
using testing::sorted;
using testing::x_of;
using Ids = std::vector<std::string>;
constexpr auto kAllow = Forest::MissingParent::kAllow;

static_assert(!std::is_copy_constructible_v<Forest> && !std::is_copy_assignable_v<Forest>);

// world +- base +- arm - hand
//       |       +- mast
//       +- dock
void plant(Forest& forest) {
  REQUIRE(forest.add("world", "", along_x(0)));
  REQUIRE(forest.add("base", "world", along_x(1)));
  REQUIRE(forest.add("arm", "base", along_x(10)));
  REQUIRE(forest.add("hand", "arm", along_x(100)));
  REQUIRE(forest.add("mast", "base", along_x(1000)));
  REQUIRE(forest.add("dock", "world", along_x(10000)));
}

// ---- add

using ByHandle = std::vector<HandleUpdate>;

TEST_CASE("a frame is added as a root or under a parent") {
  Forest forest;
  CHECK(outcome(forest.add("world", "", along_x(5))) == "ok");
  CHECK(outcome(forest.add("base", "world", along_x(1))) == "ok");
  CHECK(x_of(forest.value("world")) == 5);
  CHECK(x_of(forest.lookup("world", "base")) == 1);
  CHECK(forest.roots() == Ids{"world"});
}

TEST_CASE("a frame under a missing parent is rejected and leaves no trace") {
  Forest forest;
  CHECK(outcome(forest.add("base", "world", along_x(1))) == "unknown_parent");
  CHECK(forest.frames().empty());
  CHECK(outcome(testing::lookup_segment(forest, "world", "world")) == "unknown_start");
  CHECK(forest.structure_version() == 0);
}

TEST_CASE("a frame that may wait is a root until its parent appears") {
  Forest forest;
  CHECK(outcome(forest.add("hand", "arm", along_x(100), kAllow)) == "ok");
  CHECK(outcome(forest.add("finger", "hand", along_x(1000))) == "ok");
  CHECK(forest.roots() == Ids{"hand"});
  CHECK_FALSE(forest.exists("arm"));
  CHECK(outcome(forest.add("world", "", along_x(0))) == "ok");
  CHECK(outcome(forest.lookup("world", "finger")) == "not_connected");
  CHECK(outcome(forest.add("arm", "world", along_x(10))) == "ok");
  CHECK(x_of(forest.lookup("world", "finger")) == 1110);
  CHECK(forest.roots() == Ids{"world"});
}

TEST_CASE("a parent that others wait for is still missing") {
  Forest forest;
  REQUIRE(forest.add("hand", "arm", along_x(1), kAllow));
  // Being waited for is not being there.
  CHECK(outcome(forest.add("finger", "arm", along_x(1))) == "unknown_parent");
  CHECK(outcome(forest.add("finger", "hand", along_x(1))) == "ok");
}

TEST_CASE("an id that is taken by an own or a remote frame is rejected") {
  Forest forest;
  plant(forest);
  REQUIRE(forest.put_remote("far", "world", 1));
  CHECK(outcome(forest.add("arm", "dock", along_x(7))) == "already_exists");
  CHECK(outcome(forest.add("arm", "arm", along_x(7), kAllow)) == "already_exists");
  CHECK(outcome(forest.add("far", "", along_x(7))) == "already_exists");
  CHECK(x_of(forest.lookup("base", "arm")) == 10);
}

TEST_CASE("invalid ids are rejected by every call that could create a frame") {
  Forest forest;
  plant(forest);
  const std::uint64_t before = forest.structure_version();
  for (const std::string& bad :
       {std::string("line\nbreak"), std::string(256, 'x'), std::string("\xff")}) {
    CAPTURE(bad);
    CHECK(outcome(forest.add(bad, "world", along_x(1))) == "invalid_input");
    CHECK(outcome(forest.add("new", bad, along_x(1), kAllow)) == "invalid_input");
    CHECK(outcome(forest.move("arm", bad)) == "invalid_input");
    CHECK(outcome(forest.put_remote(bad, "world", 1)) == "invalid_input");
    CHECK(outcome(forest.put_remote("new", bad, 1)) == "invalid_input");
  }
  CHECK(outcome(forest.add("", "world", along_x(1))) == "invalid_input");
  CHECK(outcome(forest.put_remote("", "world", 1)) == "invalid_input");
  CHECK(forest.structure_version() == before);
  CHECK(outcome(forest.add(std::string(255, 'x'), "world", along_x(1))) == "ok");
}

TEST_CASE("a frame cannot be its own parent") {
  Forest forest;
  plant(forest);
  CHECK(outcome(forest.add("self", "self", along_x(1))) == "unknown_parent");
  CHECK(outcome(forest.add("self", "self", along_x(1), kAllow)) == "cycle");
  CHECK_FALSE(forest.exists("self"));
  CHECK(outcome(forest.move("arm", "arm")) == "cycle");
  CHECK(x_of(forest.lookup("base", "arm")) == 10);
}

TEST_CASE("a cycle through a missing parent is rejected") {
  Forest forest;
  REQUIRE(forest.add("b", "a", along_x(1), kAllow));
  REQUIRE(forest.add("c", "b", along_x(1)));
  CHECK(outcome(forest.add("a", "b", along_x(1))) == "cycle");
  CHECK(outcome(forest.add("a", "c", along_x(1), kAllow)) == "cycle");
  CHECK_FALSE(forest.exists("a"));
  CHECK(outcome(forest.add("a", "", along_x(1))) == "ok");
  CHECK(x_of(forest.lookup("a", "c")) == 2);
}

// ---- remove

TEST_CASE("remove removes all owned frames below") {
  Forest forest;
  plant(forest);
  const auto removed = forest.remove("base");
  REQUIRE(removed);
  CHECK(sorted(*removed) == Ids{"arm", "base", "hand", "mast"});
  CHECK(removed->front() == "base");
  CHECK(sorted(ids_of(forest.frames())) == Ids{"dock", "world"});
  CHECK(*forest.children("world") == Ids{"dock"});
  CHECK(outcome(forest.remove("base")) == "unknown_frame");
  CHECK(outcome(forest.remove("never")) == "unknown_frame");
  CHECK(outcome(forest.remove("")) == "unknown_frame");
}

TEST_CASE("remote frames below a removed one become roots and keep their children") {
  Forest forest;
  plant(forest);
  REQUIRE(forest.put_remote("far", "arm", 1));
  REQUIRE(forest.add("near", "far", along_x(7)));
  REQUIRE(forest.add("tip", "near", along_x(70)));
  CHECK(sorted(*forest.remove("base")) == Ids{"arm", "base", "hand", "mast"});
  CHECK(forest.roots() == Ids{"far", "world"});
  CHECK(x_of(forest.lookup("far", "tip")) == 77);
  CHECK(forest.info("far")->parent == "arm");
  CHECK_FALSE(forest.info("far")->attached);
  // They are connected again as soon as the parent is back.
  REQUIRE(forest.add("arm", "world", along_x(3)));
  CHECK(forest.info("far")->attached);
  CHECK(forest.roots() == Ids{"world"});
  CHECK(outcome(forest.lookup("world", "tip")) == "not_owner");
}

TEST_CASE("a remote frame is not removed here") {
  Forest forest;
  REQUIRE(forest.put_remote("far", "", 1));
  CHECK(outcome(forest.remove("far")) == "not_owner");
  CHECK(forest.exists("far"));
}

TEST_CASE("a removed id can be added again elsewhere") {
  Forest forest;
  plant(forest);
  REQUIRE(forest.remove("arm"));
  CHECK(outcome(forest.add("arm", "dock", along_x(3))) == "ok");
  CHECK(x_of(forest.lookup("world", "arm")) == 10003);
  CHECK_FALSE(forest.exists("hand"));
}

// ---- update

TEST_CASE("update gives one edge a new value") {
  Forest forest;
  plant(forest);
  CHECK(outcome(forest.update("arm", along_x(20))) == "ok");
  CHECK(x_of(forest.lookup("world", "hand")) == 121);
  CHECK(outcome(forest.update("never", along_x(1))) == "unknown_frame");
  REQUIRE(forest.put_remote("far", "world", 1));
  CHECK(outcome(forest.update("far", along_x(1))) == "not_owner");
  REQUIRE(forest.remove("arm"));
  CHECK(outcome(forest.update("arm", along_x(1))) == "unknown_frame");
}

TEST_CASE("a batch is applied as a whole or not at all") {
  Forest forest;
  plant(forest);
  REQUIRE(forest.put_remote("far", "world", 1));
  CHECK(outcome(forest.update({{"arm", along_x(20)}, {"hand", along_x(200)}})) == "ok");
  CHECK(x_of(forest.lookup("base", "hand")) == 220);
  CHECK(
      outcome(forest.update({{"arm", along_x(30)}, {"never", along_x(1)}, {"far", along_x(1)}})) ==
      "unknown_frame");
  CHECK(outcome(forest.update({{"arm", along_x(30)}, {"far", along_x(1)}})) == "not_owner");
  CHECK(x_of(forest.lookup("base", "hand")) == 220);
  CHECK(outcome(forest.update(std::vector<EdgeUpdate>{})) == "ok");
  // The last of several values for one edge holds.
  CHECK(outcome(forest.update({{"arm", along_x(1)}, {"arm", along_x(2)}})) == "ok");
  CHECK(x_of(forest.value("arm")) == 2);
}

TEST_CASE("a value that is not finite is rejected by frame and field") {
  Forest forest;
  plant(forest);
  const Transform before = *forest.value("arm");
  const double bad =
      GENERATE(std::numeric_limits<double>::quiet_NaN(), -std::numeric_limits<double>::infinity());
  const Transform no_place{
      Pose::trusted(Eigen::Quaterniond::Identity(), Eigen::Vector3d(0, bad, 0)), {}};
  Covariance::Upper upper{};
  upper[20] = bad;
  const Transform no_number{Pose(), Covariance::trusted(upper)};
  const Handle arm = *forest.find("arm");
  for (const Result<void>& refused :
       {forest.update("arm", no_place), forest.update(arm, no_place),
        forest.update({{"hand", along_x(1)}, {"arm", no_place}}),
        forest.update(ByHandle{{*forest.find("hand"), along_x(1)}, {arm, no_place}}),
        forest.move("arm", "dock", no_place)}) {
    REQUIRE(outcome(refused) == "invalid_input");
    CHECK(refused.error().message == "frame 'arm': translation.y is not a finite number");
  }
  const auto added = forest.add("new", "arm", no_number);
  REQUIRE(outcome(added) == "invalid_input");
  CHECK(added.error().message == "frame 'new': covariance[5][5] is not a finite number");
  CHECK_FALSE(forest.exists("new"));
  CHECK(forest.info("arm")->parent != "dock");
  CHECK(testing::transform_diff(*forest.value("arm"), before, 0.0) == "");
}

TEST_CASE("a batch by handles is applied as a whole or not at all") {
  Forest forest;
  plant(forest);
  REQUIRE(forest.put_remote("far", "world", 1));
  const auto handle = [&](const char* id) { return forest.find(id).value(); };
  CHECK(outcome(forest.update(
            ByHandle{{handle("arm"), along_x(20)}, {handle("hand"), along_x(200)}})) == "ok");
  CHECK(x_of(forest.lookup("base", "hand")) == 220);
  CHECK(outcome(forest.update(ByHandle{{handle("arm"), along_x(30)}, {Handle{}, along_x(1)}})) ==
        "unknown_frame");
  CHECK(outcome(forest.update(
            ByHandle{{handle("arm"), along_x(30)}, {handle("far"), along_x(1)}})) == "not_owner");
  CHECK(x_of(forest.lookup("base", "hand")) == 220);
}

TEST_CASE("update by handle reaches the frame that was found") {
  Forest forest;
  plant(forest);
  const Handle arm = forest.find("arm").value();
  CHECK(outcome(forest.update(arm, along_x(20))) == "ok");
  CHECK(x_of(forest.value("arm")) == 20);
  CHECK(outcome(forest.update(Handle{}, along_x(1))) == "unknown_frame");
  CHECK(outcome(forest.update(Handle{1'000'000, arm.generation}, along_x(1))) == "unknown_frame");
  REQUIRE(forest.put_remote("far", "world", 1));
  CHECK(outcome(forest.update(forest.find("far").value(), along_x(1))) == "not_owner");
}

TEST_CASE("a handle outlives moves but not its frame") {
  Forest forest;
  plant(forest);
  // With a frame waiting for it the id stays interned while the frame is away; without one it does
  // not.
  const bool waited_for = GENERATE(false, true);
  CAPTURE(waited_for);
  if (waited_for) REQUIRE(forest.put_remote("far", "mast", 1));
  const Handle world = forest.find("world").value();
  const Handle mast = forest.find("mast").value();
  REQUIRE(forest.move("mast", "dock"));
  CHECK(x_of(forest.lookup(world, mast)) == 11000);
  REQUIRE(forest.remove("mast"));
  CHECK(outcome(forest.lookup(world, mast)) == "unknown_end");
  REQUIRE(forest.add("mast", "base", along_x(5)));
  CHECK(outcome(forest.lookup(mast, world)) == "unknown_start");
  CHECK(outcome(forest.lookup(world, mast)) == "unknown_end");
  CHECK(outcome(forest.update(mast, along_x(9))) == "unknown_frame");
  CHECK(x_of(forest.lookup(world, forest.find("mast").value())) == 6);
}

TEST_CASE("a handle is not valid for another frame in the same place") {
  Forest forest;
  plant(forest);
  const Handle hand = forest.find("hand").value();
  REQUIRE(forest.remove("hand"));
  for (int i = 0; i < 100; ++i) {
    const std::string id = "new " + std::to_string(i);
    REQUIRE(forest.add(id, "arm", along_x(i)));
    CHECK(outcome(forest.lookup(hand, hand)) == "unknown_start");
    CHECK(outcome(forest.update(hand, along_x(0))) == "unknown_frame");
    if (i % 2 == 0) REQUIRE(forest.remove(id));
  }
}

// ---- move

TEST_CASE("move takes the whole subtree and keeps or replaces the value") {
  Forest forest;
  plant(forest);
  CHECK(outcome(forest.move("arm", "dock")) == "ok");
  CHECK(x_of(forest.lookup("world", "hand")) == 10110);
  CHECK(outcome(forest.move("arm", "mast", along_x(20))) == "ok");
  CHECK(x_of(forest.lookup("world", "hand")) == 1121);
  CHECK(*forest.children("dock") == Ids{});
  CHECK(*forest.children("mast") == Ids{"arm"});
  CHECK(outcome(forest.move("arm", "mast", along_x(30))) == "ok");
  CHECK(x_of(forest.lookup("mast", "hand")) == 130);
}

TEST_CASE("move to no parent makes a root") {
  Forest forest;
  plant(forest);
  CHECK(outcome(forest.move("arm", "")) == "ok");
  CHECK(forest.roots() == Ids{"arm", "world"});
  CHECK(forest.info("arm")->parent.empty());
  CHECK(x_of(forest.lookup("arm", "hand")) == 100);
  CHECK(outcome(forest.lookup("world", "hand")) == "not_connected");
  CHECK(outcome(forest.move("world", "hand", along_x(1))) == "ok");
  CHECK(x_of(forest.lookup("arm", "mast")) == 1102);
}

TEST_CASE("move rejects cycles and unknown frames and frames of others") {
  Forest forest;
  plant(forest);
  REQUIRE(forest.put_remote("far", "hand", 1));
  CHECK(outcome(forest.move("base", "hand")) == "cycle");
  CHECK(outcome(forest.move("base", "far", along_x(7))) == "cycle");
  CHECK(outcome(forest.move("never", "base")) == "unknown_frame");
  CHECK(outcome(forest.move("far", "base")) == "not_owner");
  CHECK(outcome(forest.move("base", "never")) == "unknown_parent");
  CHECK(x_of(forest.lookup("world", "hand")) == 111);
}

TEST_CASE("lookups are right after a subtree changed its depth") {
  Forest forest;
  plant(forest);
  std::string parent = "dock";
  for (int i = 0; i < 20; ++i) {
    const std::string id = "deep " + std::to_string(i);
    REQUIRE(forest.add(id, parent, along_x(1)));
    parent = id;
  }
  REQUIRE(forest.move("base", parent));  // deeper by 20
  CHECK(x_of(forest.lookup("world", "hand")) == 10131);
  CHECK(x_of(forest.lookup("hand", "mast")) == 890);
  CHECK(x_of(forest.lookup("deep 3", "hand")) == 127);
  REQUIRE(forest.move("base", "world"));  // and back up
  CHECK(x_of(forest.lookup("hand", "deep 19")) == 10020 - 111);
  REQUIRE(forest.put_remote("far", "hand", 1));  // a remote frame in between is renewed as well
  REQUIRE(forest.add("near", "far", along_x(1)));
  REQUIRE(forest.add("tip", "near", along_x(1)));
  REQUIRE(forest.move("arm", parent));
  CHECK(x_of(forest.lookup("far", "tip")) == 2);
  CHECK(outcome(forest.lookup("tip", "deep 19")) == "not_owner");
  CHECK(forest.segments("tip", "deep 19")->size() == 3);
}

}  // namespace
}  // namespace tfdude
