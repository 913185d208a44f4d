// Forgotten partitions, and the number of absences that are kept.

#include <string>
#include <vector>

#include "partition/absences.hpp"
#include "support/catch.hpp"
#include "support/replica.hpp"
#include "support/witness.hpp"

namespace tfdude {
namespace {

using testing::kNow;
using testing::kStart;
using testing::page_of;
using testing::presence_of;
using testing::Witness;
using Kind = Absent::Kind;

TEST_CASE("a forgotten partition is removed also by participants that were away") {
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
  // The participant passes on that the partition is forgotten.
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

TEST_CASE("two partitions that have forgotten each other learn it from each other") {
  Witness base;
  base.lose("arm", 1);
  base.wait();
  REQUIRE(base.directory.forget("arm", 1, kNow));
  Presence arm = presence_of("arm", 1, 1);
  arm.absent = {{"base", 0, Kind::kForgotten, 1}};
  base.directory.apply(arm, kNow);
  CHECK_FALSE(base.directory.owner("arm"));
  CHECK(base.directory.hidden_by(1) == 1);
}

TEST_CASE("a client that has forgotten a partition accepts it again until it is lost") {
  Witness client("");
  client.lose("arm", 1);
  client.wait();
  REQUIRE(client.directory.forget("arm", 1, kNow));
  CHECK_FALSE(client.directory.owner("arm"));
  client.hear("arm", 1, 10);
  CHECK(client.owner_of("hand") == "arm");
  CHECK(client.directory.lost("arm", 1, kNow));
  CHECK_FALSE(client.directory.owner("arm"));
  SECTION("unless it continues as a later process") {
    client.hear("arm", 2, 10);
    CHECK(client.directory.lost("arm", 2, kNow));
    CHECK(client.owner_of("hand") == "arm");
  }
}

TEST_CASE("a partition that is forgotten while it seems reachable is removed when it is lost") {
  Witness base;
  Presence head = presence_of("head", 1, 0);
  head.absent = {{"arm", 0, Kind::kForgotten, 1}};
  base.directory.apply(head, kNow);
  const bool lives_again = GENERATE(false, true);
  if (lives_again) base.hear("arm", 2, 10);
  CHECK(base.directory.lost("arm", lives_again ? 2 : 1, kNow));
  CHECK(base.directory.owner("arm").has_value() == lives_again);
  CHECK(base.forest.exists("hand") == lives_again);
}

TEST_CASE("a partition is forgotten with a later process that only some have heard") {
  const std::string own = GENERATE("", "head");
  Witness witness(own);
  Presence base = presence_of("base", 1, 0);
  const auto say = [&](std::vector<Absent> absent) {
    base.absent = std::move(absent);
    base.pid += 1;
    witness.directory.apply(base, kNow);
  };
  const Absent forgotten{"arm", 0, Kind::kForgotten, 1};
  say({{"arm", 0, Kind::kLost, 1}});
  SECTION("the process is gone") {
    witness.hear("arm", 2, 10);
    witness.lose("arm", 2);
    witness.wait();
    say({forgotten});
    CHECK_FALSE(witness.directory.owner("arm"));
    CHECK(witness.owner_of("hand") == "nobody");
  }
  SECTION("this is noticed only later") {
    witness.hear("arm", 2, 10);
    say({forgotten});
    CHECK(witness.owner_of("hand") == "arm");
    const bool withdrawn = GENERATE(false, true);
    if (withdrawn) say({});
    witness.lose("arm", 2);
    CHECK(witness.directory.owner("arm"));
    CHECK_FALSE(witness.directory.look_for_gone(kStart + Absences::kGrace / 2));
    CHECK(witness.directory.look_for_gone(kStart + Absences::kGrace));
    CHECK(witness.directory.owner("arm").has_value() == withdrawn);
  }
  SECTION("but not if it is silent for a moment only") {
    witness.hear("arm", 2, 10);
    witness.lose("arm", 2);
    say({forgotten});
    CHECK(witness.owner_of("hand") == "arm");
    say({});
    witness.wait();
    CHECK(witness.owner_of("hand") == "arm");
  }
  SECTION("but not with one that lived after it was forgotten") {
    CHECK(witness.directory.lost("arm", 1, kNow));
    say({forgotten});
    CHECK_FALSE(witness.directory.owner("arm"));
    witness.hear("arm", 2, 10);
    say({forgotten});
    witness.lose("arm", 2);
    witness.wait();
    say({forgotten, {"leg", 0, Kind::kLost, 1}});
    CHECK(witness.owner_of("hand") == "arm");
  }
  SECTION("nor by who may have forgotten it before that") {
    witness.hear("arm", 2, 10);
    witness.lose("arm", 2);
    witness.wait();
    base.incarnation = 2;
    say({forgotten});
    CHECK(witness.owner_of("hand") == "arm");
  }
  SECTION("nor by those that have only heard of it") {
    Presence leg = presence_of("leg", 1, 0);
    leg.absent = {{"arm", 0, Kind::kLost, 2}};
    CHECK(witness.directory.lost("arm", 1, kNow));
    witness.directory.apply(leg, kNow);
    say({forgotten});
    CHECK(witness.directory.owner("arm"));
  }
}

// Nobody has told the process of it, so it does not send its pages again.
TEST_CASE("a client that has taken a silent process for forgotten has its structure again") {
  Witness client("");
  client.directory.apply(presence_of("arm", 2, 2), kNow);
  Page first{"arm", 0, 2, 3, {{"hand", "", 10}, {"elbow", "", 11}}};
  first.joints = {{"wrist", ""}};
  const Page second{"arm", 1, 2, 4, {{"finger", "hand", 12}}, {}, {{0, 3}}};
  const bool replaces = GENERATE(false, true);
  if (replaces) {
    // The structure of the earlier process holds until all pages have come.
    client.directory.apply(first);
  } else {
    client.apply({first, second});
  }
  const auto before = client.structure();
  Presence base = presence_of("base", 1, 0);
  client.directory.apply(base, kNow);
  base.absent = {{"arm", 0, Kind::kForgotten, 1}};
  client.directory.apply(base, kNow);
  client.lose("arm", 2);
  CHECK_FALSE(client.directory.look_for_gone(kStart + Absences::kGrace / 2));
  CHECK(client.directory.look_for_gone(kStart + Absences::kGrace));
  CHECK(client.structure().empty());
  CHECK_FALSE(client.directory.owner("arm"));
  CHECK(client.directory.complete());
  if (replaces) client.directory.apply(second);
  SECTION("as it was") {
    client.directory.apply(presence_of("arm", 2, 2), kNow);
    CHECK(client.directory.complete());
    CHECK(client.directory.epoch(*client.directory.owner("arm")) == 4);
    CHECK(client.directory.route_joint("wrist"));
    CHECK(client.structure().size() == 3);
    if (!replaces) CHECK(client.structure() == before);
    // The process has lived after that.
    client.lose("arm", 2);
    client.wait();
    CHECK(client.owner_of("finger") == "arm");
  }
  SECTION("with what it has changed since") {
    first.epoch = 5;
    first.entries = {{"hand", "", 10}};
    first.others = {{1, 4}};
    client.directory.apply(first);
    client.directory.apply(presence_of("arm", 2, 2), kNow);
    CHECK(client.directory.complete());
    CHECK(client.directory.epoch(*client.directory.owner("arm")) == 5);
    CHECK(client.structure() ==
          std::vector<std::string>{"finger < hand @ arm, attached", "hand <  @ arm"});
  }
  SECTION("also if they have forgotten it a second time") {
    base.absent[0].since = 1;
    client.directory.apply(base, kNow);
    client.directory.apply(presence_of("arm", 2, 2), kNow);
    CHECK(client.owner_of("finger") == "arm");
  }
  SECTION("but not if others forget that process, too") {
    if (replaces) client.directory.apply(presence_of("arm", 2, 2), kNow);
    base.absent[0] = {"arm", 1, Kind::kForgotten, 2};
    client.directory.apply(base, kNow);
    if (replaces) CHECK(client.directory.lost("arm", 2, kNow));
    client.directory.apply(presence_of("arm", 2, 2), kNow);
    CHECK(client.structure().empty());
    CHECK_FALSE(client.directory.complete());
  }
  SECTION("but not if a later process is there") {
    client.directory.apply(presence_of("arm", 3, 1), kNow);
    CHECK(client.structure().empty() != replaces);
    client.directory.apply(page_of("arm", {{"hand", "", 10}}, 3));
    CHECK(client.structure().size() == 1);
    CHECK(client.directory.complete());
  }
}

TEST_CASE("an owner that restarts tells a returning partition that it was forgotten") {
  // The process knows the partition before it reads what its predecessor has stored.
  Witness base;
  base.directory.restore({{"arm", 0, Kind::kForgotten, 1}});
  const auto told = [&] { return !base.directory.absent().empty(); };
  CHECK(told());
  CHECK(base.owner_of("hand") == "arm");
  // As long as it may not have heard that.
  base.hear("arm", 1, 10, {{"head", 0, Kind::kLost, 1}});
  CHECK(told());
  base.hear("arm", 2, 10);
  CHECK_FALSE(told());
  // Not of a later process.
  base.directory.restore({{"arm", 0, Kind::kForgotten, 1}});
  CHECK_FALSE(told());
}

TEST_CASE("a reachable partition cannot be forgotten") {
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

TEST_CASE("the number of absences is bounded") {
  Absences absences([](const std::string&) { return false; });
  for (std::size_t i = 0; i < 2 * Absences::kMost; ++i) {
    absences.resume({"p" + std::to_string(i), static_cast<std::int64_t>(i), Kind::kLost, 1});
  }
  CHECK(absences.all().size() == Absences::kMost);
  CHECK_FALSE(absences.find("p0"));
}

}  // namespace
}  // namespace tfdude
