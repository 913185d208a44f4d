#include "transport/fastdds/peers.hpp"

#include <array>
#include <chrono>
#include <cstdint>
#include <memory>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "support/catch.hpp"

namespace tfdude::fastdds {
namespace {

constexpr std::chrono::milliseconds kRarely{200};
constexpr std::chrono::seconds kMinute{60};
const Patience kPatient{kMinute, kMinute, kMinute, kRarely};

ertps::GuidPrefix_t prefix_of(unsigned char number) {
  ertps::GuidPrefix_t prefix;
  prefix.value[0] = number;
  return prefix;
}

Presence presence_of(const std::string& partition) {
  return {partition, 1, "tower", 4711, 1, true};
}

Announcement serving(const std::string& partition, ProtocolVersion protocol = kProtocolVersion) {
  return {true, partition, protocol, "9.8.7", {}};
}

// The datagram of a participant, as far as it is looked at.
void hear(LifeSigns& signs, unsigned char number, Peers::Clock::time_point at) {
  const std::array<std::uint8_t, 20> datagram{'R', 'T', 'P', 'S', 2, 3, 1, 15, number};
  signs.heard(datagram.data(), datagram.size(), at);
}

// A participant's peers, and the reports about them.
struct Observer {
  std::shared_ptr<LifeSigns> signs = std::make_shared<LifeSigns>();
  std::vector<std::string> told;
  Peers peers{signs, [this](const Presence& one) { told.push_back("+" + one.partition); },
              [this](const Presence& one, std::chrono::nanoseconds sooner) {
                told.push_back("-" + one.partition);
                early = sooner;
              }};
  std::chrono::nanoseconds early{};  // of the last one
  Peers::Clock::time_point now = Peers::Clock::now();

  explicit Observer(bool is_server = false) {
    peers.configure({std::chrono::milliseconds(450), std::chrono::seconds(2), {}, kRarely},
                    is_server);
  }

  void meet(unsigned char number, const std::string& partition, std::size_t others = 0) {
    peers.met(peer_of(prefix_of(number)), serving(partition));
    peers.present(prefix_of(number), presence_of(partition), others);
  }

  // Looks in time, for so long.
  // @return how often somebody was to be asked for a sign of life
  std::size_t look(std::chrono::milliseconds span, const std::set<std::string>& needed = {}) {
    constexpr std::chrono::milliseconds kEvery{30};
    std::size_t probes = 0;
    for (const auto end = now + span; now < end; now += kEvery) {
      probes += peers.look_for_silent(now, kEvery, needed).size();
    }
    return probes;
  }
};

}  // namespace

TEST_CASE("a peer of another major version is reported and otherwise ignored") {
  int told = 0;
  Peers peers(
      std::make_shared<LifeSigns>(), [&](const Presence&) { ++told; },
      [&](const Presence&, std::chrono::nanoseconds) { ++told; });
  peers.configure(kPatient, false);
  peers.met(peer_of(prefix_of(1)), serving("arms", {2, 0}));
  peers.met(peer_of(prefix_of(2)), serving("", {2, 0}));
  peers.met(peer_of(prefix_of(3)), serving("head"));
  CHECK(peers.is_incompatible(prefix_of(1)));
  CHECK(peers.is_incompatible(prefix_of(2)));
  CHECK_FALSE(peers.is_incompatible(prefix_of(3)));
  REQUIRE(peers.incompatible().size() == 1);  // clients own nothing
  CHECK(peers.incompatible()[0].partition == "arms");
  CHECK(peers.incompatible()[0].text() ==
        "partition 'arms' (tf-dude 9.8.7) speaks protocol 2.0, but this program (tf-dude " +
            program_version() + ") speaks 1.1; update the older one");
  peers.present(prefix_of(3), presence_of("head"), 0);
  CHECK_FALSE(peers.awaits_presence());
  told = 0;
  peers.left(prefix_of(1));
  CHECK(peers.incompatible().empty());
  CHECK_FALSE(peers.is_incompatible(prefix_of(1)));
  CHECK(told == 0);
}

// The first announcement in its name may have been forged.
TEST_CASE("a peer that turns out to speak this version is heard") {
  Observer one;
  one.peers.met(peer_of(prefix_of(1)), serving("arms", {9, 9}));
  CHECK(one.peers.is_incompatible(prefix_of(1)));
  one.peers.met(peer_of(prefix_of(1)), serving("arms"));
  CHECK_FALSE(one.peers.is_incompatible(prefix_of(1)));
  CHECK(one.peers.incompatible().empty());
}

TEST_CASE("a silent peer is replaced once a later process serves its partition") {
  Observer one;
  const auto replaced = [&](unsigned char number) {
    return one.peers.replaced(peer_of(prefix_of(number)));
  };
  const auto silent = [&](unsigned char number) {
    return one.peers.silent(peer_of(prefix_of(number)));
  };
  one.meet(1, "arms");
  one.meet(2, "head");
  CHECK_FALSE(replaced(1));
  CHECK_FALSE(one.peers.any_silent());
  one.look(std::chrono::seconds(3));
  REQUIRE(one.peers.silent("arms"));
  CHECK(one.peers.any_silent());
  CHECK(silent(1));
  CHECK_FALSE(silent(4));  // unknown
  CHECK_FALSE(replaced(1));
  Presence later = presence_of("arms");
  later.incarnation = 2;
  later.serving = false;  // claims the name
  one.peers.present(prefix_of(3), later, 0);
  CHECK_FALSE(replaced(1));
  later.serving = true;
  one.peers.present(prefix_of(3), later, 0);
  CHECK(replaced(1));
  CHECK_FALSE(replaced(2));  // of another partition
  CHECK_FALSE(replaced(3));
  CHECK_FALSE(silent(3));
  CHECK(silent(1));
  CHECK_FALSE(replaced(4));  // unknown
  // The later process has left again.
  one.peers.left(prefix_of(3));
  CHECK(replaced(1));
  // The earlier one was only paused.
  one.peers.present(prefix_of(1), presence_of("arms"), 0);
  CHECK_FALSE(replaced(1));
  CHECK_FALSE(silent(1));
  one.peers.left(prefix_of(2));
  CHECK_FALSE(one.peers.any_silent());
}

// Those that have asked meanwhile may have given up.
TEST_CASE("a participant that looks late was held up, until it has taken what came meanwhile") {
  using std::chrono::milliseconds;
  Observer one;
  one.look(milliseconds(300));
  const auto last = one.now - milliseconds(30);
  CHECK_FALSE(one.peers.was_held_up(last + kRarely + Peers::kLate));
  CHECK(one.peers.was_held_up(last + kRarely + Peers::kLate + milliseconds(1)));
  const auto late = last + kRarely + Peers::kLate;
  (void)one.peers.look_for_silent(late, kRarely, {});
  CHECK(one.peers.was_held_up(late + Peers::kTaken / 2));
  CHECK_FALSE(one.peers.was_held_up(late + Peers::kTaken));
  // A little late it may be.
  const auto next = late + kRarely + Peers::kLate / 2;
  (void)one.peers.look_for_silent(next, kRarely, {});
  CHECK_FALSE(one.peers.was_held_up(next + milliseconds(1)));
}

TEST_CASE("a rival for the own partition is reported once it has answered") {
  constexpr std::chrono::milliseconds kSoon{300};
  Observer arms;
  arms.peers.serve("arms");
  arms.meet(1, "arms");
  CHECK(arms.told.empty());
  CHECK(arms.look(kSoon) > 0);
  SECTION("it answers") {
    arms.peers.replied(prefix_of(1));
    CHECK(arms.told == std::vector<std::string>{"+arms"});
    CHECK(arms.look(kSoon) == 0);
    Presence other = presence_of("arms");
    other.pages = 7;
    arms.peers.present(prefix_of(1), other, 0);
    CHECK(arms.told.size() == 2);
  }
  SECTION("it does not answer in time") {
    arms.look(Peers::kProofWithin);
    CHECK(arms.told == std::vector<std::string>{"-arms"});
    arms.meet(1, "arms");  // the same again
    CHECK(arms.look(kSoon) == 0);
    arms.peers.replied(prefix_of(1));
    CHECK(arms.told.size() == 2);
  }
  SECTION("it leaves") {
    arms.peers.left(prefix_of(1));
    CHECK(arms.told == std::vector<std::string>{"-arms"});
    CHECK(arms.look(kSoon) == 0);
  }
}

TEST_CASE("an answer from before a rival was doubted shows nothing") {
  Observer arms;
  arms.peers.serve("arms");
  arms.peers.met(peer_of(prefix_of(1)), serving("arms"));
  arms.peers.replied(prefix_of(1));
  arms.peers.present(prefix_of(1), presence_of("arms"), 0);
  arms.peers.replied(prefix_of(1));  // not asked either
  CHECK(arms.told.empty());
}

TEST_CASE("rivals of other partitions, and those that do not serve, are reported at once") {
  Observer arms;
  arms.meet(1, "arms");  // this participant does not serve it yet
  arms.peers.serve("arms");
  arms.meet(2, "head");
  Presence claim = presence_of("arms");
  claim.serving = false;
  arms.peers.present(prefix_of(3), claim, 0);
  CHECK(arms.told == std::vector<std::string>{"+arms", "+head", "+arms"});
}

TEST_CASE("changes wait if a rival appears after this process could not run") {
  Observer arms;
  arms.peers.serve("arms");
  arms.look(std::chrono::milliseconds(300));
  arms.meet(1, "arms");
  CHECK_FALSE(arms.peers.may_be_replaced());
  arms.now += std::chrono::milliseconds(400);
  (void)arms.peers.look_for_silent(arms.now, std::chrono::milliseconds(30), {});
  CHECK(arms.peers.may_be_replaced());
  arms.peers.replied(prefix_of(1));
  CHECK_FALSE(arms.peers.may_be_replaced());
}

TEST_CASE("discovery is complete when all peers know as many participants") {
  Observer one;
  SECTION("a peer that knows no other") {
    one.meet(1, "arms");
    CHECK_FALSE(one.peers.discovered());  // another may answer yet
    std::this_thread::sleep_for(Peers::kAgreedQuiet);
    CHECK(one.peers.discovered());
  }
  SECTION("a peer that knows one that is not discovered yet") {
    one.meet(1, "arms", 1);
    std::this_thread::sleep_for(Peers::kQuiet);
    CHECK_FALSE(one.peers.awaits_presence());
    CHECK_FALSE(one.peers.discovered());
    one.meet(2, "head", 1);
    std::this_thread::sleep_for(Peers::kAgreedQuiet);
    CHECK(one.peers.discovered());
  }
  SECTION("a peer that has met one whose keys have expired since") {
    one.meet(1, "arms", 1);
    std::this_thread::sleep_for(Peers::kAgreedQuiet);
    CHECK_FALSE(one.peers.discovered(1));  // another may answer yet
    std::this_thread::sleep_for(Peers::kQuiet);
    CHECK(one.peers.discovered(1));
    CHECK_FALSE(one.peers.discovered());
  }
  SECTION("a peer that knows fewer may report more late") {
    one.meet(1, "arms", 1);
    one.meet(2, "head", 0);
    std::this_thread::sleep_for(Peers::kAgreedQuiet);
    CHECK_FALSE(one.peers.discovered());
    std::this_thread::sleep_for(Peers::kQuiet);
    CHECK(one.peers.discovered());
  }
  SECTION("a peer that claims its name may not have discovered others yet") {
    one.peers.met(peer_of(prefix_of(1)), serving("arms"));
    Presence claim = presence_of("arms");
    claim.serving = false;
    one.peers.present(prefix_of(1), claim, 0);
    std::this_thread::sleep_for(Peers::kAgreedQuiet);
    CHECK_FALSE(one.peers.discovered());
    std::this_thread::sleep_for(Peers::kQuiet);
    CHECK_FALSE(one.peers.discovered());  // it is about to serve, and nobody else does
    one.peers.present(prefix_of(1), presence_of("arms"), 0);
    CHECK(one.peers.discovered());
  }
  SECTION("a peer that claims its name beside one that serves") {
    one.meet(1, "arms");
    one.peers.met(peer_of(prefix_of(2)), serving("head"));
    Presence claim = presence_of("head");
    claim.serving = false;
    one.peers.present(prefix_of(2), claim, 0);
    std::this_thread::sleep_for(Peers::kQuiet);
    CHECK(one.peers.discovered());
  }
}

TEST_CASE("servers count also the participant that asks") {
  Observer server(true);
  server.meet(1, "arms", 1);
  std::this_thread::sleep_for(Peers::kAgreedQuiet);
  CHECK(server.peers.discovered());
  Observer beside(true);
  beside.peers.met(peer_of(prefix_of(1)), serving("arms"));
  Presence claim = presence_of("arms");
  claim.serving = false;
  beside.peers.present(prefix_of(1), claim, 1);
  std::this_thread::sleep_for(Peers::kQuiet);
  CHECK(beside.peers.discovered());
}

TEST_CASE("a server that is gone counts until it is announced as missed") {
  Observer one(true);
  one.meet(1, "arms");
  one.meet(2, "head");
  CHECK(one.peers.count({}) == 2);
  SECTION("who has left") {
    one.peers.left(prefix_of(1));
    CHECK(one.peers.count({"head"}) == 2);
    CHECK(one.peers.count({"arms"}) == 1);
    CHECK(one.peers.count({}) == 1);  // it has returned, and was another process
  }
  SECTION("who is silent, and is heard again") {
    one.look(std::chrono::milliseconds(1900));
    hear(*one.signs, 2, one.now);
    one.look(std::chrono::milliseconds(200));
    REQUIRE(one.peers.silent("arms"));
    CHECK(one.peers.count({}) == 2);
    hear(*one.signs, 1, one.now);
    one.look(std::chrono::milliseconds(30));
    CHECK(one.peers.count({}) == 2);
  }
  SECTION("who ends in order is announced before it leaves") {
    one.peers.left(prefix_of(2));
    CHECK(one.peers.count({"head"}) == 1);
  }
  SECTION("who only claimed a name, or the own one, is missed by nobody") {
    one.peers.serve("legs");
    one.meet(3, "legs");
    one.peers.left(prefix_of(3));
    one.peers.met(peer_of(prefix_of(4)), serving("tool"));
    Presence claim = presence_of("tool");
    claim.serving = false;
    one.peers.present(prefix_of(4), claim, 0);
    one.peers.left(prefix_of(4));
    CHECK(one.peers.count({}) == 2);
  }
  SECTION("an earlier process of a partition is missed by nobody") {
    one.meet(3, "arms");
    one.peers.left(prefix_of(1));
    CHECK(one.peers.count({}) == 2);
  }
}

TEST_CASE("a server that is not needed counts as lost without announcements") {
  Observer one;
  one.meet(1, "arms");
  one.told.clear();
  CHECK(one.look(std::chrono::milliseconds(1900)) == 0);
  CHECK(one.told.empty());
  hear(*one.signs, 1, one.now);
  one.look(std::chrono::milliseconds(1900));
  CHECK(one.told.empty());
  one.look(std::chrono::milliseconds(200));
  CHECK(one.told == std::vector<std::string>{"-arms"});
  CHECK(one.peers.silent("arms"));
  SECTION("and returns with its first datagram") {
    hear(*one.signs, 1, one.now);
    one.look(std::chrono::milliseconds(30));
    CHECK(one.told == std::vector<std::string>{"-arms", "+arms"});
    CHECK_FALSE(one.peers.silent("arms"));
  }
  SECTION("and does not return with datagrams of others") {
    hear(*one.signs, 2, one.now);
    one.look(std::chrono::milliseconds(30));
    CHECK(one.peers.silent("arms"));
  }
}

TEST_CASE("a server that is needed is asked for a sign of life and lost after its lease") {
  Observer one;
  one.meet(1, "arms");
  one.meet(2, "head");
  one.peers.replied(prefix_of(1));
  one.told.clear();
  // That it was silent before it was needed does not count.
  one.look(std::chrono::milliseconds(900));
  SECTION("it does not answer") {
    CHECK(one.look(std::chrono::milliseconds(420), {"arms"}) >= 10);
    CHECK(one.told.empty());
    one.look(std::chrono::milliseconds(60), {"arms"});
    CHECK(one.told == std::vector<std::string>{"-arms"});
    // Others do not need it: they notice after 2.2 s at the latest, counted from its last message.
    CHECK(one.early > std::chrono::milliseconds(700));
    CHECK(one.early < std::chrono::milliseconds(2200 - 450));
  }
  SECTION("it answers") {
    for (int i = 0; i < 10; ++i) {
      CHECK(one.look(std::chrono::milliseconds(120), {"arms"}) <= 1);
      hear(*one.signs, 1, one.now);
    }
    CHECK(one.told == std::vector<std::string>{"-head"});  // which nobody needed
  }
  SECTION("it sends other messages") {
    for (int i = 0; i < 10; ++i) {
      hear(*one.signs, 1, one.now);
      CHECK(one.look(std::chrono::milliseconds(90), {"arms"}) == 0);
    }
  }
}

TEST_CASE("a needed server that has never replied is lost only after the longer time") {
  Observer one;
  one.meet(1, "arms");
  one.told.clear();
  CHECK(one.look(std::chrono::milliseconds(1900), {"arms"}) >= 50);
  CHECK(one.told.empty());
  one.look(std::chrono::milliseconds(200), {"arms"});
  CHECK(one.told == std::vector<std::string>{"-arms"});
}

TEST_CASE("the time in which this process could not receive is no silence of others") {
  Observer one;
  one.meet(1, "arms");
  one.peers.replied(prefix_of(1));
  one.told.clear();
  one.look(std::chrono::milliseconds(60), {"arms"});
  one.now += std::chrono::seconds(10);
  one.look(std::chrono::milliseconds(300), {"arms"});
  CHECK(one.told.empty());
  one.look(std::chrono::milliseconds(300), {"arms"});
  CHECK(one.told == std::vector<std::string>{"-arms"});
}

TEST_CASE("a peer that sends a page and then nothing is lost and not waited for") {
  std::vector<std::uint64_t> gone;
  Peers peers(
      std::make_shared<LifeSigns>(), [](const Presence&) {},
      [&](const Presence& one, std::chrono::nanoseconds) { gone.push_back(one.incarnation); });
  peers.configure(kPatient, false);
  peers.met(peer_of(prefix_of(1)), serving("arms"));
  Page page;
  page.partition = "arms";
  page.incarnation = 7;
  peers.sent_page(prefix_of(1), page);
  CHECK(peers.awaits_presence());
  // Looked at in time, until it has been silent for too long.
  constexpr std::chrono::milliseconds kEvery{60};
  const auto start = Peers::Clock::now();
  for (auto late = kEvery; late < std::chrono::seconds(62); late += kEvery) {
    CHECK(peers.look_for_silent(start + late, kEvery, {}).empty());
  }
  CHECK_FALSE(peers.awaits_presence());
  CHECK(gone == std::vector<std::uint64_t>{7});
  SECTION("it has only been slow") {
    Presence late = presence_of("arms");
    late.incarnation = 8;
    peers.present(prefix_of(1), late, 0);
    peers.left(prefix_of(1));
    CHECK(gone == std::vector<std::uint64_t>{7, 8});
  }
  SECTION("its loss is reported once") {
    peers.left(prefix_of(1));
    CHECK(gone.size() == 1);
  }
}

TEST_CASE("a peer that sent a page of a later incarnation is lost under that incarnation") {
  std::vector<std::uint64_t> gone;
  Peers peers(
      std::make_shared<LifeSigns>(), [](const Presence&) {},
      [&](const Presence& one, std::chrono::nanoseconds) { gone.push_back(one.incarnation); });
  peers.configure(kPatient, false);
  peers.met(peer_of(prefix_of(1)), serving("arms"));
  // While it claims its name; it serves under another number.
  peers.present(prefix_of(1), presence_of("arms"), 0);
  Page page;
  page.partition = "arms";
  page.incarnation = 7;
  peers.sent_page(prefix_of(1), page);
  peers.left(prefix_of(1));
  CHECK(gone == std::vector<std::uint64_t>{7});
}

TEST_CASE("a discovered peer without a presence is waited for") {
  Observer one;
  one.peers.met(peer_of(prefix_of(1)), serving("arms"));
  one.look(std::chrono::seconds(9));
  CHECK(one.peers.awaits_presence());
}

TEST_CASE("signs of life are read only from the RTPS header") {
  LifeSigns signs;
  PeerId peer{};
  peer[0] = 5;
  const auto now = LifeSigns::Clock::now();
  hear(signs, 5, now);
  CHECK_FALSE(signs.last(peer));  // not followed
  signs.follow(peer);
  CHECK_FALSE(signs.last(peer));
  std::array<std::uint8_t, 20> other{'R', 'T', 'P', 'X', 2, 3, 1, 15, 5};
  signs.heard(other.data(), other.size(), now);
  other[3] = 'S';
  signs.heard(other.data(), other.size() - 1, now);
  CHECK_FALSE(signs.last(peer));
  signs.heard(other.data(), other.size(), now);
  CHECK(signs.last(peer) == now);
  signs.forget(peer);
  CHECK_FALSE(signs.last(peer));
}

}  // namespace tfdude::fastdds
