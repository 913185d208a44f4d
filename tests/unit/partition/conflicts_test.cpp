// Claims and moves of several owners that contradict each other.

#include <set>
#include <string>
#include <vector>

#include "partition/partition.hpp"
#include "support/catch.hpp"
#include "support/forest_support.hpp"
#include "support/memory_store.hpp"
#include "support/replica.hpp"
#include "support/storing_owner.hpp"

namespace tfdude {
namespace {

using testing::along_x;
using testing::MemoryStore;
using testing::page_with;
using testing::presence_of;
using testing::Replica;
using testing::StoringOwner;
using Lines = std::vector<std::string>;

constexpr Time kNow = StoringOwner::kNow;

TEST_CASE("of two partitions that add one id the one with the later claim yields and reports it") {
  StoringOwner arms("arms");
  REQUIRE(arms.ask("camera", AddRequest{"", along_x(1)}) == "ok");
  REQUIRE(arms.ask("lens", AddRequest{"camera", along_x(1)}) == "ok");
  (void)arms.partition.take_pages();
  SECTION("the other claim is older") {
    arms.directory.apply(page_with("head", {{"camera", "", 900}}));
    CHECK(arms.structure() == Lines{"camera <  @ arms", "lens < camera @ arms, attached"});
    CHECK(arms.yield());
    CHECK(arms.structure() == Lines{"camera <  @ head", "lens < camera @ arms, attached"});
    CHECK(arms.conflicts() == Lines{"frame 'camera': claimed by partition 'head', which keeps it, "
                                    "and by 'arms', which yields"});
    const auto pages = arms.partition.take_pages();
    REQUIRE(pages.size() == 1);
    REQUIRE(pages[0].tombstones.size() == 1);
    CHECK(pages[0].tombstones[0].rival == "head");
    CHECK(pages[0].entries.size() == 1);
  }
  SECTION("the other claim is younger") {
    arms.directory.apply(page_with("head", {{"camera", "", 1100}}));
    CHECK_FALSE(arms.yield());
    CHECK(arms.structure() == Lines{"camera <  @ arms", "lens < camera @ arms, attached"});
    CHECK(arms.conflicts().empty());
  }
}

TEST_CASE("a withdrawn claim takes away no frame") {
  StoringOwner arms("arms");
  REQUIRE(arms.ask("camera", AddRequest{"", along_x(1)}) == "ok");
  arms.directory.apply(page_with("head", {{"camera", "", 900}}));
  const std::set<PendingYield> found = arms.partition.pending_yields();
  REQUIRE(found.size() == 1);
  SECTION("withdrawn for good") {
    arms.directory.apply(page_with("head", {}));
    CHECK_FALSE(arms.partition.yield(found, kNow));
  }
  SECTION("withdrawn and made again for a new frame") {
    REQUIRE(arms.ask("camera", RemoveRequest{{"camera"}}) == "ok");
    arms.directory.apply(page_with("head", {}));
    REQUIRE(arms.ask("camera", AddRequest{"", along_x(1)}) == "ok");
    arms.directory.apply(page_with("head", {{"camera", "", 950}}));
    CHECK_FALSE(arms.partition.yield(found, kNow));
  }
  CHECK(arms.forest.holds("camera"));
}

TEST_CASE("a conflict is reported once from the tombstone of the partition that yielded") {
  Replica watcher;
  watcher.directory.changes().watch();
  watcher.directory.apply(presence_of("arms", 1, 1), kNow);
  const Tombstone old{"lamp", 5, Tombstone::Kind::kYielded, "head"};
  const Tombstone fresh{"camera", 7, Tombstone::Kind::kUnhung, "head"};
  watcher.directory.apply(page_with("arms", {}, {old}));
  (void)watcher.directory.changes().take();
  watcher.directory.apply(page_with("arms", {}, {old, fresh}));
  watcher.directory.apply(page_with("arms", {}, {old, fresh}));
  const auto changes = watcher.directory.changes().take();
  REQUIRE(changes.size() == 1);
  CHECK(changes[0].frame == "camera");
  CHECK(changes[0].partition == "arms");
  CHECK(changes[0].rival == "head");
}

TEST_CASE("of two moves that form a cycle the later one is undone and leaves a root") {
  StoringOwner arms("arms");
  arms.directory.apply(page_with("head", {{"neck", "", 10}}));
  REQUIRE(arms.ask("hand", AddRequest{"", along_x(1)}) == "ok");
  REQUIRE(arms.ask("hand", MoveRequest{"neck", {}}, Time(std::chrono::nanoseconds(2000))) == "ok");
  SECTION("the own move") {
    arms.directory.apply(page_with("head", {{"neck", "hand", 1500}}));
    CHECK(arms.yield());
    CHECK(arms.structure() == Lines{"hand <  @ arms", "neck < hand @ head, attached"});
    CHECK(arms.conflicts().size() == 1);
  }
  SECTION("the move of the other partition") {
    arms.directory.apply(page_with("head", {{"neck", "hand", 2500}}));
    CHECK_FALSE(arms.yield());
    CHECK(arms.structure() == Lines{"hand < neck @ arms, attached", "neck <  @ head"});
  }
}

TEST_CASE("a cycle through a frame of an unreachable partition undoes no move") {
  StoringOwner arms("arms");
  arms.directory.apply(presence_of("legs", 1, 1), kNow);
  arms.directory.apply(page_with("head", {{"neck", "", 10}}));
  arms.directory.apply(page_with("legs", {{"leg", "hand", 500}}));
  REQUIRE(arms.ask("hand", AddRequest{"", along_x(1)}) == "ok");
  // Legs have moved their frame elsewhere, which is not known here.
  REQUIRE(arms.ask("hand", MoveRequest{"neck", {}}, Time(std::chrono::nanoseconds(2000))) == "ok");
  arms.directory.apply(page_with("head", {{"neck", "leg", 1500}}));
  REQUIRE(arms.partition.pending_yields().size() == 1);
  REQUIRE(arms.directory.lost("legs", 1, kNow));
  CHECK_FALSE(arms.yield());
  CHECK(arms.conflicts().empty());
  SECTION("the partition has moved its frame away") {
    arms.directory.apply(page_with("legs", {{"leg", "", 600}}));
    CHECK_FALSE(arms.yield());
    CHECK(arms.structure() ==
          Lines{"hand < neck @ arms, attached", "leg <  @ legs", "neck < leg @ head, attached"});
  }
  SECTION("the partition returns unchanged") {
    arms.directory.apply(presence_of("legs", 1, 1), kNow);
    CHECK(arms.yield());
    CHECK(arms.conflicts().size() == 1);
  }
}

TEST_CASE("a cycle that exists only while a page is applied undoes nothing") {
  StoringOwner arms("arms");
  arms.directory.apply(page_with("head", {{"a", "", 10}, {"b", "a", 20}}));
  REQUIRE(arms.ask("hand", AddRequest{"b", along_x(1)}) == "ok");
  arms.directory.apply(page_with("head", {{"a", "hand", 30}, {"b", "", 40}}));
  CHECK_FALSE(arms.yield());
  CHECK(arms.structure() ==
        Lines{"a < hand @ head, attached", "b <  @ head", "hand < b @ arms, attached"});
}

TEST_CASE("yielding may close another cycle whose youngest move is undone") {
  StoringOwner arms("arms");
  arms.directory.apply(page_with("head", {{"a", "", 10}}));
  REQUIRE(arms.ask("camera", AddRequest{"", along_x(1)}) == "ok");
  REQUIRE(arms.ask("hand", AddRequest{"camera", along_x(1)}) == "ok");
  arms.directory.apply(page_with("head", {{"camera", "a", 20}, {"a", "hand", 30}}));
  CHECK(arms.yield());
  CHECK(arms.yield());
  CHECK(arms.structure() ==
        Lines{"a < hand @ head, attached", "camera < a @ head, attached", "hand <  @ arms"});
}

TEST_CASE("a move that forms a cycle with an undone move is undone itself") {
  StoringOwner arms("arms");
  arms.directory.apply(page_with("head", {{"a", "", 10}, {"c", "a", 10}}));
  REQUIRE(arms.ask("hand", AddRequest{"a", along_x(1)}) == "ok");
  arms.directory.apply(page_with("head", {{"a", "hand", 2000}, {"c", "a", 10}}));
  REQUIRE(arms.structure() ==
          Lines{"a <  @ head", "c < a @ head, attached", "hand < a @ arms, attached"});
  REQUIRE(arms.ask("hand", MoveRequest{"c", {}}, Time(std::chrono::nanoseconds(3000))) == "ok");
  CHECK(arms.yield());
  CHECK(arms.structure() ==
        Lines{"a < hand @ head, attached", "c < a @ head, attached", "hand <  @ arms"});
  CHECK(arms.conflicts().size() == 1);
}

TEST_CASE("moving a contested frame makes its claim the later one") {
  StoringOwner arms("arms");
  REQUIRE(arms.ask("camera", AddRequest{"", along_x(1)}) == "ok");
  arms.directory.apply(page_with("head", {{"camera", "", 1100}}));
  REQUIRE_FALSE(arms.yield());
  REQUIRE(arms.ask("camera", MoveRequest{"", {}}) == "ok");
  CHECK(arms.yield());
  CHECK(arms.structure() == Lines{"camera <  @ head"});
  CHECK(arms.conflicts().size() == 1);
}

TEST_CASE("a Lamport time is later than all stored ones") {
  MemoryStore store;
  {
    StoringOwner arms("arms", &store);
    arms.start();
    REQUIRE(arms.ask("hand", AddRequest{"", along_x(1)}, Time(std::chrono::nanoseconds(9000))) ==
            "ok");
  }
  StoringOwner arms("arms", &store);
  arms.start();
  CHECK(arms.directory.next_lamport_time(kNow) > 9000);
}

TEST_CASE("a Lamport time is later than all received ones even if the clock is behind") {
  Replica replica;
  const std::uint64_t first = replica.directory.next_lamport_time(kNow);
  CHECK(first == 1008);  // a multiple of the grid
  CHECK(replica.directory.next_lamport_time(kNow) > first);
  replica.directory.apply(page_with("head", {{"neck", "", 5000}}));
  CHECK(replica.directory.next_lamport_time(kNow) > 5000);
}

}  // namespace
}  // namespace tfdude
