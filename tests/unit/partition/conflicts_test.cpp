#include <string>
#include <vector>

#include "partition/partition.hpp"
#include "partition/routing.hpp"
#include "support/catch.hpp"
#include "support/forest_support.hpp"
#include "support/memory_store.hpp"
#include "support/replica.hpp"

namespace tfdude {
namespace {

using testing::along_x;
using testing::MemoryStore;
using testing::outcome;
using testing::presence_of;
using testing::Replica;
using testing::x_of;
using Lines = std::vector<std::string>;

constexpr Time kNow{std::chrono::nanoseconds(1000)};

// A process that serves a partition, and what it stored.
struct Owning : Replica {
  explicit Owning(const std::string& name, MemoryStore* kept = nullptr)
      : Replica(name), partition(name, 1, forest, directory), store(kept) {}

  template <class Body>
  std::string ask(const std::string& id, Body body, Time now = kNow) {
    const Reply reply = partition.answer(Request{0, id, std::move(body)}, now);
    if (store != nullptr) REQUIRE(store->save(partition.take_unsaved()));
    const auto* error = std::get_if<Error>(&reply.body);
    return error == nullptr ? "ok" : error->message;
  }
  void start(const std::vector<FrameSpec>& configured = {}) {
    REQUIRE(partition.restore(*store->load(), configured, kNow));
    REQUIRE(store->save(partition.take_unsaved()));
    REQUIRE(store->save_configured(configured));
  }
  bool yield() { return partition.yield(partition.pending_yields(), kNow); }
  std::vector<std::string> conflicts() {
    std::vector<std::string> messages;
    for (const Change& one : directory.changes().take()) {
      if (one.kind == ChangeKind::kConflict) messages.push_back(one.message);
    }
    return messages;
  }

  Partition partition;
  MemoryStore* store;
};

Page page_of(const std::string& partition, std::vector<PageEntry> entries,
             std::vector<Tombstone> tombstones = {}) {
  return {partition, 0, 1, 1, std::move(entries), std::move(tombstones)};
}

// A life of "arms" that ended after a root was added.
void add_in_former_life(MemoryStore& store, const std::string& id) {
  Owning arms("arms", &store);
  arms.start();
  REQUIRE(arms.ask(id, AddRequest{"", along_x(1)}) == "ok");
}

TEST_CASE("of two partitions that add one id the one with the later claim yields and reports it") {
  Owning arms("arms");
  REQUIRE(arms.ask("camera", AddRequest{"", along_x(1)}) == "ok");
  REQUIRE(arms.ask("lens", AddRequest{"camera", along_x(1)}) == "ok");
  (void)arms.partition.take_pages();
  SECTION("the other claim is older") {
    arms.directory.apply(page_of("head", {{"camera", "", 900}}));
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
    arms.directory.apply(page_of("head", {{"camera", "", 1100}}));
    CHECK_FALSE(arms.yield());
    CHECK(arms.structure() == Lines{"camera <  @ arms", "lens < camera @ arms, attached"});
    CHECK(arms.conflicts().empty());
  }
}

TEST_CASE("a withdrawn claim takes away no frame") {
  Owning arms("arms");
  REQUIRE(arms.ask("camera", AddRequest{"", along_x(1)}) == "ok");
  arms.directory.apply(page_of("head", {{"camera", "", 900}}));
  const std::set<PendingYield> found = arms.partition.pending_yields();
  REQUIRE(found.size() == 1);
  SECTION("withdrawn for good") {
    arms.directory.apply(page_of("head", {}));
    CHECK_FALSE(arms.partition.yield(found, kNow));
  }
  SECTION("withdrawn and made again for a new frame") {
    REQUIRE(arms.ask("camera", RemoveRequest{{"camera"}}) == "ok");
    arms.directory.apply(page_of("head", {}));
    REQUIRE(arms.ask("camera", AddRequest{"", along_x(1)}) == "ok");
    arms.directory.apply(page_of("head", {{"camera", "", 950}}));
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
  watcher.directory.apply(page_of("arms", {}, {old}));
  (void)watcher.directory.changes().take();
  watcher.directory.apply(page_of("arms", {}, {old, fresh}));
  watcher.directory.apply(page_of("arms", {}, {old, fresh}));
  const auto changes = watcher.directory.changes().take();
  REQUIRE(changes.size() == 1);
  CHECK(changes[0].frame == "camera");
  CHECK(changes[0].partition == "arms");
  CHECK(changes[0].rival == "head");
}

TEST_CASE("of two moves that form a cycle the later one is undone and leaves a root") {
  Owning arms("arms");
  arms.directory.apply(page_of("head", {{"neck", "", 10}}));
  REQUIRE(arms.ask("hand", AddRequest{"", along_x(1)}) == "ok");
  REQUIRE(arms.ask("hand", MoveRequest{"neck", {}}, Time(std::chrono::nanoseconds(2000))) == "ok");
  SECTION("the own move") {
    arms.directory.apply(page_of("head", {{"neck", "hand", 1500}}));
    CHECK(arms.yield());
    CHECK(arms.structure() == Lines{"hand <  @ arms", "neck < hand @ head, attached"});
    CHECK(arms.conflicts().size() == 1);
  }
  SECTION("the move of the other partition") {
    arms.directory.apply(page_of("head", {{"neck", "hand", 2500}}));
    CHECK_FALSE(arms.yield());
    CHECK(arms.structure() == Lines{"hand < neck @ arms, attached", "neck <  @ head"});
  }
}

TEST_CASE("a cycle through a frame of an unreachable partition undoes no move") {
  Owning arms("arms");
  arms.directory.apply(presence_of("legs", 1, 1), kNow);
  arms.directory.apply(page_of("head", {{"neck", "", 10}}));
  arms.directory.apply(page_of("legs", {{"leg", "hand", 500}}));
  REQUIRE(arms.ask("hand", AddRequest{"", along_x(1)}) == "ok");
  // Legs have moved their frame elsewhere, which is not known here.
  REQUIRE(arms.ask("hand", MoveRequest{"neck", {}}, Time(std::chrono::nanoseconds(2000))) == "ok");
  arms.directory.apply(page_of("head", {{"neck", "leg", 1500}}));
  REQUIRE(arms.partition.pending_yields().size() == 1);
  REQUIRE(arms.directory.lost("legs", 1, kNow));
  CHECK_FALSE(arms.yield());
  CHECK(arms.conflicts().empty());
  SECTION("the partition has moved its frame away") {
    arms.directory.apply(page_of("legs", {{"leg", "", 600}}));
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
  Owning arms("arms");
  arms.directory.apply(page_of("head", {{"a", "", 10}, {"b", "a", 20}}));
  REQUIRE(arms.ask("hand", AddRequest{"b", along_x(1)}) == "ok");
  arms.directory.apply(page_of("head", {{"a", "hand", 30}, {"b", "", 40}}));
  CHECK_FALSE(arms.yield());
  CHECK(arms.structure() ==
        Lines{"a < hand @ head, attached", "b <  @ head", "hand < b @ arms, attached"});
}

TEST_CASE("yielding may close another cycle whose youngest move is undone") {
  Owning arms("arms");
  arms.directory.apply(page_of("head", {{"a", "", 10}}));
  REQUIRE(arms.ask("camera", AddRequest{"", along_x(1)}) == "ok");
  REQUIRE(arms.ask("hand", AddRequest{"camera", along_x(1)}) == "ok");
  arms.directory.apply(page_of("head", {{"camera", "a", 20}, {"a", "hand", 30}}));
  CHECK(arms.yield());
  CHECK(arms.yield());
  CHECK(arms.structure() ==
        Lines{"a < hand @ head, attached", "camera < a @ head, attached", "hand <  @ arms"});
}

TEST_CASE("a move that forms a cycle with an undone move is undone itself") {
  Owning arms("arms");
  arms.directory.apply(page_of("head", {{"a", "", 10}, {"c", "a", 10}}));
  REQUIRE(arms.ask("hand", AddRequest{"a", along_x(1)}) == "ok");
  arms.directory.apply(page_of("head", {{"a", "hand", 2000}, {"c", "a", 10}}));
  REQUIRE(arms.structure() ==
          Lines{"a <  @ head", "c < a @ head, attached", "hand < a @ arms, attached"});
  REQUIRE(arms.ask("hand", MoveRequest{"c", {}}, Time(std::chrono::nanoseconds(3000))) == "ok");
  CHECK(arms.yield());
  CHECK(arms.structure() ==
        Lines{"a < hand @ head, attached", "c < a @ head, attached", "hand <  @ arms"});
  CHECK(arms.conflicts().size() == 1);
}

TEST_CASE("moving a contested frame makes its claim the later one") {
  Owning arms("arms");
  REQUIRE(arms.ask("camera", AddRequest{"", along_x(1)}) == "ok");
  arms.directory.apply(page_of("head", {{"camera", "", 1100}}));
  REQUIRE_FALSE(arms.yield());
  REQUIRE(arms.ask("camera", MoveRequest{"", {}}) == "ok");
  CHECK(arms.yield());
  CHECK(arms.structure() == Lines{"camera <  @ head"});
  CHECK(arms.conflicts().size() == 1);
}

TEST_CASE("a Lamport time is later than all stored ones") {
  MemoryStore store;
  {
    Owning arms("arms", &store);
    arms.start();
    REQUIRE(arms.ask("hand", AddRequest{"", along_x(1)}, Time(std::chrono::nanoseconds(9000))) ==
            "ok");
  }
  Owning arms("arms", &store);
  arms.start();
  CHECK(arms.directory.next_lamport_time(kNow) > 9000);
}

TEST_CASE("a Lamport time is later than all received ones even if the clock is behind") {
  Replica replica;
  const std::uint64_t first = replica.directory.next_lamport_time(kNow);
  CHECK(first == 1000);
  CHECK(replica.directory.next_lamport_time(kNow) > first);
  replica.directory.apply(page_of("head", {{"neck", "", 5000}}));
  CHECK(replica.directory.next_lamport_time(kNow) > 5000);
}

TEST_CASE("a partition restores what it stored") {
  MemoryStore store;
  {
    Owning arms("arms", &store);
    arms.start({{"arm", "", along_x(1)}, {"hand", "arm", along_x(10)}});
    REQUIRE(arms.ask("tool", AddRequest{"hand", along_x(100)}) == "ok");
    REQUIRE(arms.ask("lamp", AddRequest{"arm", along_x(5)}) == "ok");
    REQUIRE(arms.ask("hand", UpdateRequest{{{"hand", along_x(20)}}}) == "ok");
    REQUIRE(arms.ask("lamp", RemoveRequest{{"lamp"}}) == "ok");
  }
  Owning arms("arms", &store);
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
    Owning tools("tools", &store);
    tools.directory.apply(page_of("arms", {{"flange", "", 10}}));
    tools.start();
    REQUIRE(tools.ask("gripper", AddRequest{"flange", along_x(1)}) == "ok");
    REQUIRE(tools.ask("finger", AddRequest{"gripper", along_x(1)}) == "ok");
  }
  const Page removed = page_of("arms", {}, {{"flange", 2000, Tombstone::Kind::kRemoved, {}}});
  Owning tools("tools", &store);
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
    tools.directory.apply(page_of("arms", {{"flange", "", 3000}}));
    tools.start();
    CHECK(tools.structure().size() == 3);
  }
  SECTION("not if it was attached after the removal") {
    tools.directory.apply(page_of("arms", {}, {{"flange", 900, Tombstone::Kind::kRemoved, {}}}));
    tools.start();
    CHECK(tools.structure().size() == 2);
  }
}

TEST_CASE("a removal has a later Lamport time than all that its client knew") {
  const Time ahead = kNow + std::chrono::seconds(3);
  MemoryStore store;
  Replica client;
  client.directory.apply(presence_of("arms", 1, 1), kNow);
  Owning arms("arms");
  REQUIRE(arms.ask("flange", AddRequest{"", along_x(1)}) == "ok");
  client.apply(arms.partition.take_pages());
  {
    Owning tools("tools", &store);
    tools.directory.apply(page_of("arms", {{"flange", "", 10}}));
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
  Owning tools("tools", &store);
  tools.apply(arms.partition.take_pages());
  tools.start();
  CHECK(tools.structure().empty());
}

// Counts as gone from now on.
void bury(Directory& directory, const std::string& partition) {
  REQUIRE(directory.lost(partition, 1, kNow));
  (void)directory.look_for_gone({});
  (void)directory.look_for_gone(Absences::Steady{} + Absences::kGrace / 2);
  REQUIRE(directory.look_for_gone(Absences::Steady{} + Absences::kGrace));
  REQUIRE(directory.look_for_gone(Absences::Steady{} + Absences::kTakeover));
}

TEST_CASE("a returning partition yields to a reachable one but not to a lost one") {
  MemoryStore store;
  add_in_former_life(store, "camera");
  Owning arms("arms", &store);
  SECTION("the other claim is older") {
    arms.directory.apply(page_of("head", {{"camera", "", 900}}));
    arms.start();
    CHECK(arms.structure() == Lines{"camera <  @ head"});
    CHECK(arms.conflicts().size() == 1);
    CHECK(store.load()->frames.empty());
  }
  SECTION("the other claim is younger") {
    arms.directory.apply(page_of("head", {{"camera", "", 1100}}));
    arms.start();
    CHECK(arms.structure() == Lines{"camera <  @ head"});
    CHECK(arms.conflicts().size() == 1);
  }
  SECTION("the other partition is lost") {
    arms.directory.apply(page_of("head", {{"camera", "", 900}}));
    bury(arms.directory, "head");
    arms.start();
    CHECK(arms.structure() == Lines{"camera <  @ arms"});
    CHECK(arms.conflicts().empty());
  }
}

TEST_CASE("a configured frame is taken over from a lost partition") {
  Owning arms("arms");
  arms.directory.apply(page_of("head", {{"camera", "", 900}, {"lens", "camera", 900}}));
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
    Owning arms("arms", &store);
    arms.directory.apply(page_of("head", {{"neck", "", 10}}));
    arms.start();
    REQUIRE(arms.ask("hand", AddRequest{"neck", along_x(1)}) == "ok");
  }
  Owning arms("arms", &store);
  SECTION("the move of the other partition") {
    arms.directory.apply(page_of("head", {{"neck", "hand", 2000}}));
    arms.start();
    CHECK(arms.structure() == Lines{"hand < neck @ arms, attached", "neck <  @ head"});
    CHECK(arms.conflicts().empty());
  }
  SECTION("the own move") {
    arms.directory.apply(page_of("head", {{"neck", "hand", 500}}));
    arms.start();
    CHECK(arms.structure() == Lines{"hand <  @ arms", "neck < hand @ head, attached"});
    CHECK(arms.conflicts().size() == 1);
  }
}

TEST_CASE("frames of others return to their parents when a returning frame breaks their cycle") {
  MemoryStore store;
  add_in_former_life(store, "hand");
  Owning arms("arms", &store);
  arms.directory.apply(page_of("head", {{"hand", "neck", 1100}, {"neck", "hand", 1200}}));
  REQUIRE(arms.structure() == Lines{"hand < neck @ head, attached", "neck <  @ head"});
  bury(arms.directory, "head");
  arms.start();
  CHECK(arms.structure() == Lines{"hand <  @ arms", "neck < hand @ head, attached"});
}

}  // namespace
}  // namespace tfdude
