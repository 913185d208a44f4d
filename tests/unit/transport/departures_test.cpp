#include "transport/fastdds/departures.hpp"

#include "support/catch.hpp"
#include "support/rtps_bytes.hpp"
#include "transport/fastdds/datagram_guard.hpp"
#include "transport/fastdds/farewells.hpp"

namespace tfdude::fastdds {
namespace {

using namespace std::chrono_literals;
using testing::Datagram;

constexpr PeerId kPeer{1, 15, 7};
constexpr PeerId kOther{1, 15, 8};

std::vector<std::uint8_t> farewell() {
  const Farewells::Datagram bytes = Farewells::farewell_of(kPeer);
  return {bytes.begin(), bytes.end()};
}

// As Fast DDS sends a farewell if only the key of the participant is said.
std::vector<std::uint8_t> key_only() {
  auto datagram = Datagram(kPeer);
  datagram.begin(0x15, 0x09).u16(0).u16(16).raw(testing::kParticipantReader);
  datagram.raw(testing::kParticipantWriter).sn(9).raw(std::vector<std::uint8_t>(24)).end();
  return datagram.bytes();
}

std::vector<std::uint8_t> announcement(std::uint32_t lease) {
  Datagram::Bytes list{0, 3, 0, 0, 2, 0, 8, 0};
  for (unsigned at = 0; at < 32; at += 8) {
    list.push_back(static_cast<std::uint8_t>(lease >> at & 0xFFU));
  }
  const Datagram::Bytes end{0, 0, 0, 0, 1, 0, 0, 0};
  list.insert(list.end(), end.begin(), end.end());
  return Datagram(kPeer)
      .data(testing::kParticipantReader, testing::kParticipantWriter, 1, list)
      .bytes();
}

struct Guarded {
  explicit Guarded(bool secured = true) : guard(secured) {}
  DatagramGuard guard;
  DatagramGuard::Clock::time_point now{1h};

  bool admits(const std::vector<std::uint8_t>& datagram) {
    bool admitted = false;
    guard.receive(
        datagram.data(), datagram.size(), now, [] { return "a stranger"; },
        [&](const DatagramGuard::Bytes*, std::size_t) { admitted = true; });
    return admitted;
  }
  std::vector<PeerId> departed() {
    std::vector<PeerId> all;
    guard.take_departed(now, [&](const PeerId& peer) { all.push_back(peer); });
    return all;
  }
};

}  // namespace

TEST_CASE("departures: with keys, only who is silent afterwards has left") {
  for (const auto& leaves : {farewell(), key_only()}) {
    Guarded keys;
    CHECK_FALSE(keys.admits(leaves));
    keys.now += 999ms;
    CHECK(keys.departed().empty());
    keys.now += 2ms;
    CHECK(keys.departed() == std::vector<PeerId>{kPeer});
    CHECK(keys.departed().empty());
    CHECK(keys.guard.refused() == 0);
  }
}

TEST_CASE(
    "departures: who goes on announcing itself stays, however often a stranger says otherwise") {
  Guarded keys;
  for (int i = 0; i < 100; ++i) {
    keys.now += 100ms;
    CHECK_FALSE(keys.admits(farewell()));
    if (i % 3 == 0) CHECK(keys.admits(announcement(30)));
    CHECK(keys.departed().empty());
  }
}

TEST_CASE("departures: what was sent before, and others, do not keep a participant") {
  Guarded keys;
  CHECK_FALSE(keys.admits(farewell()));
  keys.now += 20ms;
  CHECK(keys.admits(announcement(30)));
  keys.now += 500ms;
  const Datagram::Bytes list{0, 3, 0, 0, 1, 0, 0, 0};
  CHECK(keys.admits(Datagram(kOther)
                        .data(testing::kParticipantReader, testing::kParticipantWriter, 1, list)
                        .bytes()));
  keys.now += 500ms;
  CHECK(keys.departed().size() == 1);
}

TEST_CASE("departures: many are remembered, and no more") {
  Departures departures;
  DatagramGuard::Clock::time_point now{1h};
  for (std::uint8_t a = 0; a < 8; ++a) {
    for (int b = 0; b < 256; ++b) departures.said({a, static_cast<std::uint8_t>(b)}, now);
  }
  std::size_t left = 0;
  departures.take(now + 2s, [&](const PeerId&) { ++left; });
  CHECK(left == Departures::kMost);
}

TEST_CASE("departures: without keys Fast DDS is told at once") {
  Guarded open(false);
  CHECK(open.admits(key_only()));
  CHECK(open.admits(announcement(0)));
  open.now += 2s;
  CHECK(open.departed().empty());
}

TEST_CASE("departures: with keys, an announcement cannot make a participant be lost at once") {
  Guarded keys;
  CHECK_FALSE(keys.admits(announcement(0)));
  CHECK_FALSE(keys.admits(announcement(0xFFFFFFFFU)));
  CHECK(keys.admits(announcement(10)));
  CHECK(keys.admits(announcement(0x7FFFFFFFU)));
}

TEST_CASE("departures: Fast DDS hears of them when nobody is being discovered, or after a while") {
  Farewells farewells;
  Farewells::Clock::time_point now{1h};
  using When = Farewells::When;
  const auto taken = [&] {
    int all = 0;
    farewells.take([&](const Farewells::Datagram&) { ++all; });
    return all;
  };
  farewells.busy(now);
  farewells.say_for(kPeer);
  CHECK(farewells.when(now) == When::kLater);
  now += Farewells::kQuiet;
  CHECK(farewells.when(now) == When::kNow);
  CHECK(taken() == 1);
  CHECK(farewells.when(now) == When::kLater);
  CHECK(taken() == 0);
  for (int i = 0; i < 2; ++i) {
    farewells.say_for(kPeer);
    farewells.say_for(kOther);
    const auto begin = now;
    while (now < begin + Farewells::kPatience) {
      farewells.busy(now);
      REQUIRE(farewells.when(now) == When::kLater);
      now += 10ms;
    }
    CHECK(farewells.when(now) == When::kOnceQuiet);
    CHECK(taken() == 2);
  }
}

}  // namespace tfdude::fastdds
