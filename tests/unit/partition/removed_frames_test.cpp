// Removals of frames that a partition had taken over from one that was gone.

#include <algorithm>
#include <memory>
#include <string>
#include <vector>

#include "partition/partition.hpp"
#include "support/catch.hpp"
#include "support/forest_support.hpp"
#include "support/memory_store.hpp"
#include "support/replica.hpp"
#include "support/storing_owner.hpp"
#include "support/witness.hpp"

namespace tfdude {
namespace {

using testing::along_x;
using testing::MemoryStore;
using testing::page_with;
using testing::presence_of;
using testing::Replica;
using testing::StoringOwner;
using testing::unsaved;
using testing::Witness;
using Lines = std::vector<std::string>;
using Kind = Absent::Kind;

constexpr Time kNow = StoringOwner::kNow;
constexpr Absences::Steady kStart{};

Presence said_by(const std::string& partition, std::vector<Absent> absent = {}) {
  Presence presence = presence_of(partition, 1, 1);
  presence.absent = std::move(absent);
  return presence;
}

Page with_tombstone(Page page, std::uint64_t lamport_time,
                    Tombstone::Kind kind = Tombstone::Kind::kRemoved) {
  page.tombstones = {{"hand", lamport_time, kind, {}}};
  return page;
}

TEST_CASE("a frame that was taken over and removed is gone, also when its former owner returns") {
  const std::string own = GENERATE("base", "");
  const auto kind = GENERATE(Tombstone::Kind::kRemoved, Tombstone::Kind::kDropped);
  Witness witness(own);
  const Absent lost{"arm", 0, Kind::kLost, 1};
  witness.lose("arm", 1);
  witness.wait();
  witness.hear("left_arm", 1, 20, {lost});
  REQUIRE(witness.owner_of("hand") == "left_arm");
  (void)witness.directory.changes().take();
  Page removed = with_tombstone(page_with("left_arm", {}), 30, kind);
  removed.epoch = 3;
  witness.directory.apply(removed);
  CHECK(witness.owner_of("hand") == "nobody");
  CHECK(witness.told(ChangeKind::kFrameAdded).empty());
  CHECK(witness.told(ChangeKind::kFrameTakenOver).empty());
  SECTION("with what it was left with, unless the frame was only dropped") {
    const std::string owner = kind == Tombstone::Kind::kRemoved ? "nobody" : "arm";
    witness.hear("arm", 2, 10);
    CHECK(witness.owner_of("hand") == owner);
    witness.directory.apply(said_by("left_arm", {{"arm", 0, Kind::kBack, 2}}), kNow);
    CHECK(witness.owner_of("hand") == owner);
  }
  SECTION("with a frame of that name that was added later") {
    witness.hear("arm", 2, 40);
    CHECK(witness.owner_of("hand") == "arm");
  }
  SECTION("unless the partition that removed it is gone") {
    witness.directory.apply(said_by("left_arm", {}), kNow);
    CHECK(witness.directory.lost("left_arm", 1, kNow));
    witness.hear("arm", 2, 10);
    CHECK(witness.owner_of("hand") == "arm");
  }
}

TEST_CASE("whether a frame was removed does not depend on the order of messages") {
  const Absent lost{"arm", 0, Kind::kLost, 1};
  std::vector<int> order{0, 1, 2, 3, 4};
  do {
    Replica replica;
    for (const int what : order) {
      if (what == 0) replica.directory.apply(presence_of("arm", 1, 1), kNow);
      if (what == 1) replica.directory.apply(page_with("arm", {{"hand", "", 10}}));
      if (what == 2) replica.directory.apply(said_by("left_arm", {lost}), kNow);
      if (what == 3) {
        replica.directory.apply(with_tombstone(page_with("left_arm", {{"arm_1", "", 20}}), 30));
      }
      if (what == 4) replica.directory.apply(page_with("tools", {{"drill", "hand", 5}}));
    }
    CHECK(replica.structure() == Lines{"arm_1 <  @ left_arm", "drill < hand @ tools"});
  } while (std::next_permutation(order.begin(), order.end()));
}

TEST_CASE(
    "a removed frame stays removed if its remover is heard before the last words of its owner") {
  MemoryStore store;
  StoringOwner left_arm("left_arm", &store);
  left_arm.directory.restore({{"arm", 0, Kind::kLost, 1}});
  left_arm.start({{"hand", "", along_x(1)}});
  REQUIRE(left_arm.ask("hand", RemoveRequest{{"hand"}}) == "ok");
  Replica client;
  const auto tell = [&] {
    for (const Page& page : left_arm.partition.take_pages()) client.directory.apply(page);
    client.directory.apply(said_by("left_arm", left_arm.directory.absent()), kNow);
  };
  tell();
  client.directory.apply(presence_of("arm", 2, 1), kNow);
  client.directory.apply(Page{"arm", 0, 2, 3, {{"hand", "", 10}}});
  left_arm.directory.apply(presence_of("arm", 2, 1), kNow);
  left_arm.directory.apply(Page{"arm", 0, 2, 3, {{"hand", "", 10}}});
  REQUIRE(client.structure().empty());
  left_arm.directory.apply(Page{"arm", 0, 2, 4, {}});
  tell();
  CHECK(client.structure().empty());
}

TEST_CASE("a removal by a partition that was not missing the owner ends no claim") {
  Replica replica;
  replica.directory.apply(presence_of("arm", 1, 1), kNow);
  replica.directory.apply(page_with("arm", {{"hand", "", 10}}));
  std::vector<Absent> absent;
  SECTION("it was never gone") {}
  SECTION("each misses the other") {
    absent = {{"arm", 0, Kind::kLost, 1}};
    replica.directory.apply(said_by("arm", {{"left_arm", 0, Kind::kLost, 1}}), kNow);
  }
  replica.directory.apply(said_by("left_arm", absent), kNow);
  replica.directory.apply(with_tombstone(page_with("left_arm", {}), 30));
  CHECK(replica.structure() == Lines{"hand <  @ arm"});
}

TEST_CASE("a partition that removed a frame that it had taken over knows no other claim") {
  MemoryStore store;
  const Absent lost{"arm", 0, Kind::kLost, 1};
  auto left_arm = std::make_unique<StoringOwner>("left_arm", &store);
  left_arm->directory.restore({lost});
  left_arm->start({{"hand", "", along_x(1)}});
  REQUIRE(left_arm->ask("hand", RemoveRequest{{"hand"}}) == "ok");
  const bool restarts = GENERATE(false, true);
  if (restarts) {
    left_arm = std::make_unique<StoringOwner>("left_arm", &store);
    left_arm->directory.restore({lost});
    left_arm->start();
  }
  left_arm->directory.apply(presence_of("arm", 2, 1), kNow);
  left_arm->directory.apply(Page{"arm", 0, 2, 3, {{"hand", "", 10}}});
  CHECK(left_arm->structure().empty());
  // Until it has withdrawn its claim, it is told that it has to.
  CHECK(left_arm->directory.absent().size() == 1);
  left_arm->directory.apply(Page{"arm", 0, 2, 4, {}});
  // And for a while longer, for those who have not heard that it has.
  CHECK_FALSE(left_arm->directory.look_for_gone(kStart));
  CHECK_FALSE(left_arm->directory.look_for_gone(kStart + Absences::kGrace / 2));
  CHECK(left_arm->directory.absent().size() == 1);
  CHECK(left_arm->directory.look_for_gone(kStart + Absences::kGrace));
  CHECK(left_arm->directory.absent().empty());
  left_arm->directory.apply(Page{"arm", 0, 2, 5, {{"hand", "", 10}}});
  CHECK(left_arm->structure() == Lines{"hand <  @ arm"});
}

TEST_CASE("a partition that released a frame lets its former owner have it") {
  StoringOwner left_arm("left_arm");
  left_arm.directory.apply(presence_of("arm", 1, 1), kNow);
  left_arm.directory.apply(page_with("arm", {{"hand", "", 10}}));
  Presence last = presence_of("arm", 1, 1);
  last.stopped = true;
  left_arm.directory.apply(last, kNow);
  REQUIRE(left_arm.partition.load({{"hand", "", along_x(1)}}, kNow));
  CHECK(left_arm.structure() == Lines{"hand <  @ left_arm"});
  REQUIRE(left_arm.partition.release({"hand"}, kNow));
  CHECK(left_arm.structure().empty());
  left_arm.directory.apply(presence_of("arm", 2, 1), kNow);
  left_arm.directory.apply(Page{"arm", 0, 2, 3, {{"hand", "", 10}}});
  CHECK(left_arm.structure() == Lines{"hand <  @ arm"});
  CHECK(left_arm.directory.absent().empty());
}

// Its state still says that it survived arm, but arm returned while it was gone itself.
TEST_CASE("a removal is over once its partition returns to an owner that has the frame again") {
  MemoryStore store;
  const Absent lost{"arm", 0, Kind::kLost, 1};
  auto left_arm = std::make_unique<StoringOwner>("left_arm", &store);
  left_arm->directory.restore({lost});
  left_arm->start({{"hand", "", along_x(1)}});
  const bool dropped = GENERATE(false, true);
  if (dropped) {
    REQUIRE(left_arm->partition.release({"hand"}, kNow));
    REQUIRE(store.save(unsaved(left_arm->partition)));
  } else {
    REQUIRE(left_arm->ask("hand", RemoveRequest{{"hand"}}) == "ok");
  }
  const auto meet_arm = [&] {
    left_arm->directory.apply(said_by("arm", {{"left_arm", 0, Kind::kBack, 1}}), kNow);
    left_arm->directory.apply(page_with("arm", {{"hand", "", 10}, {"cup", "hand", 4000}}));
  };
  left_arm = std::make_unique<StoringOwner>("left_arm", &store);
  const bool at_start = GENERATE(true, false);
  if (at_start) meet_arm();
  left_arm->start();
  if (!at_start) {
    // Left_arm was alone when it started, and hears later that arm did without it.
    meet_arm();
    CHECK(left_arm->yield());
  }
  CHECK(left_arm->structure() == Lines{"cup < hand @ arm, attached", "hand <  @ arm"});
  CHECK_FALSE(left_arm->yield());
  const auto conflicts = left_arm->conflicts();
  REQUIRE(conflicts.size() == (dropped ? 0 : 1));
  if (!dropped) CHECK_THAT(conflicts.front(), testing::ContainsSubstring("'arm', which keeps it"));
  // For all, whatever becomes of arm.
  for (const Page& page : left_arm->partition.take_pages()) {
    for (const Tombstone& one : page.tombstones) CHECK(one.kind == Tombstone::Kind::kYielded);
  }
  REQUIRE(store.save(unsaved(left_arm->partition)));
  const StoredState stored = store.load().value();
  CHECK(std::none_of(stored.tombstones.begin(), stored.tombstones.end(), [](const auto& one) {
    return one.kind == Tombstone::Kind::kRemoved || one.kind == Tombstone::Kind::kDropped;
  }));
}

TEST_CASE("an owner that returns yields the frames that others have removed meanwhile") {
  MemoryStore store;
  std::vector<FrameSpec> configured{{"arm_1", "", along_x(1)}, {"hand", "arm_1", along_x(1)}};
  auto arm = std::make_unique<StoringOwner>("arm", &store);
  arm->start(configured);
  REQUIRE(arm->ask("tool", AddRequest{"hand", along_x(1)}) == "ok");
  const bool dropped = GENERATE(false, true);
  const Page removed =
      with_tombstone(page_with("left_arm", {}), 2000,
                     dropped ? Tombstone::Kind::kDropped : Tombstone::Kind::kRemoved);
  const Lines before = arm->structure();
  const Lines after = dropped ? before : Lines{"arm_1 <  @ arm"};
  const bool missed = GENERATE(false, true);
  const Presence said = said_by(
      "left_arm", missed ? std::vector<Absent>{{"arm", 0, Kind::kLost, 1}} : std::vector<Absent>{});
  SECTION("it was restarted") {
    arm = std::make_unique<StoringOwner>("arm", &store);
    arm->directory.apply(said, kNow);
    arm->directory.apply(removed);
    arm->start(configured);
    CHECK(arm->structure() == after);
  }
  SECTION("it was restarted with another entry") {
    arm = std::make_unique<StoringOwner>("arm", &store);
    arm->directory.apply(said, kNow);
    arm->directory.apply(removed);
    configured.back().X_PC = along_x(5);
    arm->start(configured);
    CHECK(arm->forest.holds("hand"));
  }
  SECTION("it hung") {
    arm->directory.apply(said, kNow);
    arm->directory.apply(removed);
    CHECK(arm->yield() == (missed && !dropped));
    CHECK(arm->structure() == (missed ? after : before));
  }
  // What it says of the frame is not later than what it yielded to.
  for (const Page& page : arm->partition.take_pages()) {
    for (const Tombstone& one : page.tombstones) CHECK(one.lamport_time <= 2000);
  }
}

TEST_CASE("frames below a removed frame go with it, although another partition claims that too") {
  // Tools was away while left_arm removed what it had taken over.
  StoringOwner tools("tools");
  tools.directory.apply(presence_of("arm", 1, 1), kNow);
  tools.directory.apply(page_with("arm", {{"hand", "", 10}}));
  REQUIRE(tools.ask("drill", AddRequest{"hand", along_x(1)}) == "ok");
  tools.directory.apply(with_tombstone(page_with("left_arm", {}), 2000));
  CHECK_FALSE(tools.yield());
  tools.directory.apply(said_by("left_arm", {{"arm", 0, Kind::kLost, 1}}), kNow);
  CHECK(tools.yield());
  CHECK(tools.structure().empty());
}

TEST_CASE("of many tombstones the oldest ends no claim any more") {
  StoringOwner left_arm("left_arm");
  left_arm.directory.restore({{"arm", 0, Kind::kLost, 1}});
  REQUIRE(left_arm.ask("hand", AddRequest{"", along_x(1)}) == "ok");
  REQUIRE(left_arm.ask("hand", RemoveRequest{{"hand"}}) == "ok");
  left_arm.directory.apply(presence_of("arm", 2, 1), kNow);
  left_arm.directory.apply(Page{"arm", 0, 2, 3, {{"hand", "", 10}}});
  CHECK_FALSE(left_arm.forest.exists("hand"));
  for (std::size_t i = 0; i < Pages::kMaxTombstones; ++i) {
    REQUIRE(left_arm.ask("lamp", AddRequest{"", along_x(1)}) == "ok");
    REQUIRE(left_arm.ask("lamp", RemoveRequest{{"lamp"}}) == "ok");
  }
  CHECK_FALSE(left_arm.forest.exists("hand"));
  for (std::size_t i = 0; i < Pages::kMaxTombstones; ++i) {
    const std::string id = "lamp" + std::to_string(i);
    REQUIRE(left_arm.ask(id, AddRequest{"", along_x(1)}) == "ok");
    REQUIRE(left_arm.ask(id, RemoveRequest{{id}}) == "ok");
  }
  CHECK(left_arm.structure() == Lines{"hand <  @ arm"});
}

}  // namespace
}  // namespace tfdude
