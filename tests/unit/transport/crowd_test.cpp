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

}  // namespace tfdude::fastdds
