// Successive processes of one partition, and which of them is accepted.

#include <algorithm>
#include <string>
#include <vector>

#include "partition/partition.hpp"
#include "support/catch.hpp"
#include "support/replica.hpp"
#include "support/witness.hpp"

namespace tfdude {
namespace {

using testing::kNow;
using testing::kStart;
using testing::page_of;
using testing::presence_of;
using testing::Replica;
using testing::Witness;
using Lines = std::vector<std::string>;
using Kind = Absent::Kind;

TEST_CASE("a process learns that others know a later incarnation of its partition") {
  Replica arm("arm");
  Presence base = presence_of("base", 1, 0);
  CHECK_FALSE(arm.directory.hidden_by(5));
  SECTION("a later one was lost") {
    base.absent = {{"arm", 0, Kind::kLost, 9}};
    arm.directory.apply(base, kNow);
    CHECK(arm.directory.hidden_by(5) == 9);
    CHECK_FALSE(arm.directory.hidden_by(9));
  }
  SECTION("its own one was forgotten") {
    base.absent = {{"arm", 0, Kind::kForgotten, 5}};
    arm.directory.apply(base, kNow);
    CHECK(arm.directory.hidden_by(5) == 5);
    CHECK_FALSE(arm.directory.hidden_by(6));
  }
}

TEST_CASE("messages of an outdated incarnation are reported once") {
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

// A process sends each page once, and only participants with a partition tell it that they have
// dropped some.
TEST_CASE("a client that hears an earlier process again loses nothing of a later one") {
  Replica client("");
  Directory& directory = client.directory;
  const auto hear = [&](std::uint64_t incarnation, std::uint32_t pages = 2) {
    directory.apply(presence_of("arm", incarnation, pages), kNow);
  };
  hear(5, 1);
  directory.apply(page_of("arm", {{"hand", "", 10}}, 5));
  const Page first{"arm", 0, 9, 11, {{"hand", "", 10}, {"elbow", "", 11}}, {}, {{1, 11}}};
  const Page last{"arm", 1, 9, 11, {{"finger", "hand", 12}}};
  const Lines before{"hand <  @ arm"};
  const Lines after{"elbow <  @ arm", "finger < hand @ arm, attached", "hand <  @ arm"};
  directory.apply(first);
  SECTION("of which only pages have come") {
    REQUIRE(directory.lost("arm", 9, kNow));
    const bool all_there = GENERATE(false, true);
    if (all_there) directory.apply(Page{"arm", 1, 9, 10, {}});
    hear(5, 1);
    CHECK(directory.serving("arm")->incarnation == 5);
    CHECK(client.structure() == before);
    CHECK(directory.complete());
    SECTION("and it says first that it is there") {
      hear(9);
      CHECK(directory.complete() == all_there);
      directory.apply(last);
    }
    SECTION("and it says later that it is there") {
      directory.apply(last);
      hear(9);
    }
    SECTION("and the earlier one is forgotten") {
      REQUIRE(directory.lost("arm", 5, kNow));
      REQUIRE(directory.forget("arm", 5, kNow));
      CHECK(client.structure().empty());
      hear(9);
      directory.apply(last);
    }
  }
  SECTION("whose structure was in force") {
    directory.apply(last);
    hear(9);
    REQUIRE(client.structure() == after);
    REQUIRE(directory.lost("arm", 9, kNow));
    hear(5, 1);
    CHECK(client.structure() == after);
    directory.apply(page_of("arm", {{"hand", "", 10}}, 5));
    CHECK(client.structure() == before);
    CHECK(directory.complete());
    hear(9);
  }
  CHECK(client.structure() == after);
  CHECK(directory.complete());
  CHECK(directory.epoch(*directory.owner("arm")) == 11);
}

TEST_CASE("what a client keeps of a silent process takes room until that returns or is gone") {
  Replica client("");
  Directory& directory = client.directory;
  const auto hear = [&](std::uint64_t incarnation, const std::string& id) {
    directory.apply(presence_of("arm", incarnation, 1), kNow);
    directory.apply(page_of("arm", {{id, "", 10}}, incarnation));
  };
  directory.limit_others(4);
  hear(9, "hand");
  REQUIRE(directory.lost("arm", 9, kNow));
  hear(5, "fist");
  directory.apply(Page{"arm", 1, 5, 7, {{"lamp", "", 11}}});
  REQUIRE(client.structure() == Lines{"fist <  @ arm"});
  REQUIRE(directory.lost("arm", 5, kNow));
  SECTION("it returns") {
    directory.apply(presence_of("arm", 9, 1), kNow);
    directory.apply(Page{"arm", 1, 9, 11, {{"lamp", "", 11}}});
  }
  SECTION("it is forgotten, too") {
    REQUIRE(directory.forget("arm", 9, kNow));
    directory.apply(presence_of("arm", 9, 1), kNow);
    CHECK(client.structure().empty());
    CHECK_FALSE(directory.complete());
    hear(12, "hand");
    directory.apply(Page{"arm", 1, 12, 14, {{"lamp", "", 11}}});
  }
  SECTION("a later one is there") {
    hear(12, "hand");
    directory.apply(Page{"arm", 1, 12, 14, {{"lamp", "", 11}}});
  }
  CHECK(client.structure() == Lines{"hand <  @ arm", "lamp <  @ arm"});
}

TEST_CASE("an incarnation known only from a lost participant hides no process that comes later") {
  Replica head("head");
  Presence base = presence_of("base", 1, 0);
  base.absent = {{"arm", 0, Kind::kSilent, 9}};
  head.directory.apply(base, kNow);
  CHECK(head.directory.lost("base", 1, kNow));
  head.directory.apply(presence_of("arm", 5, 1), kNow);
  head.directory.apply(page_of("arm", {{"hand", "", 10}}, 5));
  CHECK(head.directory.serving("arm"));
  CHECK(head.structure() == Lines{"hand <  @ arm"});
}

TEST_CASE("an incarnation known from a participant that is gone is told by who heard of it") {
  Replica head("head");
  Presence base = presence_of("base", 1, 0);
  base.absent = {{"arm", 0, Kind::kSilent, 9}};
  head.directory.apply(base, kNow);
  // Dropped, since the base informs it.
  head.directory.apply(presence_of("arm", 5, 1), kNow);
  head.directory.apply(page_of("arm", {{"hand", "", 10}}, 5));
  CHECK_FALSE(head.directory.serving("arm"));
  SECTION("restarted: its next process has not heard of it") {
    head.directory.apply(presence_of("base", 2, 0), kNow);
  }
  SECTION("lost") { REQUIRE(head.directory.lost("base", 1, kNow)); }
  SECTION("stopped") {
    base.serving = false;
    base.stopped = true;
    base.absent.clear();
    head.directory.apply(base, kNow);
  }
  for (auto time = kStart; time < kStart + 2 * Absences::kGrace; time += Absences::kGrace / 4) {
    (void)head.directory.look_for_gone(time);
  }
  const auto absent = head.directory.absent();
  const auto told = std::find_if(absent.begin(), absent.end(),
                                 [](const Absent& one) { return one.partition == "arm"; });
  REQUIRE(told != absent.end());
  CHECK(told->incarnation == 9);
  // Its next messages have a later number, and all pages.
  head.directory.apply(presence_of("arm", 12, 1), kNow);
  head.directory.apply(page_of("arm", {{"hand", "", 10}}, 12));
  CHECK(head.structure() == Lines{"hand <  @ arm"});
}

TEST_CASE("an absence has the highest incarnation that hides the partition") {
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

TEST_CASE("a process that continues with a later incarnation is accepted again") {
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

TEST_CASE("a restarted process restores the absences of its predecessor") {
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

TEST_CASE("a restarted process yields to whom it meets, also to one that it missed before") {
  const std::vector<Absent> missed{{"arm", 5, Kind::kLost, 1}};
  SECTION("it meets it") {
    Witness base;
    base.directory.restore(missed);
    CHECK(base.directory.absent().empty());
    CHECK_FALSE(base.directory.take("hand"));
  }
  SECTION("it does not") {
    Replica base("base");
    base.directory.restore(missed);
    CHECK(base.directory.absent().size() == 1);
    CHECK(base.directory.take("hand"));
  }
}

}  // namespace
}  // namespace tfdude
