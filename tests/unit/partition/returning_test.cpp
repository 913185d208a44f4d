// Owners that return with their stored state, and what changed while they were away.

#include <string>
#include <variant>
#include <vector>

#include "partition/partition.hpp"
#include "partition/routing.hpp"
#include "support/catch.hpp"
#include "support/forest_support.hpp"
#include "support/memory_store.hpp"
#include "support/replica.hpp"
#include "support/storing_owner.hpp"

namespace tfdude {
namespace {

using testing::along_x;
using testing::MemoryStore;
using testing::outcome;
using testing::page_with;
using testing::presence_of;
using testing::Replica;
using testing::StoringOwner;
using testing::x_of;
using Lines = std::vector<std::string>;

constexpr Time kNow = StoringOwner::kNow;

// A former process of "arms" that ended after a root was added.
void add_in_former_process(MemoryStore& store, const std::string& id) {
  StoringOwner arms("arms", &store);
  arms.start();
  REQUIRE(arms.ask(id, AddRequest{"", along_x(1)}) == "ok");
}

TEST_CASE("a partition restores what it stored") {
  MemoryStore store;
  {
    StoringOwner arms("arms", &store);
    arms.start({{"arm", "", along_x(1)}, {"hand", "arm", along_x(10)}});
    REQUIRE(arms.ask("tool", AddRequest{"hand", along_x(100)}) == "ok");
    REQUIRE(arms.ask("lamp", AddRequest{"arm", along_x(5)}) == "ok");
    REQUIRE(arms.ask("hand", UpdateRequest{{{"hand", along_x(20)}}}) == "ok");
    REQUIRE(arms.ask("lamp", RemoveRequest{{"lamp"}}) == "ok");
  }
  StoringOwner arms("arms", &store);
  SECTION("with the same configuration") {
    arms.start({{"arm", "", along_x(1)}, {"hand", "arm", along_x(10)}});
    CHECK(arms.structure() ==
          Lines{"arm <  @ arms", "hand < arm @ arms, attached", "tool < hand @ arms, attached"});
    CHECK(x_of(arms.forest.lookup("arm", "tool")) == 120);
  }
  SECTION("with an edited entry") {
    arms.start({{"arm", "", along_x(1)}, {"hand", "", along_x(30)}, {"eye", "arm", along_x(2)}});
    CHECK(arms.structure() == Lines{"arm <  @ arms", "eye < arm @ arms, attached", "hand <  @ arms",
                                    "tool < hand @ arms, attached"});
    CHECK(x_of(arms.forest.value("hand")) == 30);
  }
  SECTION("with an invalid configuration") {
    const auto state = store.load();
    CHECK(outcome(arms.partition.restore(*state, {{"a", "b", {}}, {"b", "a", {}}}, kNow)) ==
          "cycle");
  }
}

TEST_CASE("a frame whose parent was removed while its owner was away is removed on return") {
  MemoryStore store;
  {
    StoringOwner tools("tools", &store);
    tools.directory.apply(page_with("arms", {{"flange", "", 10}}));
    tools.start();
    REQUIRE(tools.ask("gripper", AddRequest{"flange", along_x(1)}) == "ok");
    REQUIRE(tools.ask("finger", AddRequest{"gripper", along_x(1)}) == "ok");
  }
  const Page removed = page_with("arms", {}, {{"flange", 2000, Tombstone::Kind::kRemoved, {}}});
  StoringOwner tools("tools", &store);
  SECTION("the removal is received before the return") {
    tools.directory.apply(removed);
    tools.start();
    CHECK(tools.structure().empty());
  }
  SECTION("the removal is received after the return") {
    tools.start();
    CHECK(tools.structure().size() == 2);
    tools.directory.apply(removed);
    CHECK(tools.yield());
    CHECK(tools.structure().empty());
  }
  SECTION("not if the parent exists again") {
    tools.directory.apply(page_with("arms", {{"flange", "", 3000}}));
    tools.start();
    CHECK(tools.structure().size() == 3);
  }
  SECTION("not if it was attached after the removal") {
    tools.directory.apply(page_with("arms", {}, {{"flange", 900, Tombstone::Kind::kRemoved, {}}}));
    tools.start();
    CHECK(tools.structure().size() == 2);
  }
  SECTION("not what was attached below it after the removal") {
    tools.start();
    const auto finger = tools.forest.info("finger");
    REQUIRE(finger);
    REQUIRE(tools.ask("nail", AddRequest{"finger", along_x(1)}) == "ok");
    REQUIRE(tools.ask("ring", AddRequest{"finger", along_x(1)}) == "ok");
    REQUIRE(tools.ask("stone", AddRequest{"ring", along_x(1)}) == "ok");
    tools.directory.apply(page_with(
        "arms", {}, {{"flange", finger->lamport_time + 1, Tombstone::Kind::kRemoved, {}}}));
    CHECK(tools.yield());
    CHECK(tools.structure() == Lines{"nail < finger @ tools", "ring < finger @ tools",
                                     "stone < ring @ tools, attached"});
    CHECK_FALSE(tools.yield());
  }
}

TEST_CASE("a removal has a later Lamport time than all that its client knew") {
  const Time ahead = kNow + std::chrono::seconds(3);
  MemoryStore store;
  Replica client;
  client.directory.apply(presence_of("arms", 1, 1), kNow);
  StoringOwner arms("arms");
  REQUIRE(arms.ask("flange", AddRequest{"", along_x(1)}) == "ok");
  client.apply(arms.partition.take_pages());
  {
    StoringOwner tools("tools", &store);
    tools.directory.apply(page_with("arms", {{"flange", "", 10}}));
    tools.start();
    REQUIRE(tools.ask("gripper", AddRequest{"flange", along_x(1)}, ahead) == "ok");
    client.apply(tools.partition.take_pages());
  }
  REQUIRE(client.directory.lost("tools", 1, kNow));
  // The owner of the flange has not heard of the gripper yet.
  const auto parts = route_remove(client.forest, client.directory, "flange");
  REQUIRE(parts);
  REQUIRE(parts->size() == 1);
  const Reply removed = arms.partition.answer(parts->front().request, kNow);
  REQUIRE(std::holds_alternative<Done>(removed.body));
  StoringOwner tools("tools", &store);
  tools.apply(arms.partition.take_pages());
  tools.start();
  CHECK(tools.structure().empty());
}

// Loses a partition for so long that others take its frames over.
void bury(Directory& directory, const std::string& partition) {
  REQUIRE(directory.lost(partition, 1, kNow));
  (void)directory.look_for_gone({});
  (void)directory.look_for_gone(Absences::Steady{} + Absences::kGrace / 2);
  REQUIRE(directory.look_for_gone(Absences::Steady{} + Absences::kGrace));
  REQUIRE(directory.look_for_gone(Absences::Steady{} + Absences::kTakeover));
}

TEST_CASE("a returning partition yields to a reachable one but not to a lost one") {
  MemoryStore store;
  add_in_former_process(store, "camera");
  StoringOwner arms("arms", &store);
  SECTION("the other claim is older") {
    arms.directory.apply(page_with("head", {{"camera", "", 900}}));
    arms.start();
    CHECK(arms.structure() == Lines{"camera <  @ head"});
    CHECK(arms.conflicts().size() == 1);
    CHECK(store.load()->frames.empty());
  }
  SECTION("the other claim is younger") {
    arms.directory.apply(page_with("head", {{"camera", "", 1100}}));
    arms.start();
    CHECK(arms.structure() == Lines{"camera <  @ head"});
    CHECK(arms.conflicts().size() == 1);
  }
  SECTION("also if its entry has been edited meanwhile") {
    arms.directory.apply(page_with("head", {{"camera", "", 900}}));
    arms.start({{"camera", "", along_x(7)}, {"lamp", "", along_x(1)}});
    CHECK(arms.structure() == Lines{"camera <  @ head", "lamp <  @ arms"});
    CHECK(arms.conflicts().size() == 1);
  }
  SECTION("the other partition is lost") {
    arms.directory.apply(page_with("head", {{"camera", "", 900}}));
    bury(arms.directory, "head");
    arms.start();
    CHECK(arms.structure() == Lines{"camera <  @ arms"});
    CHECK(arms.conflicts().empty());
  }
}

TEST_CASE("a configured frame is taken over from a lost partition") {
  StoringOwner arms("arms");
  arms.directory.apply(page_with("head", {{"camera", "", 900}, {"lens", "camera", 900}}));
  SECTION("not while that is reachable") {
    CHECK_FALSE(arms.partition.load({{"lamp", "", along_x(1)}, {"camera", "", along_x(1)}}, kNow));
    CHECK(arms.structure() == Lines{"camera <  @ head", "lens < camera @ head, attached"});
  }
  SECTION("after it is lost") {
    bury(arms.directory, "head");
    REQUIRE(arms.partition.load({{"camera", "", along_x(1)}}, kNow));
    CHECK(arms.structure() == Lines{"camera <  @ arms", "lens < camera @ head, attached"});
  }
}

TEST_CASE("of a cycle that was made while a frame was away the youngest move is undone") {
  MemoryStore store;
  {
    StoringOwner arms("arms", &store);
    arms.directory.apply(page_with("head", {{"neck", "", 10}}));
    arms.start();
    REQUIRE(arms.ask("hand", AddRequest{"neck", along_x(1)}) == "ok");
  }
  StoringOwner arms("arms", &store);
  SECTION("the move of the other partition") {
    arms.directory.apply(page_with("head", {{"neck", "hand", 2000}}));
    arms.start();
    CHECK(arms.structure() == Lines{"hand < neck @ arms, attached", "neck <  @ head"});
    CHECK(arms.conflicts().empty());
  }
  SECTION("the own move") {
    arms.directory.apply(page_with("head", {{"neck", "hand", 500}}));
    arms.start();
    CHECK(arms.structure() == Lines{"hand <  @ arms", "neck < hand @ head, attached"});
    CHECK(arms.conflicts().size() == 1);
  }
}

TEST_CASE("frames of others return to their parents when a returning frame breaks their cycle") {
  MemoryStore store;
  add_in_former_process(store, "hand");
  StoringOwner arms("arms", &store);
  arms.directory.apply(page_with("head", {{"hand", "neck", 1100}, {"neck", "hand", 1200}}));
  REQUIRE(arms.structure() == Lines{"hand < neck @ head, attached", "neck <  @ head"});
  bury(arms.directory, "head");
  arms.start();
  CHECK(arms.structure() == Lines{"hand <  @ arms", "neck < hand @ head, attached"});
}

}  // namespace
}  // namespace tfdude
