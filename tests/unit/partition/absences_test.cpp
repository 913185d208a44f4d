// Unreachable partitions: the effect on frames that others claim, too, and what is stored about
// them.

#include "partition/absences.hpp"

#include <string>
#include <vector>

#include "partition/partition.hpp"
#include "support/catch.hpp"
#include "support/forest_support.hpp"
#include "support/replica.hpp"

namespace tfdude {
namespace {

using testing::along_x;
using testing::presence_of;
using testing::Replica;
using Lines = std::vector<std::string>;
using Kind = Absent::Kind;
using std::chrono::milliseconds;

constexpr Time kNow{std::chrono::seconds(100)};
constexpr Absences::Steady kStart{};

Page page_of(const std::string& partition, std::vector<PageEntry> entries,
             std::uint64_t incarnation = 1) {
  return {partition, 0, incarnation, incarnation + 1, std::move(entries)};
}

// A participant that has heard of both who claim "hand"; that of "arm" is the older claim.
struct Witness : Replica {
  explicit Witness(const std::string& own = "base") : Replica(own) {
    directory.changes().watch();
    hear("arm", 1, 10);
  }
  void hear(const std::string& partition, std::uint64_t incarnation, std::uint64_t lamport_time,
            std::vector<Absent> absent = {}) {
    Presence presence = presence_of(partition, incarnation, 1);
    presence.absent = std::move(absent);
    directory.apply(presence, kNow);
    directory.apply(page_of(partition, {{"hand", "", lamport_time}}, incarnation));
  }
  void lose(const std::string& partition, std::uint64_t incarnation) {
    CHECK(directory.lost(partition, incarnation, kNow));
    (void)directory.look_for_gone(kStart);
  }
  void wait() {
    CHECK_FALSE(directory.look_for_gone(kStart + Absences::kGrace / 2));
    CHECK(directory.look_for_gone(kStart + Absences::kGrace));
    CHECK(directory.look_for_gone(kStart + Absences::kTakeover));
  }
  std::string owner_of(const std::string& id) const {
    const auto frame = forest.info(id);
    return frame ? directory.name(frame->owner) : "nobody";
  }
  std::vector<std::string> told(ChangeKind kind) {
    std::vector<std::string> messages;
    for (const Change& one : directory.changes().take()) {
      if (one.kind == kind) messages.push_back(one.message);
    }
    return messages;
  }
};

TEST_CASE("a short silence changes nothing but who is reachable") {
  Witness base;
  base.hear("left_arm", 1, 20);
  base.lose("arm", 1);
  CHECK(base.owner_of("hand") == "arm");
  REQUIRE(base.directory.absent().size() == 1);
  CHECK(base.directory.absent()[0].kind == Kind::kSilent);
  CHECK_FALSE(base.directory.look_for_gone(kStart + Absences::kGrace / 2));
  CHECK_FALSE(base.directory.look_for_gone(kStart + Absences::kGrace - milliseconds(1)));
  CHECK(base.owner_of("hand") == "arm");
  base.hear("arm", 1, 10);
  CHECK(base.directory.absent().empty());
  CHECK_FALSE(base.directory.look_for_gone(kStart + 2 * Absences::kGrace));
  CHECK(base.owner_of("hand") == "arm");
}

TEST_CASE(
    "a frame of a partition that is gone is that of one that is there, and everybody hears of it") {
  Witness base;
  base.hear("left_arm", 1, 20);
  SECTION("lost") {
    base.lose("arm", 1);
    base.wait();
  }
  SECTION("stopped, which is certain at once") {
    Presence last = presence_of("arm", 1, 1);
    last.serving = false;
    last.stopped = true;
    base.directory.apply(last, kNow);
  }
  CHECK(base.owner_of("hand") == "left_arm");
  CHECK(
      base.told(ChangeKind::kFrameTakenOver) ==
      Lines{"frame 'hand' of partition 'arm', which is not there, is now of 'left_arm' as a root"});
}

TEST_CASE("who returns yields before what it had is routed to another") {
  Witness base;
  base.hear("left_arm", 1, 20);
  base.lose("arm", 1);
  CHECK_FALSE(base.directory.look_for_gone(kStart + Absences::kGrace / 2));
  CHECK(base.directory.look_for_gone(kStart + Absences::kGrace));
  CHECK(base.directory.absent()[0].kind == Kind::kLost);
  CHECK(base.directory.any_pending());
  CHECK(base.owner_of("hand") == "arm");
  SECTION("it hears so as it returns") {
    base.directory.apply(presence_of("arm", 1, 2), kNow);
    CHECK(base.directory.absent()[0].kind == Kind::kBack);
    CHECK_FALSE(base.directory.any_pending());
    CHECK_FALSE(base.directory.look_for_gone(kStart + Absences::kTakeover));
    CHECK(base.owner_of("hand") == "arm");
  }
  SECTION("it does not return") {
    CHECK_FALSE(base.directory.look_for_gone(kStart + Absences::kTakeover - milliseconds(1)));
    CHECK(base.directory.look_for_gone(kStart + Absences::kTakeover));
    CHECK(base.owner_of("hand") == "left_arm");
    CHECK_FALSE(base.directory.any_pending());
  }
  SECTION("who hung meanwhile cannot say") {
    CHECK_FALSE(base.directory.look_for_gone(kStart + 3 * Absences::kGrace));
    CHECK(base.owner_of("hand") == "arm");
  }
}

TEST_CASE("one that comes later has the frame at once") {
  Witness base;
  base.lose("arm", 1);
  base.wait();
  CHECK(base.owner_of("hand") == "arm");
  base.hear("left_arm", 1, 20);
  CHECK(base.owner_of("hand") == "left_arm");
}

TEST_CASE("who has hung itself has outlived nobody of whom it then hears late") {
  Witness base;
  base.lose("arm", 1);
  SECTION("a silence during which it hung is not long") {
    CHECK_FALSE(base.directory.look_for_gone(kStart + 20 * Absences::kGrace));
    REQUIRE(base.directory.absent().size() == 1);
    CHECK(base.directory.absent()[0].kind == Kind::kSilent);
  }
  SECTION("nor does one count that stopped and started again meanwhile") {
    base.hear("arm", 1, 10);
    Presence last = presence_of("arm", 1, 1);
    last.stopped = true;
    base.directory.apply(last, kNow);
    CHECK(base.directory.partitions()[0].stopped);
    (void)base.directory.look_for_gone(kStart + 20 * Absences::kGrace);
    base.hear("arm", 2, 10);
    CHECK(base.directory.absent().empty());
  }
}

TEST_CASE("a stop is told apart from a death") {
  Witness base;
  Presence last = presence_of("arm", 1, 1);
  last.stopped = true;
  const auto down = [&] {
    const auto changes = base.directory.changes().take();
    return changes.back();
  };
  SECTION("a stop") {
    base.directory.apply(last, kNow);
    CHECK(down().stopped);
    CHECK(base.directory.absent()[0].kind == Kind::kSilent);
    CHECK(base.directory.partitions()[0].stopped);
    (void)base.directory.look_for_gone(kStart);
    base.wait();
    CHECK(base.directory.absent()[0].kind == Kind::kStopped);
    // Its absence and a late beat do not change that.
    CHECK_FALSE(base.directory.lost("arm", 1, kNow));
    base.directory.apply(presence_of("arm", 1, 1), kNow);
    CHECK_FALSE(base.directory.partitions()[0].reachable);
    CHECK(base.directory.partitions()[0].stopped);
  }
  SECTION("a death") {
    base.lose("arm", 1);
    CHECK_FALSE(down().stopped);
    CHECK_FALSE(base.directory.partitions()[0].stopped);
  }
  base.directory.apply(presence_of("arm", 2, 1), kNow);
  CHECK(base.directory.partitions()[0].reachable);
  CHECK_FALSE(base.directory.partitions()[0].stopped);
}

TEST_CASE("who returns without having ended yields to who says that it has outlived it") {
  Witness base;
  base.lose("arm", 1);
  base.wait();
  const Absent missed = base.directory.absent()[0];
  base.hear("left_arm", 1, 20, {missed});
  base.hear("arm", 1, 10);
  CHECK(base.owner_of("hand") == "left_arm");
  // Another participant notices the absence later than the one that reports it.
  Witness head("head");
  head.hear("left_arm", 1, 20, {missed});
  CHECK(head.owner_of("hand") == "left_arm");
  CHECK(head.told(ChangeKind::kFrameTakenOver).size() == 1);
  // The same for a participant that joined later.
  Replica late;
  Presence there = presence_of("left_arm", 1, 1);
  there.absent = {{"arm", 0, Kind::kBack, 1}};
  late.apply({page_of("arm", {{"hand", "", 10}}), page_of("left_arm", {{"hand", "", 20}})});
  CHECK(late.structure() == Lines{"hand <  @ arm"});
  late.directory.apply(there, kNow);
  CHECK(late.structure() == Lines{"hand <  @ left_arm"});
}

TEST_CASE("of two that both say they have outlived the other the older claim holds") {
  Witness base;
  base.hear("left_arm", 1, 20, {{"arm", 0, Kind::kLost, 1}});
  CHECK(base.owner_of("hand") == "left_arm");
  base.hear("arm", 1, 10, {{"left_arm", 0, Kind::kLost, 1}});
  CHECK(base.owner_of("hand") == "arm");
}

TEST_CASE("who holds what one claims who is away keeps it when that returns") {
  Replica replica("left_arm");
  Partition partition("left_arm", 1, replica.forest, replica.directory);
  Presence base = presence_of("base", 1, 0);
  base.absent = {{"arm", 0, Kind::kLost, 7}};
  replica.directory.apply(base, kNow);
  REQUIRE(partition.load({{"hand", "", along_x(1)}}, kNow));
  // It says so itself once that has been so for a while.
  CHECK(replica.directory.absent().empty());
  CHECK_FALSE(replica.directory.look_for_gone(kStart));
  CHECK_FALSE(replica.directory.look_for_gone(kStart + Absences::kGrace / 2));
  CHECK(replica.directory.look_for_gone(kStart + Absences::kGrace));
  REQUIRE(replica.directory.absent().size() == 1);
  CHECK(replica.directory.absent()[0].incarnation == 7);
  replica.directory.apply(presence_of("arm", 7, 1), kNow);
  replica.directory.apply(page_of("arm", {{"hand", "", 10}}, 7));
  CHECK(partition.pending_yields().empty());
  REQUIRE(replica.directory.absent().size() == 1);
  CHECK(replica.directory.absent()[0].kind == Kind::kBack);
  // Until that has yielded.
  replica.directory.apply(page_of("arm", {}, 7));
  CHECK(replica.directory.absent().empty());
  CHECK(replica.forest.holds("hand"));
}

TEST_CASE("a silence that others tell of counts from their first word") {
  Replica replica("left_arm");
  Presence base = presence_of("base", 1, 0);
  const auto told = [&](std::vector<Absent> absent) {
    base.absent = std::move(absent);
    replica.directory.apply(base, kNow);
  };
  told({{"arm", 0, Kind::kSilent, 7}});
  CHECK_FALSE(replica.directory.look_for_gone(kStart));
  CHECK_FALSE(replica.directory.look_for_gone(kStart + Absences::kGrace / 2));
  SECTION("once they say that it has lasted") {
    CHECK_FALSE(replica.directory.look_for_gone(kStart + Absences::kGrace));
    told({{"arm", 0, Kind::kLost, 7}});
    CHECK(replica.directory.absent().empty());
    CHECK(replica.directory.look_for_gone(kStart + Absences::kGrace));
    REQUIRE(replica.directory.absent().size() == 1);
    CHECK(replica.directory.absent()[0].kind == Kind::kLost);
  }
  SECTION("until they say that it is over") {
    told({});
    CHECK_FALSE(replica.directory.any_pending());
    CHECK_FALSE(replica.directory.awaits_silent());
    CHECK_FALSE(replica.directory.look_for_gone(kStart + Absences::kGrace));
  }
  SECTION("until they fall silent themselves") {
    CHECK(replica.directory.lost("base", 1, kNow));
    CHECK_FALSE(replica.directory.awaits_silent());
  }
}

TEST_CASE("nothing is given up for one who is silent") {
  Replica replica("left_arm");
  Partition partition("left_arm", 1, replica.forest, replica.directory);
  REQUIRE(partition.load({{"hand", "", along_x(1)}}, kNow));
  replica.directory.apply(presence_of("arm", 7, 1), kNow);
  replica.directory.apply(page_of("arm", {{"hand", "", 10}}, 7));
  CHECK(partition.pending_yields().size() == 1);
  CHECK(replica.directory.lost("arm", 7, kNow));
  CHECK(partition.pending_yields().empty());
  SECTION("it is there again") {
    replica.directory.apply(presence_of("arm", 7, 1), kNow);
    CHECK(partition.pending_yields().size() == 1);
  }
  SECTION("it is gone") {
    (void)replica.directory.look_for_gone(kStart);
    (void)replica.directory.look_for_gone(kStart + Absences::kGrace / 2);
    CHECK(replica.directory.look_for_gone(kStart + Absences::kGrace));
    CHECK(partition.pending_yields().empty());
    replica.directory.apply(presence_of("arm", 7, 1), kNow);
    CHECK(partition.pending_yields().empty());
  }
}

TEST_CASE("who is told of a silence waits for its end") {
  Replica replica;
  Presence base = presence_of("base", 1, 0);
  base.absent = {{"arm", 0, Kind::kSilent, 7}};
  replica.directory.apply(base, kNow);
  CHECK(replica.directory.awaits_silent());
  SECTION("it is gone, and has been for long enough that it yields to this process") {
    base.absent[0].kind = Kind::kLost;
    replica.directory.apply(base, kNow);
    for (int quarter = 0; quarter <= 4; ++quarter) {
      CHECK(replica.directory.awaits_silent());
      (void)replica.directory.look_for_gone(kStart + quarter * Absences::kGrace / 4);
    }
  }
  SECTION("it is there") { replica.directory.apply(presence_of("arm", 7, 1), kNow); }
  replica.directory.apply(base, kNow);
  CHECK_FALSE(replica.directory.awaits_silent());
}

TEST_CASE("what is forgotten is gone, for those as well who were away when it was said") {
  Witness base;
  base.lose("arm", 1);
  base.wait();
  Witness away("head");
  away.lose("arm", 1);
  away.wait();
  REQUIRE(base.directory.forget("arm", 1, kNow));
  CHECK(base.structure().empty());
  CHECK_FALSE(base.directory.owner("arm"));
  CHECK(base.directory.partitions().size() == 1);
  CHECK_FALSE(base.directory.only_heard_of());
  // A participant that has not heard of it does not bring it back.
  Presence head = presence_of("head", 1, 0);
  head.absent = away.directory.absent();
  base.directory.apply(head, kNow);
  CHECK_FALSE(base.directory.owner("arm"));
  Presence said = presence_of("base", 1, 0);
  said.absent = base.directory.absent();
  away.directory.apply(said, kNow);
  CHECK(away.structure().empty());
  CHECK_FALSE(away.directory.owner("arm"));
  // It goes on saying so.
  REQUIRE(away.directory.absent().size() == 1);
  CHECK(away.directory.absent()[0].kind == Kind::kForgotten);
  // Its remaining messages are late; those of a new process are not.
  base.directory.apply(page_of("arm", {{"hand", "", 10}}));
  base.directory.apply(presence_of("arm", 1, 1), kNow);
  CHECK_FALSE(base.directory.owner("arm"));
  base.hear("arm", 2, 10);
  CHECK(base.owner_of("hand") == "arm");
  CHECK(base.directory.absent().empty());
}

TEST_CASE("who has hung itself has outlived nobody of whose absence it is told late") {
  Witness arms("arms");
  Presence head = presence_of("head", 1, 0);
  head.absent = {{"leg", 0, Kind::kStopped, 4}};
  arms.directory.apply(head, kNow);
  CHECK(arms.directory.any_pending());
  // All of this it hears at once.
  arms.directory.apply(presence_of("leg", 5, 0), kNow);
  CHECK(arms.directory.absent().empty());
  CHECK_FALSE(arms.directory.any_pending());
}

TEST_CASE("what was forgotten while it still seemed to be there is forgotten as that ends") {
  Witness base;
  Presence head = presence_of("head", 1, 0);
  head.absent = {{"arm", 0, Kind::kForgotten, 1}};
  base.directory.apply(head, kNow);
  const bool lives_anew = GENERATE(false, true);
  if (lives_anew) base.hear("arm", 2, 10);
  CHECK(base.directory.lost("arm", lives_anew ? 2 : 1, kNow));
  CHECK(base.directory.owner("arm").has_value() == lives_anew);
  CHECK(base.forest.exists("hand") == lives_anew);
}

TEST_CASE("in a cycle who is there keeps the parent, not who is gone") {
  Replica base("base");
  base.directory.apply(presence_of("arm", 1, 1), kNow);
  base.directory.apply(page_of("arm", {{"hand", "tool", 10}}));
  base.directory.apply(presence_of("bench", 1, 1), kNow);
  base.directory.apply(page_of("bench", {{"tool", "hand", 20}}));
  CHECK(base.structure() == Lines{"hand < tool @ arm, attached", "tool <  @ bench"});
  Presence last = presence_of("arm", 1, 1);
  last.stopped = true;
  base.directory.apply(last, kNow);
  CHECK(base.structure() == Lines{"hand <  @ arm", "tool < hand @ bench, attached"});
  base.directory.apply(presence_of("arm", 2, 1), kNow);
  base.directory.apply(page_of("arm", {{"hand", "tool", 10}}, 2));
  CHECK(base.structure() == Lines{"hand < tool @ arm, attached", "tool <  @ bench"});
}

TEST_CASE("who is there is not forgotten") {
  Witness base;
  const auto refused = base.directory.forget("arm", 1, kNow);
  REQUIRE_FALSE(refused);
  CHECK(refused.error().code == Errc::kPartitionTaken);
  CHECK_FALSE(base.directory.forget("base", 1, kNow));
  CHECK(base.owner_of("hand") == "arm");
  // A report of another participant does not change that either.
  Presence head = presence_of("head", 1, 0);
  head.absent = {{"arm", 0, Kind::kForgotten, 1}};
  base.directory.apply(head, kNow);
  CHECK(base.owner_of("hand") == "arm");
}

TEST_CASE("a process learns that others know of a later one of its partition") {
  Replica arm("arm");
  Presence base = presence_of("base", 1, 0);
  CHECK_FALSE(arm.directory.hidden_by(5));
  SECTION("missed") {
    base.absent = {{"arm", 0, Kind::kLost, 9}};
    arm.directory.apply(base, kNow);
    CHECK(arm.directory.hidden_by(5) == 9);
    CHECK_FALSE(arm.directory.hidden_by(9));
  }
  SECTION("itself missed, and forgotten") {
    base.absent = {{"arm", 0, Kind::kForgotten, 5}};
    arm.directory.apply(base, kNow);
    CHECK(arm.directory.hidden_by(5) == 5);
    CHECK_FALSE(arm.directory.hidden_by(6));
  }
}

TEST_CASE("what is dropped for its age is reported, once an incarnation") {
  Witness base;
  base.hear("arm", 9, 10);
  (void)base.directory.take_outdated();
  for (int times = 0; times < 3; ++times) {
    base.directory.apply(presence_of("arm", 5, 1), kNow);
    base.directory.apply(page_of("arm", {}, 5));
  }
  const auto dropped = base.directory.take_outdated();
  REQUIRE(dropped.size() == 1);
  CHECK(dropped[0].partition == "arm");
  CHECK(dropped[0].incarnation == 5);
  CHECK(dropped[0].latest == 9);
  CHECK(base.owner_of("hand") == "arm");
}

TEST_CASE("a number of which nobody can tell a partition any more hides it from nobody") {
  Replica head("head");
  Presence base = presence_of("base", 1, 0);
  base.absent = {{"arm", 0, Kind::kSilent, 9}};
  head.directory.apply(base, kNow);
  head.directory.apply(presence_of("arm", 5, 1), kNow);
  CHECK_FALSE(head.directory.serving("arm"));
  CHECK(head.directory.lost("base", 1, kNow));
  head.directory.apply(presence_of("arm", 5, 1), kNow);
  head.directory.apply(page_of("arm", {{"hand", "", 10}}, 5));
  CHECK(head.directory.serving("arm"));
  CHECK(head.structure() == Lines{"hand <  @ arm"});
}

TEST_CASE("a partition is told the highest number that hides it") {
  Witness base;
  base.lose("arm", 1);
  Presence head = presence_of("head", 1, 0);
  head.absent = {{"arm", 0, Kind::kLost, 9}};
  base.directory.apply(head, kNow);
  base.hear("arm", 5, 10);
  CHECK_FALSE(base.directory.serving("arm"));
  REQUIRE(base.directory.absent().size() == 1);
  CHECK(base.directory.absent()[0].incarnation == 9);
}

TEST_CASE("a process that goes on as a later one is heard again") {
  Witness base;
  base.hear("arm", 9, 10);
  base.lose("arm", 9);
  Replica arm("arm");
  Partition partition("arm", 5, arm.forest, arm.directory);
  REQUIRE(partition.load({{"hand", "", {}}, {"tool", "hand", {}}}, kNow));
  (void)partition.take_pages();
  partition.overtake(12);
  const auto pages = partition.take_pages();
  REQUIRE(pages.size() == 1);
  base.directory.apply(presence_of("arm", 12, 1), kNow);
  base.directory.apply(pages[0]);
  CHECK(base.structure() == Lines{"hand <  @ arm", "tool < hand @ arm, attached"});
}

TEST_CASE("a conflict that a returning partition resolves is reported to who has known it") {
  Witness base;
  base.lose("arm", 1);
  base.wait();
  base.hear("left_arm", 1, 20);
  (void)base.directory.changes().take();
  base.directory.apply(presence_of("arm", 2, 1), kNow);
  base.directory.apply(
      Page{"arm", 0, 2, 3, {}, {{"hand", 30, Tombstone::Kind::kYielded, "left_arm"}}});
  CHECK(base.told(ChangeKind::kConflict).size() == 1);
}

TEST_CASE("who restarts misses whom its predecessor missed") {
  Replica replica("base");
  replica.directory.restore(
      {{"arm", 5, Kind::kBack, 7}, {"leg", 6, Kind::kForgotten, 8}, {"tail", 7, Kind::kSilent, 9}});
  const auto absent = replica.directory.absent();
  REQUIRE(absent.size() == 2);
  CHECK(absent[0] == Absent{"arm", 5, Kind::kLost, 7});
  CHECK(absent[1].kind == Kind::kForgotten);
  CHECK(replica.directory.owner("arm"));
  CHECK_FALSE(replica.directory.owner("leg"));
  CHECK(replica.directory.latest_incarnation("arm") == 7);
}

TEST_CASE("absences are bounded") {
  Absences absences;
  for (std::size_t i = 0; i < 2 * Absences::kMost; ++i) {
    absences.resume({"p" + std::to_string(i), static_cast<std::int64_t>(i), Kind::kLost, 1});
  }
  CHECK(absences.all().size() == Absences::kMost);
  CHECK_FALSE(absences.find("p0"));
}

}  // namespace
}  // namespace tfdude
