#include "transport/fastdds/crowd.hpp"

#include <algorithm>
#include <cstring>

#include "support/catch.hpp"

namespace tfdude::fastdds {
namespace {

using namespace std::chrono_literals;

PeerId peer(std::uint32_t n) {
  PeerId id{1, 15};
  std::memcpy(id.data() + 8, &n, sizeof n);
  return id;
}

std::vector<PeerId> left(Crowd& crowd) {
  std::vector<PeerId> all;
  crowd.take([&](const PeerId& one) { all.push_back(one); });
  return all;
}

}  // namespace

TEST_CASE("crowd: whoever announces itself stays, however many announcements are made up") {
  Crowd crowd;
  Crowd::Clock::time_point now{1h};
  constexpr std::uint32_t kHonest = 40;
  std::uint32_t made_up = kHonest;
  std::size_t in_room = 0;
  for (int i = 0; i < 600; ++i) {
    now += 100ms;
    for (std::uint32_t one = 0; i % 3 == 0 && one < kHonest; ++one) {
      REQUIRE(crowd.admit(peer(one), now));
    }
    for (int more = 0; more < 200; ++more) in_room += crowd.admit(peer(++made_up), now) ? 1U : 0U;
    for (const PeerId& one : left(crowd)) {
      --in_room;
      for (std::uint32_t honest = 0; honest < kHonest; ++honest) REQUIRE(one != peer(honest));
    }
    REQUIRE(in_room + kHonest <= Crowd::kMost);
  }
}

TEST_CASE("crowd: a new one gets in when others have been silent") {
  Crowd crowd;
  Crowd::Clock::time_point now{1h};
  for (std::uint32_t n = 0; n < Crowd::kMost; ++n) CHECK(crowd.admit(peer(n), now));
  CHECK_FALSE(crowd.admit(peer(9999), now + 300ms));
  CHECK(left(crowd).empty());
  CHECK(crowd.admit(peer(3), now + 5s));
  CHECK(crowd.admit(peer(9999), now + 10s + 300ms));
  CHECK(left(crowd).size() == Crowd::kMost - 1);
  CHECK(left(crowd).empty());
}

TEST_CASE("crowd: who has left makes room at once") {
  for (const bool verifies : {false, true}) {
    Crowd crowd(verifies);
    const Crowd::Clock::time_point now{1h};
    for (std::uint32_t n = 0; n < 4 * Crowd::kMost; ++n) {
      REQUIRE(crowd.admit(peer(n), now));
      // Most are verified before.
      if (n % 7 != 0) crowd.verified(peer(n));
      if (n % 9 != 0) continue;
      for (std::uint32_t gone = n < 9 ? 0 : n - 9; gone <= n; ++gone) crowd.left(peer(gone));
    }
    CHECK(left(crowd).empty());
  }
}

TEST_CASE("crowd: with keys, who is silent leaves before its lease ends") {
  for (const bool verifies : {false, true}) {
    Crowd crowd(verifies);
    const Crowd::Clock::time_point now{1h};
    REQUIRE(crowd.admit(peer(1), now));
    for (auto later = now; later <= now + 20s; later += 300ms) {
      CHECK(left(crowd).empty());
      REQUIRE(crowd.admit(peer(2), later));
    }
    REQUIRE(crowd.admit(peer(2), now + 23s));
    CHECK(left(crowd).size() == (verifies ? 1 : 0));
  }
}

TEST_CASE("crowd: with keys, few are not verified at a time, and only for a while") {
  Crowd crowd(true);
  Crowd::Clock::time_point now{1h};
  std::uint32_t next = 0;
  // Those that are verified at once do not count.
  for (; next < 200; ++next) {
    REQUIRE(crowd.admit(peer(next), now));
    crowd.verified(peer(next));
    crowd.verified(peer(next));
  }
  const std::uint32_t honest = next;
  for (std::size_t i = 0; i < Crowd::kMostUnverified; ++i) {
    REQUIRE(crowd.admit(peer(next++), now));
  }
  CHECK_FALSE(crowd.admit(peer(9999), now));
  // They go on announcing themselves.
  for (std::uint32_t one = 0; one < next; ++one) CHECK(crowd.admit(peer(one), now + 2s));
  CHECK_FALSE(crowd.admit(peer(9999), now + 2s));
  CHECK(left(crowd).empty());
  CHECK(crowd.admit(peer(9999), now + 4s));
  const auto gone = left(crowd);
  CHECK(gone.size() == Crowd::kMostUnverified);
  for (const PeerId& one : gone) {
    for (std::uint32_t i = 0; i < honest; ++i) REQUIRE(one != peer(i));
  }
}

}  // namespace tfdude::fastdds
