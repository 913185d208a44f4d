#include <cstdint>
#include <string>
#include <utility>

#include "support/catch.hpp"
#include "support/forest_support.hpp"
#include "support/pose_diff.hpp"
#include "support/random.hpp"
#include "tree/forest.hpp"

namespace tfdude {
namespace {

using testing::along_x;
using testing::describe;
using testing::ids_of;
using testing::outcome;
using testing::pose_diff;
using testing::Random;
using testing::sorted;
using testing::transform_diff;
using testing::x_of;
using Ids = std::vector<std::string>;
constexpr auto kAllow = Forest::MissingParent::kAllow;

// "from > to @owner" of each run, in order.
Ids runs(const Forest& forest, std::string_view a, std::string_view b) {
  const auto segments = forest.segments(a, b);
  if (!segments) return {outcome(segments)};
  Ids texts;
  for (const Segment& run : *segments) {
    texts.push_back(run.from + " > " + run.to + " @" + std::to_string(run.owner));
  }
  return texts;
}

// ---- lookup

TEST_CASE("a lookup goes up, down, across and to itself") {
  Random random(101);
  INFO("seed " << random.seed());
  const Transform X_WA = random.transform();
  const Transform X_AB = random.transform();
  const Transform X_WC = random.transform();
  Forest forest;
  REQUIRE(forest.add("w", "", random.transform()));  // a root's own value is in no lookup
  REQUIRE(forest.add("a", "w", X_WA));
  REQUIRE(forest.add("b", "a", X_AB));
  REQUIRE(forest.add("c", "w", X_WC));
  const Transform X_WB = compose(X_WA, X_AB);
  CHECK(transform_diff(*forest.lookup("a", "b"), X_AB, 1e-13) == "");
  CHECK(transform_diff(*forest.lookup("w", "b"), X_WB, 1e-13) == "");
  CHECK(transform_diff(*forest.lookup("b", "w"), inverse(X_WB), 1e-13) == "");
  CHECK(transform_diff(*forest.lookup("c", "b"), between(X_WC, X_WB), 1e-13) == "");
  CHECK(transform_diff(*forest.lookup("b", "c"), between(X_WB, X_WC), 1e-13) == "");
  for (const char* id : {"w", "a", "b", "c"}) {
    CHECK(transform_diff(*forest.lookup(id, id), Transform::exact({}), 0.0) == "");
  }
  const auto handle = [&](const char* id) { return forest.find(id).value(); };
  CHECK(transform_diff(*forest.lookup(handle("c"), handle("b")), *forest.lookup("c", "b"), 0.0) ==
        "");
}

TEST_CASE("a lookup of the pose alone gives the pose of the lookup") {
  Random random(102);
  INFO("seed " << random.seed());
  Forest forest;
  REQUIRE(forest.add("w", "", Transform::exact({})));
  REQUIRE(forest.add("a", "w", random.transform()));
  REQUIRE(forest.add("b", "w", random.transform()));
  REQUIRE(forest.put_remote("r", "w", 1));
  const Pose X_AB = forest.lookup("a", "b")->pose;
  CHECK(pose_diff(*forest.lookup_pose("a", "b"), X_AB, 0.0) == "");
  CHECK(pose_diff(*forest.lookup_pose(*forest.find("a"), *forest.find("b")), X_AB, 0.0) == "");
  CHECK(outcome(forest.lookup_pose("x", "b")) == "unknown_start");
  CHECK(outcome(forest.lookup_pose("a", "x")) == "unknown_end");
  CHECK(outcome(forest.lookup_pose("a", "r")) == "not_owner");
}

TEST_CASE("unknown start, unknown end and no common root are three errors") {
  Forest forest;
  REQUIRE(forest.add("a", "", along_x(1)));
  REQUIRE(forest.add("b", "", along_x(1)));
  REQUIRE(forest.add("c", "missing", along_x(1), kAllow));
  REQUIRE(forest.add("d", "missing", along_x(1), kAllow));
  for (const std::string absent : {"never", "missing", ""}) {
    CAPTURE(absent);
    CHECK(outcome(forest.lookup(absent, "b")) == "unknown_start");
    CHECK(outcome(forest.lookup(absent, absent)) == "unknown_start");
    CHECK(outcome(forest.lookup("a", absent)) == "unknown_end");
    CHECK(outcome(forest.segments(absent, "b")) == "unknown_start");
    CHECK(outcome(forest.segments("a", absent)) == "unknown_end");
  }
  CHECK(outcome(forest.lookup("a", "b")) == "not_connected");
  CHECK(outcome(forest.segments("a", "b")) == "not_connected");
  // A missing parent connects no frames, although both name it.
  CHECK(outcome(forest.lookup("c", "d")) == "not_connected");
  CHECK(outcome(forest.segments("c", "d")) == "not_connected");
  REQUIRE(forest.add("missing", "a", along_x(1)));
  CHECK(x_of(forest.lookup("c", "d")) == 0);
  CHECK(x_of(forest.lookup("a", "d")) == 2);
  REQUIRE(forest.move("missing", "", along_x(1)));
  CHECK(outcome(forest.lookup("a", "d")) == "not_connected");
}

TEST_CASE("errors name the frame they are about") {
  Forest forest;
  REQUIRE(forest.add("a", "", along_x(1)));
  REQUIRE(forest.add("b", "", along_x(1)));
  CHECK(forest.lookup("ghost", "a").error().message.find("'ghost'") != std::string::npos);
  CHECK(forest.lookup("a", "ghost").error().message.find("'ghost'") != std::string::npos);
  CHECK(forest.lookup("a", "b").error().message.find("'b'") != std::string::npos);
  CHECK(forest.update("ghost", along_x(1)).error().message.find("'ghost'") != std::string::npos);
  CHECK(forest.add("c", "ghost", along_x(1)).error().message.find("'ghost'") != std::string::npos);
}

// ---- frames of others

TEST_CASE("a lookup over an edge of another partition is rejected") {
  Forest forest;
  REQUIRE(forest.add("w", "", along_x(0)));
  REQUIRE(forest.put_remote("far", "w", 2));
  REQUIRE(forest.add("a", "far", along_x(1)));
  REQUIRE(forest.add("b", "far", along_x(10)));
  CHECK(x_of(forest.lookup("a", "b")) == 9);  // does not pass the remote edge
  CHECK(x_of(forest.lookup("far", "b")) == 10);
  CHECK(x_of(forest.lookup("far", "far")) == 0);
  CHECK(outcome(forest.lookup("w", "b")) == "not_owner");
  CHECK(outcome(forest.lookup("a", "w")) == "not_owner");
  CHECK(outcome(forest.value("far")) == "not_owner");
}

TEST_CASE("frames without a common root are not connected whoever owns the edges") {
  Forest forest;
  REQUIRE(forest.put_remote("r", "", 1));
  REQUIRE(forest.put_remote("s", "r", 1));
  REQUIRE(forest.add("a", "s", along_x(1)));
  REQUIRE(forest.add("b", "", along_x(1)));
  REQUIRE(forest.add("c", "b", along_x(1)));
  CHECK(outcome(forest.lookup("a", "c")) == "not_connected");
  CHECK(outcome(forest.lookup("c", "a")) == "not_connected");
  CHECK(outcome(forest.lookup("r", "a")) == "not_owner");
}

TEST_CASE("remote frames appear and change their owner and parent and disappear") {
  Forest forest;
  REQUIRE(forest.add("w", "", along_x(0)));
  CHECK(outcome(forest.put_remote("far", "w", 1)) == "ok");
  CHECK(describe(*forest.info("far")) == "far < w, owner 1, attached");
  CHECK_FALSE(forest.holds("far"));
  const Handle far = forest.find("far").value();
  CHECK(outcome(forest.put_remote("far", "elsewhere", 2)) == "ok");
  CHECK(describe(*forest.info("far")) == "far < elsewhere, owner 2");
  CHECK(outcome(forest.lookup(far, far)) == "ok");  // still the same frame
  forest.drop_remote("far", 1);                     // not its owner any more
  CHECK(forest.exists("far"));
  forest.drop_remote("far", 2);
  CHECK_FALSE(forest.exists("far"));
  CHECK(outcome(forest.lookup(far, far)) == "unknown_start");
  forest.drop_remote("far", 2);
  forest.drop_remote("never", 2);
  forest.drop_remote("w", 1);
  forest.drop_remote("w", kHeldHere);
  CHECK(ids_of(forest.frames()) == Ids{"w"});
  CHECK(outcome(forest.add("far", "w", along_x(3))) == "ok");
  CHECK(forest.holds("far"));
}

TEST_CASE("an own frame cannot become remote and a remote frame needs an owner") {
  Forest forest;
  REQUIRE(forest.add("w", "", along_x(4)));
  CHECK(outcome(forest.put_remote("w", "", 1)) == "already_exists");
  CHECK(outcome(forest.put_remote("far", "w", kHeldHere)) == "invalid_input");
  CHECK_FALSE(forest.exists("far"));
  CHECK(x_of(forest.value("w")) == 4);
}

TEST_CASE("a remote frame that would close a cycle is kept as a root") {
  Forest forest;
  REQUIRE(forest.put_remote("b", "a", 1));
  REQUIRE(forest.add("c", "b", along_x(1)));
  CHECK(outcome(forest.put_remote("a", "c", 2)) == "cycle");
  CHECK(describe(*forest.info("a")) == "a < , owner 2");
  CHECK(forest.info("b")->attached);
  CHECK(outcome(forest.put_remote("self", "self", 2)) == "cycle");
  CHECK(describe(*forest.info("self")) == "self < , owner 2");
  CHECK(outcome(forest.put_remote("d", "a", 3)) == "ok");
  CHECK(outcome(forest.put_remote("a", "d", 2)) == "cycle");
  CHECK(*forest.children("a") == Ids{"b", "d"});
}

// ---- segments

TEST_CASE("segments are the runs of edges of one owner along the path") {
  Forest forest;
  REQUIRE(forest.add("w", "", along_x(0)));
  REQUIRE(forest.add("a", "w", along_x(1)));
  REQUIRE(forest.put_remote("b", "a", 1));
  REQUIRE(forest.put_remote("c", "b", 1));
  REQUIRE(forest.add("d", "c", along_x(1)));
  REQUIRE(forest.put_remote("e", "w", 2));
  REQUIRE(forest.put_remote("f", "e", 1));
  REQUIRE(forest.put_remote("g", "a", 2));
  CHECK(runs(forest, "w", "w") == Ids{});
  CHECK(runs(forest, "w", "a") == Ids{"w > a @0"});
  CHECK(runs(forest, "a", "c") == Ids{"a > c @1"});
  CHECK(runs(forest, "d", "f") == Ids{"d > c @0", "c > a @1", "a > w @0", "w > e @2", "e > f @1"});
  CHECK(runs(forest, "f", "d") == Ids{"f > e @1", "e > w @2", "w > a @0", "a > c @1", "c > d @0"});
  CHECK(runs(forest, "c", "g") == Ids{"c > a @1", "a > g @2"});
  // One owner on both sides of the common ancestor is one run.
  REQUIRE(forest.put_remote("g", "a", 1));
  CHECK(runs(forest, "c", "g") == Ids{"c > g @1"});
  CHECK(runs(forest, "d", "g") == Ids{"d > c @0", "c > g @1"});
}

TEST_CASE("a segment may end at a missing parent of own frames") {
  Forest forest;
  REQUIRE(forest.add("a", "missing", along_x(1), kAllow));
  REQUIRE(forest.add("b", "a", along_x(10)));
  REQUIRE(forest.add("c", "missing", along_x(100), kAllow));
  REQUIRE(forest.add("d", "other", along_x(1000), kAllow));
  REQUIRE(forest.add("r", "", along_x(7)));
  CHECK(x_of(testing::lookup_segment(forest, "missing", "b")) == 11);
  CHECK(x_of(testing::lookup_segment(forest, "b", "missing")) == -11);
  CHECK(x_of(testing::lookup_segment(forest, "b", "c")) == 89);
  CHECK(x_of(testing::lookup_segment(forest, "a", "b")) == 10);
  CHECK(x_of(testing::lookup_segment(forest, "missing", "missing")) == 0);
  CHECK(outcome(testing::lookup_segment(forest, "missing", "d")) == "not_connected");
  CHECK(outcome(testing::lookup_segment(forest, "missing", "other")) == "not_connected");
  CHECK(outcome(testing::lookup_segment(forest, "r", "a")) == "not_connected");
  CHECK(outcome(testing::lookup_segment(forest, "a", "r")) == "not_connected");
  CHECK(outcome(testing::lookup_segment(forest, "never", "a")) == "unknown_start");
  CHECK(outcome(testing::lookup_segment(forest, "a", "never")) == "unknown_end");
  REQUIRE(forest.put_remote("far", "missing", 1));
  CHECK(outcome(testing::lookup_segment(forest, "missing", "far")) == "not_owner");
  // No frame names it any more, so it is forgotten.
  REQUIRE(forest.remove("d"));
  CHECK(outcome(testing::lookup_segment(forest, "a", "other")) == "unknown_end");
}

// ---- the structure

TEST_CASE("frames and roots and children and subtree describe the structure") {
  Forest forest;
  CHECK(forest.frames().empty());
  CHECK(forest.roots().empty());
  REQUIRE(forest.add("w", "", along_x(0)));
  REQUIRE(forest.put_remote("z", "w", 3));
  REQUIRE(forest.add("y", "w", along_x(1)));
  REQUIRE(forest.add("x", "z", along_x(1)));
  REQUIRE(forest.add("q", "missing", along_x(1), kAllow));
  CHECK(sorted(ids_of(forest.frames())) == Ids{"q", "w", "x", "y", "z"});
  CHECK(forest.roots() == Ids{"q", "w"});
  CHECK(*forest.children("w") == Ids{"y", "z"});
  CHECK(*forest.children("x") == Ids{});
  CHECK(outcome(forest.children("missing")) == "unknown_frame");
  CHECK(outcome(forest.children("never")) == "unknown_frame");
  const auto below = forest.subtree("w");
  CHECK(sorted(ids_of(below)) == Ids{"w", "x", "y", "z"});
  CHECK(below.front().id == "w");
  CHECK(below.back().id == "x");  // parents first, so after z
  CHECK(ids_of(forest.subtree("q")) == Ids{"q"});
  CHECK(forest.subtree("missing").empty());
  CHECK(forest.subtree("never").empty());
}

TEST_CASE("info and value and holds and find and exists describe one frame") {
  Forest forest;
  REQUIRE(forest.add("w", "", along_x(5)));
  REQUIRE(forest.add("q", "missing", along_x(6), kAllow));
  REQUIRE(forest.put_remote("far", "w", 3));
  CHECK(describe(*forest.info("w")) == "w < , owner 0");
  CHECK(describe(*forest.info("q")) == "q < missing, owner 0");
  CHECK(describe(*forest.info("far")) == "far < w, owner 3, attached");
  CHECK(x_of(forest.value("q")) == 6);
  CHECK(forest.holds("q"));
  CHECK_FALSE(forest.holds("far"));
  CHECK(forest.exists("far"));
  for (const std::string absent : {"missing", "never", ""}) {
    CAPTURE(absent);
    CHECK_FALSE(forest.info(absent));
    CHECK_FALSE(forest.find(absent));
    CHECK_FALSE(forest.exists(absent));
    CHECK_FALSE(forest.holds(absent));
    CHECK(outcome(forest.value(absent)) == "unknown_frame");
  }
}

TEST_CASE("the structure version grows only with the structure") {
  Forest forest;
  std::uint64_t last = forest.structure_version();
  const auto grew = [&] {
    const std::uint64_t before = std::exchange(last, forest.structure_version());
    return last > before;
  };
  REQUIRE(forest.add("w", "", along_x(0)));
  CHECK(grew());
  REQUIRE(forest.add("a", "w", along_x(0)));
  CHECK(grew());
  REQUIRE(forest.put_remote("far", "w", 1));
  CHECK(grew());
  REQUIRE(forest.put_remote("far", "w", 1));
  CHECK_FALSE(grew());
  REQUIRE(forest.put_remote("far", "w", 2));
  CHECK(grew());
  forest.drop_remote("far", 1);
  CHECK_FALSE(grew());
  REQUIRE(forest.update("a", along_x(1)));
  REQUIRE(forest.update(forest.find("a").value(), along_x(1)));
  REQUIRE(forest.update({{"a", along_x(1)}, {"w", along_x(1)}}));
  CHECK_FALSE(forest.add("a", "w", along_x(0)));
  CHECK_FALSE(forest.move("w", "a"));
  CHECK_FALSE(forest.remove("never"));
  CHECK_FALSE(grew());
  REQUIRE(forest.move("a", "far"));
  CHECK(grew());
  forest.drop_remote("far", 2);
  CHECK(grew());
  REQUIRE(forest.remove("a"));
  CHECK(grew());
}

TEST_CASE("thousands of frames are all found") {
  // Past the first segment of slots and several sizes of the table of ids.
  constexpr int kFrames = 5000;
  Forest forest;
  REQUIRE(forest.add("w", "", along_x(0)));
  for (int i = 0; i < kFrames; ++i) REQUIRE(forest.add(std::to_string(i), "w", along_x(i)));
  CHECK(forest.frames().size() == kFrames + 1);
  for (int i = 0; i < kFrames; i += 2) REQUIRE(forest.remove(std::to_string(i)));
  int wrong = 0;
  for (int i = 0; i < kFrames; ++i) {
    const auto X = forest.lookup("w", std::to_string(i));
    wrong += i % 2 == 0 ? outcome(X) != "unknown_end" : x_of(X) != i;
  }
  CHECK(wrong == 0);
  CHECK(forest.children("w")->size() == kFrames / 2);
}

}  // namespace
}  // namespace tfdude
