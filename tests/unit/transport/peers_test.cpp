#include "transport/fastdds/peers.hpp"

#include <chrono>
#include <cstdint>
#include <thread>
#include <vector>

#include "support/catch.hpp"

namespace tfdude::fastdds {
namespace {

ertps::GuidPrefix_t prefix_of(unsigned char number) {
  ertps::GuidPrefix_t prefix;
  prefix.value[0] = number;
  return prefix;
}

Presence presence_of(const std::string& partition) {
  return {partition, 1, "tower", 4711, 1, true};
}

Announcement serving(const std::string& partition, ProtocolVersion protocol = kProtocolVersion) {
  return {partition, protocol, "9.8.7"};
}

}  // namespace

TEST_CASE("who speaks another major version is named, and counts as nobody") {
  int told = 0;
  Peers peers([&](const Presence&) { ++told; }, [&](const Presence&) { ++told; });
  peers.configure(std::chrono::seconds(60), std::chrono::seconds(60), false);
  peers.met(prefix_of(1), serving("arms", {2, 0}));
  peers.met(prefix_of(2), serving("", {2, 0}));
  peers.met(prefix_of(3), serving("head"));
  CHECK(peers.is_incompatible(prefix_of(1)));
  CHECK(peers.is_incompatible(prefix_of(2)));
  CHECK_FALSE(peers.is_incompatible(prefix_of(3)));
  REQUIRE(peers.incompatible().size() == 1);  // clients own nothing
  CHECK(peers.incompatible()[0].partition == "arms");
  CHECK(peers.incompatible()[0].text() ==
        "partition 'arms' (tf-dude 9.8.7) speaks protocol 2.0, but this program (tf-dude " +
            program_version() + ") speaks 1.0; update the older one");
  peers.present(prefix_of(3), presence_of("head"), 0, true);
  CHECK_FALSE(peers.awaits_presence());
  told = 0;
  peers.left(prefix_of(1));
  CHECK(peers.incompatible().empty());
  CHECK_FALSE(peers.is_incompatible(prefix_of(1)));
  CHECK(told == 0);
}

TEST_CASE("who was met counts as all there are only once its beats say how many it hears") {
  Peers peers([](const Presence&) {}, [](const Presence&) {});
  peers.configure(std::chrono::seconds(60), std::chrono::seconds(60), false);
  peers.met(prefix_of(1), serving("arms"));
  // As it was when it was written, before the sender had met anybody.
  peers.present(prefix_of(1), presence_of("arms"), 0, false);
  std::this_thread::sleep_for(Peers::kQuiet);
  REQUIRE_FALSE(peers.awaits_presence());
  CHECK_FALSE(peers.discovered());
  SECTION("none") {
    peers.present(prefix_of(1), presence_of("arms"), 0, true);
    CHECK(peers.discovered());
  }
  SECTION("another, who is to be met first") {
    peers.present(prefix_of(1), presence_of("arms"), 1, true);
    CHECK_FALSE(peers.discovered());
    peers.met(prefix_of(2), serving("head"));
    peers.present(prefix_of(2), presence_of("head"), 1, true);
    std::this_thread::sleep_for(Peers::kQuiet);
    CHECK(peers.discovered());
  }
}

TEST_CASE("who sends a page and then nothing is gone, and not waited for") {
  std::vector<std::uint64_t> gone;
  Peers peers([](const Presence&) {},
              [&](const Presence& one) { gone.push_back(one.incarnation); });
  peers.configure(std::chrono::seconds(60), std::chrono::seconds(60), false);
  peers.met(prefix_of(1), serving("arms"));
  Page page;
  page.partition = "arms";
  page.incarnation = 7;
  peers.sent_page(prefix_of(1), page);
  CHECK(peers.awaits_presence());
  // Looked at in time, until it has been silent for too long.
  const auto start = Peers::Clock::now();
  for (auto late = Peers::kSpeakEvery; late < std::chrono::seconds(62);
       late += Peers::kSpeakEvery) {
    peers.look_for_silent(start + late);
  }
  CHECK_FALSE(peers.awaits_presence());
  CHECK(gone == std::vector<std::uint64_t>{7});
  SECTION("it has only been slow") {
    Presence late = presence_of("arms");
    late.incarnation = 8;
    peers.present(prefix_of(1), late, 0, true);
    peers.left(prefix_of(1));
    CHECK(gone == std::vector<std::uint64_t>{7, 8});
  }
  SECTION("it is told of once") {
    peers.left(prefix_of(1));
    CHECK(gone.size() == 1);
  }
}

TEST_CASE(
    "who sends a page of a later process than it has said, and then leaves, is gone as that") {
  std::vector<std::uint64_t> gone;
  Peers peers([](const Presence&) {},
              [&](const Presence& one) { gone.push_back(one.incarnation); });
  peers.configure(std::chrono::seconds(60), std::chrono::seconds(60), false);
  peers.met(prefix_of(1), serving("arms"));
  // While it claims its name; it serves under another number.
  peers.present(prefix_of(1), presence_of("arms"), 0, false);
  Page page;
  page.partition = "arms";
  page.incarnation = 7;
  peers.sent_page(prefix_of(1), page);
  peers.left(prefix_of(1));
  CHECK(gone == std::vector<std::uint64_t>{7});
}

TEST_CASE("who was met and has told nothing yet is waited for") {
  Peers peers([](const Presence&) {}, [](const Presence&) {});
  peers.configure(std::chrono::seconds(1), std::chrono::seconds(1), false);
  peers.met(prefix_of(1), serving("arms"));
  const auto start = Peers::Clock::now();
  for (auto late = Peers::kSpeakEvery; late < std::chrono::seconds(9); late += Peers::kSpeakEvery) {
    peers.look_for_silent(start + late);
  }
  CHECK(peers.awaits_presence());
}

}  // namespace tfdude::fastdds
