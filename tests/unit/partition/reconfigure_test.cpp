#include "partition/reconfigure.hpp"

#include <string>
#include <vector>

#include "partition/partition.hpp"
#include "support/catch.hpp"
#include "support/forest_support.hpp"
#include "support/memory_store.hpp"
#include "support/replica.hpp"

namespace tfdude {
namespace {

using testing::along_x;
using testing::MemoryStore;
using testing::presence_of;
using testing::Replica;
using testing::x_of;
using Lines = std::vector<std::string>;
using Specs = std::vector<FrameSpec>;

constexpr Time kNow{std::chrono::nanoseconds(1000)};

const Correlation kSupply{false, {{"supply", false, Loading::Ones(6, 1)}}, {}};

// A process of the partition "arms", which ends with the object.
struct Life : Replica {
  Life(MemoryStore& kept, const Specs& configured, std::uint64_t number)
      : Replica("arms"), partition("arms", number, forest, directory), store(kept) {
    const auto state = store.load();
    changes = configured_changes(*state, configured);
    REQUIRE(partition.restore(*state, configured, kNow));
    REQUIRE(store.save(testing::unsaved(partition)));
  }

  template <class Body>
  void ask(const std::string& id, Body body) {
    const Reply reply = partition.answer(Request{0, id, std::move(body)}, kNow);
    REQUIRE(std::holds_alternative<Done>(reply.body));
    REQUIRE(store.save(testing::unsaved(partition)));
  }
  Lines described() const {
    Lines lines;
    for (const ConfiguredChange& change : changes) lines.push_back(describe(change));
    return lines;
  }
  Lines orphans() {
    Lines lines;
    for (const Change& one : directory.changes().take()) {
      if (one.kind == ChangeKind::kFrameOrphaned) lines.push_back(one.message);
    }
    return lines;
  }
  /// Sends its presence and its pages to a replica.
  void tell(Replica& other, std::uint64_t number) {
    other.directory.apply(presence_of("arms", number, partition.page_count()), kNow);
    for (const Page& page : partition.take_pages()) other.directory.apply(page);
  }

  Partition partition;
  MemoryStore& store;
  std::vector<ConfiguredChange> changes;
};

const FrameSpec kArm{"arm", "", along_x(1)};
const FrameSpec kHand{"hand", "arm", along_x(10)};

// The state that a first process leaves, with a tool that was added below the hand.
void live(MemoryStore& store) {
  Life first(store, {kArm, kHand}, 1);
  first.ask("tool", AddRequest{"hand", along_x(100)});
  first.ask("hand", UpdateRequest{{{"hand", along_x(20)}}});
}

TEST_CASE("without a configuration the whole state is restored") {
  MemoryStore store;
  live(store);
  {
    Life second(store, {}, 2);
    CHECK(second.structure() ==
          Lines{"arm <  @ arms", "hand < arm @ arms, attached", "tool < hand @ arms, attached"});
    CHECK(x_of(second.forest.lookup("arm", "tool")) == 120);
    CHECK(second.described().empty());
  }
  SECTION("and the former configuration is still known") {
    Life third(store, {kArm, kHand}, 3);
    CHECK(x_of(third.forest.lookup("arm", "tool")) == 120);
    CHECK(third.described().empty());
  }
  SECTION("and the next configuration may delete its entries") {
    Life third(store, {kArm}, 3);
    CHECK(third.structure() == Lines{"arm <  @ arms", "tool < hand @ arms"});
  }
}

TEST_CASE("a deleted entry removes its frame and no frame below it") {
  MemoryStore store;
  live(store);
  {
    Life second(store, {kArm}, 2);
    CHECK(second.structure() == Lines{"arm <  @ arms", "tool < hand @ arms"});
    CHECK(second.described() ==
          Lines{"frame 'hand': removed, because its entry was deleted",
                "frame 'tool': waits for its parent 'hand', which is removed"});
    CHECK(second.orphans() ==
          Lines{"frame 'tool' of partition 'arms' waits for its parent 'hand', which the "
                "configuration of partition 'arms' no longer contains"});
  }
  SECTION("also after another restart") {
    Life third(store, {kArm}, 3);
    CHECK(third.structure() == Lines{"arm <  @ arms", "tool < hand @ arms"});
    CHECK(third.described().empty());
    CHECK(third.orphans().empty());
  }
  SECTION("until the entry is added again") {
    Life third(store, {kArm, kHand}, 3);
    CHECK(third.structure() ==
          Lines{"arm <  @ arms", "hand < arm @ arms, attached", "tool < hand @ arms, attached"});
    CHECK(x_of(third.forest.lookup("arm", "tool")) == 110);
    CHECK(third.described() == Lines{"frame 'hand': added under 'arm'"});
  }
}

TEST_CASE("no configuration removes a frame that was added by request") {
  MemoryStore store;
  live(store);
  Life second(store, {{"legs", "", along_x(1)}}, 2);
  CHECK(second.structure() == Lines{"legs <  @ arms", "tool < hand @ arms"});
}

TEST_CASE("an entry of a frame that was removed or moved by request") {
  MemoryStore store;
  live(store);
  {
    Life second(store, {kArm, kHand}, 2);
    second.ask("hand", MoveRequest{"", {}});
    second.ask("tool", RemoveRequest{{"tool"}});
    second.ask("arm", RemoveRequest{{"arm"}});
  }
  SECTION("has no effect while it is unchanged") {
    Life third(store, {kArm, kHand}, 3);
    CHECK(third.structure() == Lines{"hand <  @ arms"});
  }
  SECTION("takes effect when it is edited") {
    Life third(store, {{"arm", "", along_x(2)}, {"hand", "arm", along_x(11)}}, 3);
    CHECK(third.structure() == Lines{"arm <  @ arms", "hand < arm @ arms, attached"});
    CHECK(third.described() == Lines{"frame 'arm': added as a root",
                                     "frame 'hand': changed to its new entry, under 'arm'"});
  }
  SECTION("removes the frame when it is deleted") {
    Life third(store, {kArm}, 3);
    CHECK(third.structure().empty());
    CHECK(third.described() == Lines{"frame 'hand': removed, because its entry was deleted"});
  }
}

TEST_CASE("an entry of which only the correlation is edited keeps the value") {
  MemoryStore store;
  live(store);
  FrameSpec hand = kHand;
  hand.correlation = kSupply;
  {
    Life second(store, {kArm, hand}, 2);
    CHECK(second.described() ==
          Lines{"frame 'hand': its correlation changes to that of its entry"});
    CHECK(x_of(second.forest.lookup("arm", "tool")) == 120);
    CHECK(second.forest.kept("hand")->correlation.said == kSupply);
  }
  SECTION("and the correlation is restored") {
    Life third(store, {}, 3);
    CHECK(third.forest.kept("hand")->correlation.said == kSupply);
  }
  SECTION("and the correlation can be removed again") {
    Life third(store, {kArm, kHand}, 3);
    CHECK(third.forest.kept("hand")->correlation.empty());
    CHECK(x_of(third.forest.lookup("arm", "tool")) == 120);
  }
}

TEST_CASE("an entry of which only the id is known undoes nothing") {
  MemoryStore store;
  live(store);
  {
    Life second(store, {kArm, kHand}, 2);
    second.ask("hand", MoveRequest{"", along_x(20)});
    second.ask("arm", RemoveRequest{{"arm"}});
  }
  StoredState state = *store.load();
  state.unknown_entries = {"arm", "hand", "tool"};
  state.configured.clear();
  FrameSpec hand = kHand;
  hand.correlation = kSupply;
  CHECK(configured_changes(state, {kArm, hand}).empty());
  Replica arms("arms");
  Partition partition("arms", 3, arms.forest, arms.directory);
  REQUIRE(partition.restore(state, {kArm, hand}, kNow));
  CHECK(arms.structure() == Lines{"hand <  @ arms", "tool < hand @ arms, attached"});
  CHECK(arms.forest.kept("hand")->X_PC.pose.translation().x() == 20);
}

TEST_CASE("frames of others below a deleted entry stay and their owner reports them") {
  MemoryStore store;
  live(store);
  Replica tools("tools");
  {
    Life first(store, {kArm, kHand}, 2);
    first.tell(tools, 2);
    REQUIRE(tools.forest.add("gripper", "tool", along_x(1), Forest::MissingParent::kRefuse, 1500));
    REQUIRE(tools.forest.add("camera", "hand", along_x(1), Forest::MissingParent::kRefuse, 1500));
  }
  (void)tools.directory.changes().take();
  Life second(store, {kArm}, 3);
  second.tell(tools, 3);
  CHECK(tools.structure() == Lines{"arm <  @ arms", "camera < hand @ tools",
                                   "gripper < tool @ tools, attached", "tool < hand @ arms"});
  CHECK(tools.directory.pending_yields().empty());
  std::vector<std::string> orphans;
  for (const Change& one : tools.directory.changes().take()) {
    CHECK(one.kind == ChangeKind::kFrameOrphaned);
    CHECK(one.parent == "hand");
    CHECK(one.rival == "arms");
    orphans.push_back(one.frame + " @ " + one.partition);
  }
  CHECK(orphans == Lines{"camera @ tools"});
}

TEST_CASE("a frame that a deleted entry orphans is reported once") {
  MemoryStore store;
  live(store);
  Replica watcher;
  watcher.directory.changes().watch();
  {
    Life first(store, {kArm, kHand}, 2);
    first.tell(watcher, 2);
  }
  (void)watcher.directory.changes().take();
  for (std::uint64_t number = 3; number < 5; ++number) {
    Life next(store, {kArm}, number);
    next.tell(watcher, number);
  }
  Lines heard;
  for (const Change& one : watcher.directory.changes().take()) {
    if (one.kind != ChangeKind::kPartitionUp) {
      heard.push_back(std::string(to_string(one.kind)) + " " + one.frame);
    }
  }
  CHECK(heard == Lines{"frame_removed hand", "frame_orphaned tool"});
}

TEST_CASE("a stored frame keeps an id that no new frame gets") {
  MemoryStore store;
  StateChange former;
  former.frames = {{"arm ", "", along_x(1), 1, {}}, {"hand", "arm ", along_x(2), 1, {}}};
  REQUIRE(store.save(former));
  Life life(store, {}, 1);
  CHECK(x_of(life.forest.lookup("arm ", "hand")) == 2);
  Replica other;
  life.tell(other, 1);
  CHECK(other.forest.exists("arm "));
  life.ask("arm ", RemoveRequest{{"arm "}});
  CHECK_FALSE(life.forest.exists("arm "));
}

}  // namespace
}  // namespace tfdude
