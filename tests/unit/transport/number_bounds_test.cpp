#include "transport/fastdds/number_bounds.hpp"

#include <cstring>

#include "support/catch.hpp"
#include "support/rtps_bytes.hpp"

namespace tfdude::fastdds {
namespace {

using namespace std::chrono_literals;

using Kind = NumberClaim::Kind;

constexpr NumberClaim::Prefix kSender{1, 15, 2, 3};

struct Heard {
  NumberBounds bounds;
  NumberBounds::Clock::time_point now{1h};

  bool claim(Kind kind, std::uint64_t first, std::uint64_t last, std::uint32_t count = 0,
             const NumberClaim::Entity& writer = testing::kUserWriter) {
    return bounds.admit({kind, kSender, writer, first, last, count, 0, 0}, now);
  }
  bool data(std::uint64_t number) { return claim(Kind::kData, number, number); }
  bool heartbeat(std::uint64_t first, std::uint64_t last) {
    return claim(Kind::kHeartbeat, first, last, ++beats);
  }
  bool gap(std::uint64_t first, std::uint64_t last) { return claim(Kind::kGap, first, last); }

  std::uint32_t beats = 0;
};

}  // namespace

TEST_CASE("number bounds: a writer may advance by what it can have written") {
  Heard heard;
  CHECK(heard.data(1));
  CHECK(heard.data(1 + kLongestRange));
  CHECK_FALSE(heard.data(1'000'000));
  CHECK_FALSE(heard.heartbeat(1ULL << 60U, 1ULL << 60U));
  heard.now += 30s;  // not heard for long
  CHECK(heard.data(30'000'000));
  CHECK_FALSE(heard.data(61'000'000));
  CHECK(heard.data(5));  // one that was repeated
}

TEST_CASE("number bounds: a writer that is first heard late has a number to begin with") {
  Heard heard;
  CHECK_FALSE(heard.heartbeat(NumberBounds::kFirst + 1, NumberBounds::kFirst + 1));
  CHECK(heard.heartbeat(NumberBounds::kFirst - 9, NumberBounds::kFirst));
  CHECK(heard.data(NumberBounds::kFirst + 1));
  CHECK_FALSE(
      heard.claim(Kind::kHeartbeat, 1ULL << 30U, 1ULL << 30U, 1, testing::kPublicationsWriter));
  CHECK(heard.claim(Kind::kHeartbeat, 9'000, 9'009, 1, testing::kPublicationsWriter));
}

// Each number that comes too early is kept by Fast DDS.
TEST_CASE("number bounds: gaps reach as far as a history may, however many there are") {
  Heard heard;
  REQUIRE(heard.heartbeat(1, 10));
  std::uint64_t reached = 0;
  for (std::uint64_t start = 3; start < 100 * kLongestRange; start += kLongestRange / 4) {
    heard.now += 1s;
    if (heard.gap(start, start + kLongestRange / 4 - 1)) reached = start;
  }
  CHECK(reached <= kLongestRange);
  CHECK(reached > kLongestRange / 2);
  // Those of a reader that comes late begin where the history does.
  Heard late;
  CHECK(late.gap(5'000'000, 5'000'063));
  CHECK(late.heartbeat(5'000'064, 5'000'063));
  CHECK(late.gap(5'000'064, 5'000'099));
}

TEST_CASE("number bounds: a heartbeat that Fast DDS ignores does not widen the range of gaps") {
  Heard heard;
  REQUIRE(heard.claim(Kind::kHeartbeat, 1, 10, 7));
  for (std::uint64_t first = 60'000; first <= 600'000; first += 60'000) {
    CHECK(heard.claim(Kind::kHeartbeat, first, first, 7));
  }
  CHECK_FALSE(heard.gap(600'000, 600'001));
}

TEST_CASE("number bounds: a process with the same GUID begins again") {
  Heard heard;
  REQUIRE(heard.claim(Kind::kHeartbeat, 500'000, 500'010, 900));
  CHECK(heard.claim(Kind::kHeartbeat, 1, 3, 1));
  CHECK(heard.gap(2, 3));
  CHECK_FALSE(heard.gap(499'000, 499'001));
}

// Fast DDS walks from the oldest sample to the one that was acknowledged, when a reader that keeps
// samples starts again.
TEST_CASE("number bounds: only what was sent is acknowledged") {
  Heard heard;
  constexpr std::uint64_t kSlack = NumberBounds::kUnannounced;
  const auto send = [&](std::uint64_t last) {
    heard.bounds.send({Kind::kHeartbeat, {}, testing::kUserWriter, 1, last, 1, 0, 0});
  };
  const auto acknowledged = [&](std::uint64_t first, const NumberClaim::Entity& writer) {
    return heard.claim(Kind::kAcknowledgement, first, first, 0, writer);
  };
  send(20);
  CHECK(acknowledged(21 + kSlack, testing::kUserWriter));
  CHECK_FALSE(acknowledged(22 + kSlack, testing::kUserWriter));
  send(21);
  CHECK(acknowledged(22 + kSlack, testing::kUserWriter));
  CHECK(acknowledged(0, testing::kPublicationsWriter));
  CHECK(acknowledged(1, testing::kPublicationsWriter));
  CHECK_FALSE(acknowledged(1ULL << 40U, testing::kPublicationsWriter));
}

TEST_CASE("number bounds: what discovery sends in fragments is small") {
  Heard heard;
  const auto fragments = [&](const NumberClaim::Entity& writer, std::uint32_t sample) {
    return heard.bounds.admit({Kind::kFragments, kSender, writer, 3, 3, 0, sample, 1000},
                              heard.now);
  };
  CHECK(fragments(testing::kUserWriter, kLargestSample));
  CHECK(fragments(testing::kPublicationsWriter, NumberBounds::kLargestOfDiscovery));
  CHECK_FALSE(fragments(testing::kPublicationsWriter, NumberBounds::kLargestOfDiscovery + 1));
}

TEST_CASE("number bounds: whoever fills the table is only himself forgotten or newly met") {
  Heard heard;
  REQUIRE(heard.data(100));
  for (std::uint32_t i = 0; i < 4 * NumberBounds::kRoom; ++i) {
    NumberClaim::Prefix prefix{};
    std::memcpy(prefix.data(), &i, sizeof i);
    heard.now += 1us;
    CHECK(
        heard.bounds.admit({Kind::kData, prefix, testing::kUserWriter, 1, 1, 0, 0, 0}, heard.now));
  }
  CHECK(heard.data(101));
}

}  // namespace tfdude::fastdds
