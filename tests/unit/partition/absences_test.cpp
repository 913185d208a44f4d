// Unreachable partitions: the effect on frames that others claim, too, and what is known of them.

#include "partition/absences.hpp"

#include <algorithm>
#include <string>
#include <vector>

#include "partition/partition.hpp"
#include "support/catch.hpp"
#include "support/forest_support.hpp"
#include "support/replica.hpp"
#include "support/witness.hpp"

namespace tfdude {
namespace {

using testing::along_x;
using testing::kNow;
using testing::kStart;
using testing::page_of;
using testing::presence_of;
using testing::Replica;
using testing::Witness;
using Lines = std::vector<std::string>;
using Kind = Absent::Kind;
using std::chrono::milliseconds;

TEST_CASE("a short silence changes only whether the partition is reachable") {
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

TEST_CASE("a partition whose frames were taken over is missed however many others stop") {
  Witness base;
  base.lose("arm", 1);
  base.wait();
  Partition partition("base", 1, base.forest, base.directory);
  REQUIRE(partition.load({{"hand", "", {}}}, kNow));
  auto steady = kStart + Absences::kTakeover;
  Time now = kNow;
  const auto stop = [&](const std::string& name) {
    now += milliseconds(100);
    Presence other = presence_of(name, 1, 0);
    base.directory.apply(other, now);
    other.serving = false;
    other.stopped = true;
    base.directory.apply(other, now);
    (void)base.directory.look_for_gone(steady += milliseconds(100));
  };
  const auto misses = [&](const std::string& name) {
    const auto absent = base.directory.absent();
    return std::any_of(absent.begin(), absent.end(),
                       [&](const Absent& one) { return one.partition == name; });
  };
  for (std::size_t i = 0; i < Absences::kMost + 20; ++i) stop("other" + std::to_string(i));
  CHECK(base.directory.absent().size() == Absences::kMost);
  CHECK(misses("arm"));
  CHECK_FALSE(misses("other0"));
  CHECK(misses("other" + std::to_string(Absences::kMost + 19)));
  SECTION("and yields when it returns") {
    base.hear("arm", 2, 10);
    CHECK(base.directory.pending_yields().empty());
  }
  SECTION("also if its owner's clock is behind when it forgets another one") {
    REQUIRE(base.directory.forget("leg", 0, Time{}));
    CHECK(misses("leg"));
    CHECK(misses("arm"));
  }
  SECTION("also after a restart, whoever is reported then") {
    Replica next("base");
    next.directory.restore(base.directory.absent());
    Presence teller = presence_of("teller", 1, 0);
    for (int i = 0; i < 20; ++i)
      teller.absent.push_back({"far" + std::to_string(i), 1, Kind::kLost, 1});
    next.directory.apply(teller, now);
    Presence other = presence_of("near", 1, 0);
    next.directory.apply(other, now);
    CHECK(next.directory.lost("near", 1, Time{}));
    const auto absent = next.directory.absent();
    for (const char* name : {"arm", "near"}) {
      CHECK(std::any_of(absent.begin(), absent.end(),
                        [&](const Absent& one) { return one.partition == name; }));
    }
  }
}

TEST_CASE("a frame of an unreachable partition goes to a reachable one and this is reported") {
  Witness base;
  base.hear("left_arm", 1, 20);
  SECTION("lost") {
    base.lose("arm", 1);
    base.wait();
  }
  SECTION("stopped which takes effect at once") {
    Presence last = presence_of("arm", 1, 1);
    last.serving = false;
    last.stopped = true;
    base.directory.apply(last, kNow);
  }
  CHECK(base.owner_of("hand") == "left_arm");
  CHECK(base.told(ChangeKind::kFrameTakenOver) ==
        Lines{"frame 'hand' of partition 'arm', which is not reachable, now belongs to 'left_arm' "
              "as a root"});
}

TEST_CASE("a loss that is noticed early delays the takeover by as much") {
  constexpr milliseconds kEarly{600};
  Witness base;
  base.hear("left_arm", 1, 20);
  REQUIRE(base.directory.lost("arm", 1, kNow, kEarly));
  // The absence itself is reported without that delay.
  for (auto time = milliseconds(0); time < Absences::kTakeover + kEarly;
       time += milliseconds(100)) {
    (void)base.directory.look_for_gone(kStart + time);
    CHECK(base.directory.absent()[0].kind ==
          (time < Absences::kGrace ? Kind::kSilent : Kind::kLost));
    CHECK(base.owner_of("hand") == "arm");
  }
  CHECK(base.directory.look_for_gone(kStart + Absences::kTakeover + kEarly));
  CHECK(base.owner_of("hand") == "left_arm");
}

TEST_CASE("frames of a lost partition are routed to another only after the takeover time") {
  Witness base;
  base.hear("left_arm", 1, 20);
  base.lose("arm", 1);
  CHECK_FALSE(base.directory.look_for_gone(kStart + Absences::kGrace / 2));
  CHECK(base.directory.look_for_gone(kStart + Absences::kGrace));
  CHECK(base.directory.absent()[0].kind == Kind::kLost);
  CHECK(base.directory.any_pending());
  CHECK(base.owner_of("hand") == "arm");
  SECTION("it returns before") {
    base.directory.apply(presence_of("arm", 1, 2), kNow);
    CHECK(base.directory.absent()[0].kind == Kind::kBack);
    CHECK_FALSE(base.directory.any_pending());  // it has announced more than has come
    CHECK_FALSE(base.directory.look_for_gone(kStart + Absences::kTakeover));
    CHECK(base.owner_of("hand") == "arm");
  }
  SECTION("it does not return") {
    CHECK_FALSE(base.directory.look_for_gone(kStart + Absences::kTakeover - milliseconds(1)));
    CHECK(base.directory.look_for_gone(kStart + Absences::kTakeover));
    CHECK(base.owner_of("hand") == "left_arm");
    CHECK_FALSE(base.directory.any_pending());
  }
  SECTION("the time in which this process hung does not count") {
    CHECK_FALSE(base.directory.look_for_gone(kStart + 3 * Absences::kGrace));
    CHECK(base.owner_of("hand") == "arm");
  }
}

TEST_CASE("a partition that claims a frame after the takeover time owns it at once") {
  Witness base;
  base.lose("arm", 1);
  base.wait();
  CHECK(base.owner_of("hand") == "arm");
  base.hear("left_arm", 1, 20);
  CHECK(base.owner_of("hand") == "left_arm");
}

TEST_CASE("a silence during which this process hung does not count") {
  Witness base;
  base.lose("arm", 1);
  SECTION("the partition is silent") {
    CHECK_FALSE(base.directory.look_for_gone(kStart + 20 * Absences::kGrace));
    REQUIRE(base.directory.absent().size() == 1);
    CHECK(base.directory.absent()[0].kind == Kind::kSilent);
  }
  SECTION("the partition stopped and restarted in the meantime") {
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

TEST_CASE("a stop is distinguished from a loss") {
  Witness base;
  Presence last = presence_of("arm", 1, 1);
  last.stopped = true;
  const auto down = [&] {
    const auto changes = base.directory.changes().take();
    return changes.back();
  };
  SECTION("stopped") {
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
  SECTION("lost") {
    base.lose("arm", 1);
    CHECK_FALSE(down().stopped);
    CHECK_FALSE(base.directory.partitions()[0].stopped);
  }
  base.directory.apply(presence_of("arm", 2, 1), kNow);
  CHECK(base.directory.partitions()[0].reachable);
  CHECK_FALSE(base.directory.partitions()[0].stopped);
}

TEST_CASE("a partition that returns without a restart yields to one that reports it as lost") {
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

TEST_CASE("of two partitions that report each other as lost the older claim wins") {
  Witness base;
  base.hear("left_arm", 1, 20, {{"arm", 0, Kind::kLost, 1}});
  CHECK(base.owner_of("hand") == "left_arm");
  base.hear("arm", 1, 10, {{"left_arm", 0, Kind::kLost, 1}});
  CHECK(base.owner_of("hand") == "arm");
}

TEST_CASE("an owner keeps a frame that an unreachable partition claims when that returns") {
  Replica replica("left_arm");
  Partition partition("left_arm", 1, replica.forest, replica.directory);
  Presence base = presence_of("base", 1, 0);
  base.absent = {{"arm", 0, Kind::kLost, 7}};
  replica.directory.apply(base, kNow);
  REQUIRE(partition.load({{"hand", "", along_x(1)}}, kNow));
  // This participant reports the absence itself after some time.
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
  // Until the returning partition has yielded.
  replica.directory.apply(page_of("arm", {}, 7));
  const Absences::Steady yielded = kStart + 2 * Absences::kGrace;
  CHECK_FALSE(replica.directory.look_for_gone(yielded));
  CHECK_FALSE(replica.directory.look_for_gone(yielded + Absences::kGrace / 2));
  CHECK(replica.directory.absent().size() == 1);
  // A presence that is repeated meanwhile does not prolong it.
  replica.directory.apply(presence_of("arm", 7, 1), kNow);
  CHECK(replica.directory.look_for_gone(yielded + Absences::kGrace));
  CHECK(replica.directory.absent().empty());
  CHECK(replica.forest.holds("hand"));
}

TEST_CASE("a reported silence counts from the first report") {
  Replica replica("left_arm");
  Presence base = presence_of("base", 1, 0);
  const auto told = [&](std::vector<Absent> absent) {
    base.absent = std::move(absent);
    replica.directory.apply(base, kNow);
  };
  told({{"arm", 0, Kind::kSilent, 7}});
  CHECK_FALSE(replica.directory.look_for_gone(kStart));
  CHECK_FALSE(replica.directory.look_for_gone(kStart + Absences::kGrace / 2));
  SECTION("and becomes a loss when it is reported as one") {
    CHECK_FALSE(replica.directory.look_for_gone(kStart + Absences::kGrace));
    told({{"arm", 0, Kind::kLost, 7}});
    CHECK(replica.directory.absent().empty());
    CHECK(replica.directory.look_for_gone(kStart + Absences::kGrace));
    REQUIRE(replica.directory.absent().size() == 1);
    CHECK(replica.directory.absent()[0].kind == Kind::kLost);
  }
  SECTION("and ends when it is no longer reported") {
    told({});
    CHECK_FALSE(replica.directory.any_pending());
    CHECK_FALSE(replica.directory.awaits_silent());
    CHECK_FALSE(replica.directory.look_for_gone(kStart + Absences::kGrace));
  }
  SECTION("and ends when the reporter falls silent") {
    CHECK(replica.directory.lost("base", 1, kNow));
    CHECK_FALSE(replica.directory.awaits_silent());
  }
}

TEST_CASE("of a partition that others call silent nobody claims a loss before they do") {
  Replica replica;
  Presence base = presence_of("base", 1, 0);
  Presence head = presence_of("head", 2, 0);
  const auto told = [&](Presence& teller, Kind kind) {
    teller.absent = {{"arm", 0, kind, 7}};
    replica.directory.apply(teller, kNow);
  };
  const auto why = [&] {
    const auto all = replica.directory.partitions();
    const auto arm = std::find_if(all.begin(), all.end(),
                                  [](const PartitionInfo& one) { return one.name == "arm"; });
    return arm == all.end() ? std::string("none") : std::string(why_absent(*arm));
  };
  told(base, Kind::kSilent);
  CHECK(why() == "does not respond");
  SECTION("it was stopped") {
    told(base, Kind::kStopped);
    CHECK(why() == "was stopped");
    told(head, Kind::kSilent);
    CHECK(why() == "was stopped");
  }
  SECTION("it is lost") {
    told(base, Kind::kLost);
    CHECK(why() == "is lost");
  }
  SECTION("who said so was restarted, and cannot say any more what became of it") {
    base = presence_of("base", 2, 0);
    replica.directory.apply(base, kNow);
    for (int quarter = 0; quarter <= 4; ++quarter) {
      CHECK(why() == "does not respond");
      (void)replica.directory.look_for_gone(kStart + quarter * Absences::kGrace / 4);
    }
    CHECK(why() == "is lost");
  }
  SECTION("it returns, and is lost here") {
    replica.directory.apply(presence_of("arm", 7, 0), kNow);
    CHECK(replica.directory.lost("arm", 7, kNow));
    CHECK(why() == "is lost");
  }
}

TEST_CASE("no frame is yielded to a silent partition") {
  Replica replica("left_arm");
  Partition partition("left_arm", 1, replica.forest, replica.directory);
  REQUIRE(partition.load({{"hand", "", along_x(1)}}, kNow));
  replica.directory.apply(presence_of("arm", 7, 1), kNow);
  replica.directory.apply(page_of("arm", {{"hand", "", 10}}, 7));
  CHECK(partition.pending_yields().size() == 1);
  CHECK(replica.directory.lost("arm", 7, kNow));
  CHECK(partition.pending_yields().empty());
  SECTION("it returns") {
    replica.directory.apply(presence_of("arm", 7, 1), kNow);
    CHECK(partition.pending_yields().size() == 1);
  }
  SECTION("it is lost") {
    (void)replica.directory.look_for_gone(kStart);
    (void)replica.directory.look_for_gone(kStart + Absences::kGrace / 2);
    CHECK(replica.directory.look_for_gone(kStart + Absences::kGrace));
    CHECK(partition.pending_yields().empty());
    replica.directory.apply(presence_of("arm", 7, 1), kNow);
    CHECK(partition.pending_yields().empty());
  }
}

TEST_CASE("a participant that is told of a silence waits for its end") {
  Replica replica;
  Presence base = presence_of("base", 1, 0);
  base.absent = {{"arm", 0, Kind::kSilent, 7}};
  replica.directory.apply(base, kNow);
  CHECK(replica.directory.awaits_silent());
  SECTION("the partition is lost for so long that it must yield to this process") {
    base.absent[0].kind = Kind::kLost;
    replica.directory.apply(base, kNow);
    for (int quarter = 0; quarter <= 4; ++quarter) {
      CHECK(replica.directory.awaits_silent());
      (void)replica.directory.look_for_gone(kStart + quarter * Absences::kGrace / 4);
    }
  }
  SECTION("the partition returns") { replica.directory.apply(presence_of("arm", 7, 1), kNow); }
  replica.directory.apply(base, kNow);
  CHECK_FALSE(replica.directory.awaits_silent());
}

TEST_CASE("an absence that is reported late is dropped if the partition is back already") {
  Witness arms("arms");
  Presence head = presence_of("head", 1, 0);
  head.absent = {{"leg", 0, Kind::kStopped, 4}};
  arms.directory.apply(head, kNow);
  CHECK(arms.directory.any_pending());
  // The return is received right after the report.
  arms.directory.apply(presence_of("leg", 5, 0), kNow);
  CHECK(arms.directory.absent().empty());
  CHECK_FALSE(arms.directory.any_pending());
}

TEST_CASE("a late page of an earlier process does not keep the structure incomplete") {
  Witness client("");
  client.hear("arm", 3, 10);
  client.lose("arm", 3);
  client.wait();
  client.directory.apply(page_of("arm", {{"hand", "", 10}, {"old", "hand", 5}}, 2));
  client.hear("arm", 3, 10);
  CHECK(client.directory.complete());
  for (int k = 4; k <= 6; ++k)
    (void)client.directory.look_for_gone(kStart + k * Absences::kGrace / 2);
  CHECK(client.directory.absent().empty());
  CHECK_FALSE(client.forest.exists("old"));
}

TEST_CASE("in a cycle a reachable partition keeps its parent and a lost one does not") {
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

TEST_CASE("a conflict that a returning partition resolves is reported to those that knew it") {
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

}  // namespace
}  // namespace tfdude
