#include "partition/directory.hpp"

#include <string>
#include <vector>

#include "support/catch.hpp"
#include "support/forest_support.hpp"
#include "support/replica.hpp"

namespace tfdude {
namespace {

using testing::along_x;
using testing::presence_of;
using testing::Replica;
using Lines = std::vector<std::string>;

constexpr Time kNow{std::chrono::seconds(100)};
constexpr Time kLater{std::chrono::seconds(200)};

// Page 0 of a partition with one page.
Page page_of(const std::string& partition, std::vector<PageEntry> entries,
             std::uint64_t incarnation = 1) {
  return {partition, 0, incarnation, 1, std::move(entries)};
}

TEST_CASE("a directory knows only its own partition at first") {
  const Replica robot("robot");
  CHECK(robot.directory.owner("robot") == kHeldHere);
  CHECK(robot.directory.name(kHeldHere) == "robot");
  CHECK(robot.directory.reachable(kHeldHere));
  CHECK_FALSE(robot.directory.owner("arms"));
  CHECK(robot.directory.partitions().size() == 1);
  CHECK(robot.directory.complete());

  const Replica client;
  CHECK_FALSE(client.directory.owner(""));
  CHECK(client.directory.partitions().empty());
}

TEST_CASE("a presence tells who serves a partition, from where and since when") {
  Replica replica;
  replica.directory.apply(presence_of("arms", 7, 2), kNow);
  replica.directory.apply(presence_of("arms", 7, 2), kLater);
  const auto arms = replica.directory.owner("arms");
  REQUIRE(arms);
  CHECK(replica.directory.name(*arms) == "arms");
  CHECK(replica.directory.reachable(*arms));
  const PartitionInfo& info = replica.directory.info(*arms);
  CHECK(info.host == "host-of-arms");
  CHECK(info.pid == 4711);
  CHECK(info.since == kNow);
  const auto serving = replica.directory.serving("arms");
  REQUIRE(serving);
  CHECK(serving->incarnation == 7);
  CHECK(serving->pages == 2);
  CHECK(serving->serving);
}

TEST_CASE("a process that only claims a name does not serve it") {
  Replica replica;
  Presence claim = presence_of("arms", 7, 0);
  claim.serving = false;
  replica.directory.apply(claim, kNow);
  CHECK_FALSE(replica.directory.owner("arms"));
  CHECK(replica.directory.partitions().empty());
}

TEST_CASE("messages about the own partition change nothing") {
  Replica robot("robot");
  robot.directory.apply(presence_of("robot", 99, 1), kNow);
  robot.directory.apply(page_of("robot", {{"world", ""}}, 99));
  CHECK_FALSE(robot.directory.lost("robot", 99, kNow));
  CHECK(robot.structure().empty());
  CHECK(robot.directory.reachable(kHeldHere));
  CHECK_FALSE(robot.directory.serving("robot"));
}

TEST_CASE("a page replaces what it listed before") {
  Replica replica;
  replica.directory.apply(page_of("arms", {{"arm", "world"}, {"hand", "arm"}, {"tool", "hand"}}));
  CHECK(replica.structure() ==
        Lines{"arm < world @ arms", "hand < arm @ arms, attached", "tool < hand @ arms, attached"});
  CHECK(replica.directory.info(*replica.directory.owner("arms")).frames == 3);
  replica.directory.apply(page_of("arms", {{"arm", "base"}, {"tool", "arm"}}));
  CHECK(replica.structure() == Lines{"arm < base @ arms", "tool < arm @ arms, attached"});
  CHECK(replica.directory.info(*replica.directory.owner("arms")).frames == 2);
}

TEST_CASE("a frame that moves to another page stays whichever page comes first") {
  const Page old_page{"arms", 1, 1, 1, {{"hand", "arm", 1}}};
  const Page new_page{"arms", 0, 1, 1, {{"hand", "wrist", 2}}};
  const Page emptied{"arms", 1, 1, 2, {}};
  const Lines moved{"hand < wrist @ arms"};
  Replica replica;
  SECTION("the new page first") {
    replica.apply({old_page, new_page, emptied});
    CHECK(replica.structure() == moved);
  }
  SECTION("the old page first") {
    replica.apply({old_page, emptied, new_page});
    CHECK(replica.structure() == moved);
  }
  SECTION("the old page's last version is late") {
    replica.apply({new_page, old_page, emptied});
    CHECK(replica.structure() == moved);
  }
  CHECK(replica.directory.info(*replica.directory.owner("arms")).frames == 1);
}

TEST_CASE("an epoch is known when all pages that changed for it have arrived") {
  Replica replica;
  replica.directory.apply(Page{"arms", 0, 1, 2, {}});
  const Owner arms = *replica.directory.owner("arms");
  REQUIRE(replica.directory.epoch(arms) == 2);
  // Page 0 of epoch 3 was replaced on its way by that of epoch 4.
  replica.directory.apply(Page{"arms", 1, 1, 3, {}, {}, {{0, 3}}});
  CHECK(replica.directory.epoch(arms) == 2);
  replica.directory.apply(Page{"arms", 0, 1, 4, {}, {}, {{1, 3}}});
  CHECK(replica.directory.epoch(arms) == 4);
}

TEST_CASE("an epoch is known only with all pages that the partition has announced") {
  Replica replica;
  replica.directory.apply(presence_of("arms", 1, 2), kNow);
  replica.directory.apply(Page{"arms", 0, 1, 3, {}});
  const Owner arms = *replica.directory.owner("arms");
  CHECK(replica.directory.epoch(arms) == 0);
  replica.directory.apply(Page{"arms", 1, 1, 2, {}});
  CHECK(replica.directory.epoch(arms) == 3);
}

TEST_CASE("of pages with one epoch, the one that lists the others counts") {
  Replica replica;
  const Page lists_all{"arms", 2, 1, 2, {}, {}, {{0, 2}, {1, 2}, {3, 1}}};
  replica.apply({Page{"arms", 0, 1, 2, {}, {}, {{2, 2}}}, Page{"arms", 1, 1, 2, {}, {}, {{2, 2}}}});
  const Owner arms = *replica.directory.owner("arms");
  CHECK(replica.directory.epoch(arms) == 0);
  replica.apply({lists_all, Page{"arms", 1, 1, 2, {}, {}, {{2, 2}}}});
  CHECK(replica.directory.epoch(arms) == 0);
  replica.directory.apply(Page{"arms", 3, 1, 1, {}});
  CHECK(replica.directory.epoch(arms) == 2);
}

TEST_CASE("an epoch never goes back") {
  Replica replica;
  replica.directory.apply(Page{"arms", 0, 1, 4, {}});
  const Owner arms = *replica.directory.owner("arms");
  CHECK(replica.directory.epoch(arms) == 4);
  replica.directory.apply(Page{"arms", 1, 1, 3, {}});
  CHECK(replica.directory.epoch(arms) == 4);
}

TEST_CASE("a participant that joins after a partition was lost learns of it from others") {
  Replica known;
  known.directory.apply(presence_of("arms", 1, 1), kNow);
  CHECK(known.directory.absent().empty());
  REQUIRE(known.directory.lost("arms", 1, kLater));
  Replica joiner;
  CHECK_FALSE(joiner.directory.only_heard_of());
  Presence head = presence_of("head", 1, 0);
  head.absent = known.directory.absent();
  joiner.directory.apply(head, kNow);
  REQUIRE(joiner.directory.only_heard_of());
  CHECK(joiner.directory.only_heard_of()->name == "arms");
  CHECK(joiner.directory.only_heard_of()->since == kLater);
  CHECK_FALSE(joiner.directory.reachable(*joiner.directory.owner("arms")));
  CHECK(joiner.directory.complete());
  SECTION("it does not report the partition itself") { CHECK(joiner.directory.absent().empty()); }
  SECTION("until the partition returns") {
    joiner.directory.apply(presence_of("arms", 2, 1), kLater);
    CHECK_FALSE(joiner.directory.only_heard_of());
    CHECK(joiner.directory.reachable(*joiner.directory.owner("arms")));
    joiner.directory.apply(head, kNow);
    CHECK(joiner.directory.reachable(*joiner.directory.owner("arms")));
  }
}

TEST_CASE("a lost partition keeps its structure and is marked unreachable") {
  Replica replica;
  replica.directory.apply(presence_of("arms", 1, 1), kNow);
  replica.directory.apply(page_of("arms", {{"hand", ""}}));
  CHECK(replica.directory.lost("arms", 1, kLater));
  const Owner arms = *replica.directory.owner("arms");
  CHECK(replica.structure() == Lines{"hand <  @ arms"});
  CHECK_FALSE(replica.directory.reachable(arms));
  CHECK(replica.directory.info(arms).since == kLater);
  CHECK_FALSE(replica.directory.serving("arms"));
  CHECK(replica.directory.complete());
  SECTION("a second loss changes nothing") {
    CHECK_FALSE(replica.directory.lost("arms", 1, kLater));
  }
  SECTION("it may return unchanged") {
    replica.directory.apply(presence_of("arms", 1, 1), kLater + std::chrono::seconds(1));
    CHECK(replica.directory.reachable(arms));
    CHECK(replica.directory.info(arms).since == kLater + std::chrono::seconds(1));
  }
}

TEST_CASE("a process whose end nobody has noticed is reported as lost before the next one as up") {
  Replica replica;
  replica.directory.changes().watch();
  const auto hear = [&](std::uint64_t incarnation, std::uint64_t ticket) {
    Presence presence = presence_of("arms", incarnation, 1);
    presence.ticket = ticket;
    replica.directory.apply(presence, kNow);
  };
  const auto heard = [&] {
    Lines lines;
    for (const Change& one : replica.directory.changes().take()) {
      lines.push_back(std::string(to_string(one.kind)) + " " + one.frame);
    }
    return lines;
  };
  hear(1, 11);
  replica.directory.apply(page_of("arms", {{"arm", ""}, {"hand", "arm"}}));
  CHECK(heard() == Lines{"partition_up ", "frame_added arm", "frame_added hand"});
  SECTION("it comes as a new process with other frames") {
    hear(2, 22);
    replica.directory.apply(page_of("arms", {{"arm", ""}}, 2));
    CHECK(heard() == Lines{"partition_down ", "partition_up ", "frame_removed hand"});
    hear(2, 22);
    CHECK(heard().empty());
  }
  SECTION("a page of the new process comes first") {
    replica.directory.apply(page_of("arms", {{"arm", ""}}, 2));
    hear(2, 22);
    CHECK(heard() == Lines{"partition_down ", "partition_up ", "frame_removed hand"});
  }
  SECTION("one process goes on with a higher number") {
    hear(2, 11);
    CHECK(heard() == Lines{"partition_up "});
  }
  SECTION("its end was noticed") {
    REQUIRE(replica.directory.lost("arms", 1, kLater));
    CHECK(heard() == Lines{"partition_down "});
    // A page alone makes it reachable.
    replica.directory.apply(page_of("arms", {{"arm", ""}, {"hand", "arm"}}, 2));
    hear(2, 22);
    CHECK(heard() == Lines{"partition_up "});
  }
}

TEST_CASE("the loss of an unknown partition or of an earlier incarnation is ignored") {
  Replica replica;
  CHECK_FALSE(replica.directory.lost("arms", 1, kNow));
  replica.directory.apply(presence_of("arms", 2, 0), kNow);
  CHECK_FALSE(replica.directory.lost("arms", 1, kNow));
  CHECK(replica.directory.reachable(*replica.directory.owner("arms")));
}

TEST_CASE("of a partition that is lost before all its pages have arrived more may exist") {
  Replica replica;
  replica.directory.apply(presence_of("arms", 1, 2), kNow);
  replica.directory.apply(Page{"arms", 0, 1, 0, {{"hand", ""}}});
  CHECK_FALSE(replica.directory.only_heard_of());
  replica.directory.lost("arms", 1, kLater);
  REQUIRE(replica.directory.only_heard_of());
  CHECK(replica.directory.only_heard_of()->name == "arms");
  replica.directory.apply(presence_of("arms", 1, 2), kLater);
  replica.directory.apply(Page{"arms", 1, 1, 0, {{"tool", "hand"}}});
  replica.directory.lost("arms", 1, kLater);
  CHECK_FALSE(replica.directory.only_heard_of());
}

TEST_CASE("a new incarnation replaces the old one when all its pages have arrived") {
  const Lines old{"hand <  @ arms", "tool < hand @ arms, attached"};
  Replica replica;
  replica.directory.apply(presence_of("arms", 1, 1), kNow);
  replica.directory.apply(page_of("arms", {{"hand", ""}, {"tool", "hand"}}));
  replica.directory.lost("arms", 1, kNow);
  const Owner arms = *replica.directory.owner("arms");
  const Page first{"arms", 0, 2, 0, {{"hand", ""}}};
  const Page last{"arms", 1, 2, 5, {{"fist", "hand"}}};
  SECTION("the presence first") {
    replica.directory.apply(presence_of("arms", 2, 2), kLater);
    replica.directory.apply(first);
    CHECK_FALSE(replica.directory.complete());
    CHECK(replica.structure() == old);
    replica.directory.apply(last);
  }
  SECTION("the pages first") {
    replica.directory.apply(last);
    CHECK(replica.directory.reachable(arms));
    replica.directory.apply(first);
    CHECK(replica.structure() == old);
    replica.directory.apply(presence_of("arms", 2, 2), kLater);
  }
  const Lines fresh{"fist < hand @ arms, attached", "hand <  @ arms"};
  CHECK(replica.structure() == fresh);
  CHECK(replica.directory.complete());
  CHECK(replica.directory.reachable(arms));
  CHECK(replica.directory.info(arms).since == kLater);
  CHECK(replica.directory.info(arms).frames == 2);
  CHECK(replica.directory.epoch(arms) == 5);
  replica.directory.apply(page_of("arms", {{"ghost", ""}}, 1));
  replica.directory.apply(presence_of("arms", 1, 9), kLater);
  CHECK(replica.structure() == fresh);
  CHECK(replica.directory.serving("arms")->incarnation == 2);
}

TEST_CASE("a frame that a restart does not change exists all the time") {
  Replica replica;
  replica.directory.apply(presence_of("arms", 1, 1), kNow);
  replica.directory.apply(page_of("arms", {{"hand", ""}, {"tool", "hand"}}));
  const Handle hand = *replica.forest.find("hand");
  replica.directory.apply(presence_of("arms", 2, 1), kLater);
  replica.directory.apply(page_of("arms", {{"hand", ""}}, 2));
  REQUIRE(replica.forest.info(hand));
  CHECK(replica.structure() == Lines{"hand <  @ arms"});
}

TEST_CASE("a directory is behind until an announced change has arrived") {
  Replica replica;
  replica.directory.apply(presence_of("arms", 1, 1), kNow);
  replica.directory.apply(Page{"arms", 0, 1, 2, {}});
  const Owner arms = *replica.directory.owner("arms");
  replica.directory.note_announced_epoch(arms, 2);
  CHECK(replica.directory.behind() == nullptr);
  replica.directory.note_announced_epoch(arms, 4);
  replica.directory.note_announced_epoch(arms, 3);
  REQUIRE(replica.directory.behind() != nullptr);
  CHECK(*replica.directory.behind() == "arms");
  SECTION("the change arrives") {
    replica.directory.apply(Page{"arms", 0, 1, 3, {}});
    CHECK(replica.directory.behind() != nullptr);
    replica.directory.apply(Page{"arms", 0, 1, 4, {}});
  }
  SECTION("the owner is lost") { replica.directory.lost("arms", 1, kNow); }
  SECTION("a process without frames follows, and will never be so far") {
    replica.directory.lost("arms", 1, kNow);
    replica.directory.apply(presence_of("arms", 2, 0), kNow);
  }
  SECTION("a process with fewer frames follows") {
    replica.directory.apply(presence_of("arms", 2, 1), kNow);
    replica.directory.apply(Page{"arms", 0, 2, 1, {}});
  }
  CHECK(replica.directory.behind() == nullptr);
}

TEST_CASE("a directory is behind until the change of a process has come of which no page has") {
  Replica replica;
  replica.directory.apply(presence_of("arms", 1, 1), kNow);
  replica.directory.apply(Page{"arms", 0, 1, 7, {{"arm", "", 1}}});
  replica.directory.apply(presence_of("arms", 2, 1), kNow);
  const Owner arms = *replica.directory.owner("arms");
  replica.directory.note_announced_epoch(arms, 3);
  REQUIRE(replica.directory.behind() != nullptr);
  replica.directory.apply(Page{"arms", 0, 2, 2, {{"arm", "", 1}}});
  CHECK(replica.directory.behind() != nullptr);
  replica.directory.apply(Page{"arms", 0, 2, 3, {{"arm", "", 1}}});
  CHECK(replica.directory.behind() == nullptr);
}

TEST_CASE("a client accepts an older process of a partition when the later one is lost") {
  // A daemon without a state was restarted after its clock had been set back.
  const bool owns = GENERATE(false, true);
  Replica replica(owns ? "head" : "");
  replica.directory.apply(presence_of("arms", 9, 1), kNow);
  replica.directory.apply(Page{"arms", 0, 9, 9, {{"arm", "", 1}}});
  // Half of the pages of a process between the two.
  replica.directory.apply(presence_of("arms", 10, 2), kNow);
  replica.directory.apply(Page{"arms", 0, 10, 11, {{"arm", "", 1}}});
  replica.directory.apply(presence_of("arms", 5, 1), kNow);
  CHECK(replica.directory.serving("arms")->incarnation == 10);
  replica.directory.lost("arms", 10, kNow);
  replica.directory.apply(presence_of("arms", 5, 1), kNow);
  replica.directory.apply(Page{"arms", 0, 5, 6, {{"arm", "", 1}, {"hand", "arm", 2}}});
  // An owner reports that it knows a later process, so the older one continues with an even later
  // incarnation.
  CHECK(replica.directory.serving("arms").has_value() == !owns);
  CHECK(replica.forest.exists("hand") == !owns);
  CHECK(replica.directory.complete());
}

TEST_CASE("a directory is complete when all pages of all reachable partitions have arrived") {
  Replica replica;
  replica.directory.apply(presence_of("arms", 1, 2), kNow);
  CHECK_FALSE(replica.directory.complete());
  replica.directory.apply(Page{"arms", 1, 1, 1, {}});
  replica.directory.apply(Page{"arms", 1, 1, 2, {}});
  CHECK_FALSE(replica.directory.complete());
  replica.directory.apply(Page{"arms", 0, 1, 2, {}});
  CHECK(replica.directory.complete());
  replica.directory.apply(presence_of("legs", 1, 1), kNow);
  CHECK_FALSE(replica.directory.complete());
  replica.directory.lost("legs", 1, kNow);
  CHECK(replica.directory.complete());
}

TEST_CASE("of two claims of the same age the alphabetically first partition wins") {
  const Page of_arms = page_of("arms", {{"hand", "arm"}});
  const Page of_legs = page_of("legs", {{"hand", "foot"}});
  const Page of_wings = page_of("wings", {{"hand", "tip"}});
  Replica replica;
  if (GENERATE(true, false)) {
    replica.apply({of_arms, of_wings, of_legs});
  } else {
    replica.apply({of_wings, of_legs, of_arms});
  }
  CHECK(replica.structure() == Lines{"hand < arm @ arms"});
  replica.directory.apply(page_of("legs", {{"hand", "knee"}}));
  CHECK(replica.structure() == Lines{"hand < arm @ arms"});
  SECTION("the claim in force is withdrawn first") {
    replica.directory.apply(page_of("arms", {}));
    CHECK(replica.structure() == Lines{"hand < knee @ legs"});
    replica.directory.apply(page_of("legs", {}));
    CHECK(replica.structure() == Lines{"hand < tip @ wings"});
    replica.directory.apply(page_of("wings", {}));
    CHECK(replica.structure().empty());
  }
  SECTION("the shadowed claims are withdrawn first") {
    replica.directory.apply(page_of("legs", {}));
    replica.directory.apply(page_of("wings", {}));
    CHECK(replica.structure() == Lines{"hand < arm @ arms"});
    replica.directory.apply(page_of("arms", {}));
    CHECK(replica.structure().empty());
  }
}

TEST_CASE("an own frame keeps its parent against another claim until it is released") {
  Replica robot("robot");
  REQUIRE(robot.forest.add("hand", "", along_x(1)));
  robot.directory.apply(page_of("arms", {{"hand", "arm"}}));
  CHECK(robot.structure() == Lines{"hand <  @ robot"});
  REQUIRE(robot.forest.remove("hand"));
  robot.directory.released("hand");
  CHECK(robot.structure() == Lines{"hand < arm @ arms"});
}

TEST_CASE("frames of others get the right parents after a cycle that existed only in transit") {
  // First hand was moved away from foot, then foot below hand. The second move arrives first.
  const Page foot_moved = page_of("legs", {{"foot", "hand", 2}});
  const Page hand_moved = page_of("arms", {{"hand", ""}});
  const Lines both{"foot < hand @ legs, attached", "hand <  @ arms"};
  Replica replica;
  replica.directory.apply(page_of("legs", {{"foot", ""}}));
  replica.directory.apply(page_of("arms", {{"hand", "foot", 1}}));
  SECTION("both frames belong to others") {
    replica.directory.apply(foot_moved);
    CHECK(replica.structure() == Lines{"foot <  @ legs", "hand < foot @ arms, attached"});
    SECTION("it ends with a page") { replica.directory.apply(hand_moved); }
    SECTION("it ends with a new incarnation") {
      replica.directory.apply(presence_of("arms", 2, 1), kLater);
      replica.directory.apply(page_of("arms", {{"hand", ""}}, 2));
    }
    CHECK(replica.structure() == both);
  }
  SECTION("an alphabetically earlier partition claims one frame for a while") {
    replica.directory.apply(foot_moved);
    replica.directory.apply(page_of("chest", {{"foot", "rib"}}));
    replica.directory.apply(hand_moved);
    replica.directory.apply(page_of("chest", {}));
    CHECK(replica.structure() == both);
  }
}

TEST_CASE("frames of others get their parents when an own frame leaves a cycle") {
  Replica arms("arms");
  arms.directory.apply(page_of("legs", {{"foot", ""}}));
  REQUIRE(arms.forest.add("hand", "foot", along_x(1)));
  arms.directory.apply(page_of("legs", {{"foot", "hand"}}));
  SECTION("by a move") {
    REQUIRE(arms.forest.move("hand", ""));
    arms.directory.moved();
    CHECK(arms.structure() == Lines{"foot < hand @ legs, attached", "hand <  @ arms"});
  }
  SECTION("by a removal") {
    REQUIRE(arms.forest.remove("hand"));
    arms.directory.released("hand");
    CHECK(arms.structure() == Lines{"foot < hand @ legs"});
  }
}

Page numbered(const std::string& partition, std::uint32_t number, std::size_t frames,
              std::uint64_t incarnation = 1) {
  Page page{partition, number, incarnation, incarnation + 1 + number, {}};
  for (std::size_t i = 0; i < frames; ++i) {
    page.entries.push_back(
        {partition + std::to_string(number) + "_" + std::to_string(i), "", 10 + i});
  }
  return page;
}

TEST_CASE("of the structure of others no more is kept than may be") {
  Replica replica("base");
  Directory& directory = replica.directory;
  directory.limit_others(30);
  const auto frames = [&] { return replica.forest.frames().size(); };
  directory.apply(presence_of("arm", 1, 2), kNow);
  directory.apply(numbered("arm", 0, 9));
  directory.apply(presence_of("evil", 1, 100), kNow);
  for (std::uint32_t i = 0; i < 100; ++i) directory.apply(numbered("evil", i, 4));
  // 10 of arm, and 5 for each of four pages of evil.
  CHECK(frames() == 9 + 4 * 4);
  CHECK(directory.refused() == 96);
  CHECK(directory.take_cut() == Lines{"evil"});
  CHECK(directory.is_cut("evil"));
  CHECK_FALSE(directory.is_cut("arm"));
  SECTION("a page that is replaced makes room for its successor") {
    directory.apply(numbered("arm", 0, 9));
    directory.apply(numbered("evil", 2, 4));
    CHECK(directory.refused() == 96);
    directory.apply(numbered("evil", 2, 0));
    directory.apply(numbered("arm", 1, 3));
    CHECK(frames() == 12 + 3 * 4);
    CHECK(directory.complete() == false);
    CHECK(*directory.incomplete() == "evil");
  }
  SECTION("who is forgotten leaves its room to others") {
    CHECK(directory.lost("evil", 1, kNow));
    REQUIRE(directory.forget("evil", 1, kNow));
    directory.apply(numbered("arm", 1, 19));
    CHECK(frames() == 28);
    CHECK(directory.complete());
    directory.apply(numbered("arm", 1, 20));
    CHECK(frames() == 28);
    CHECK(directory.take_cut() == Lines{"arm"});
    // What is kept of that page is not what its owner has.
    CHECK_FALSE(directory.complete());
    directory.apply(numbered("arm", 1, 18));
    CHECK(directory.complete());
  }
  SECTION("pages that wait until a restarted partition is complete count, too") {
    directory.apply(presence_of("arm", 2, 1), kNow);
    directory.apply(numbered("arm", 0, 9, 2));
    CHECK(directory.is_cut("arm"));
    CHECK(directory.lost("evil", 1, kNow));
    REQUIRE(directory.forget("evil", 1, kNow));
    directory.apply(numbered("arm", 0, 9, 2));
    CHECK(directory.complete());
    directory.apply(numbered("arm", 1, 19, 2));
    CHECK(frames() == 28);
  }
  SECTION("a page of a process that is being replaced does not count for the next one") {
    directory.apply(presence_of("arm", 2, 1), kNow);
    directory.apply(numbered("arm", 1, 9));
    CHECK_FALSE(directory.is_cut("arm"));
  }
  SECTION("pages that a page names count, as long as they are kept") {
    CHECK(directory.lost("evil", 1, kNow));
    REQUIRE(directory.forget("evil", 1, kNow));
    directory.apply(presence_of("arm", 2, 9), kNow);
    Page naming = numbered("arm", 0, 1, 2);
    naming.others.resize(19);
    directory.apply(naming);
    CHECK(directory.is_cut("arm"));
    naming.others.resize(18);
    directory.apply(naming);
    CHECK_FALSE(directory.is_cut("arm"));
    directory.apply(numbered("arm", 1, 0, 2));
    CHECK(directory.is_cut("arm"));
  }
  SECTION("no change is known up to an epoch of which a page was dropped") {
    CHECK(directory.lost("evil", 1, kNow));
    REQUIRE(directory.forget("evil", 1, kNow));
    directory.apply(numbered("arm", 1, 10));
    const Owner arm = *directory.owner("arm");
    const auto at_epoch = [&](std::uint32_t number, std::uint32_t frames_of, std::uint64_t epoch) {
      Page page = numbered("arm", number, frames_of);
      page.epoch = epoch;
      directory.apply(page);
      return directory.epoch(arm);
    };
    const std::uint64_t before = directory.epoch(arm);
    CHECK(at_epoch(1, 25, before + 1) == before);
    CHECK(at_epoch(0, 9, before + 2) == before);
    CHECK(at_epoch(1, 12, before + 3) == before + 3);
  }
}

TEST_CASE("partitions that one is said to miss leave room for those that are there") {
  Replica replica("base");
  Presence presence = presence_of("evil", 1, 1);
  for (std::size_t i = 0; i < 2 * Directory::kMaxPartitions; ++i) {
    presence.absent.push_back({"evil" + std::to_string(i), 0, Absent::Kind::kLost, 1});
  }
  replica.directory.apply(presence, kNow);
  CHECK(replica.directory.refused() > Directory::kMaxPartitions);
  replica.directory.apply(Page{"arm", 0, 1, 2, {{"hand", "", 10}}});
  CHECK(replica.forest.exists("hand"));
}

TEST_CASE("no more partitions are known than may be") {
  Replica replica("base");
  Directory& directory = replica.directory;
  directory.apply(presence_of("arm", 1, 1), kNow);
  for (std::size_t i = 0; i < Directory::kMaxPartitions + 10; ++i) {
    const std::string name = "evil" + std::to_string(i);
    if (i % 3 == 0) directory.apply(presence_of(name, 1, 1), kNow);
    const bool only_named = i % 3 == 2 && i < 1000;
    if (i % 3 != 0 && !only_named) directory.apply(Page{name, 0, 1, 2, {}});
    if (!only_named) continue;
    Presence presence = presence_of("arm", 1, 1);
    presence.absent = {{name, 0, Absent::Kind::kLost, 1}};
    directory.apply(presence, kNow);
  }
  CHECK(directory.partitions().size() <= Directory::kMaxPartitions);
  // base and arm are two of them.
  CHECK(directory.refused() == 12);
  directory.apply(Page{"arm", 0, 1, 2, {{"hand", "", 10}}});
  CHECK(replica.forest.exists("hand"));
  const auto forgotten = directory.forget("unheard", 0, kNow);
  REQUIRE_FALSE(forgotten);
  CHECK(forgotten.error().code == Errc::kTooMuch);
}

}  // namespace
}  // namespace tfdude
