// Implausible stamps: in the future, from a clock that has jumped back, at the ends of the type.

#include <chrono>
#include <limits>
#include <string>
#include <vector>

#include "support/catch.hpp"
#include "support/forest_support.hpp"
#include "tree/forest.hpp"

namespace tfdude {
namespace {

using testing::along_x;
using testing::ContainsSubstring;
using testing::outcome;
using namespace std::chrono_literals;

constexpr Time kNow{1'700'000'000s};
constexpr std::int64_t kLast = INT64_MAX;
constexpr std::int64_t kFirst = INT64_MIN;

struct Arm {
  explicit Arm(const EdgeTiming& timing = {}) {
    REQUIRE(forest.set_default_timing(timing));
    REQUIRE(forest.add("world", "", {}));
    REQUIRE(forest.add("arm", "world", along_x(7)));
    REQUIRE(forest.add("hand", "arm", along_x(7)));
    forest.on_restart([this](const HistoryRestart& one) { restarts.push_back(one); });
  }
  Result<void> sample(double x, Time stamp) { return forest.update("arm", along_x(x), stamp); }
  /// Where the arm is, by its newest sample.
  double x() const { return testing::x_of(forest.lookup("world", "arm")); }
  HistoryInfo history(const std::string& id = "arm") const {
    const auto histories = forest.histories(id);
    return histories.empty() ? HistoryInfo() : histories.front();
  }

  Time clock = kNow;
  Forest forest{[this] { return clock; }};
  std::vector<HistoryRestart> restarts;
};

double x_of(const Result<StampedTransform>& X) {
  return X ? X->pose.translation().x() : std::numeric_limits<double>::quiet_NaN();
}

EdgeTiming kept_for(std::chrono::nanoseconds span, std::size_t restart_after = 5) {
  EdgeTiming timing;
  timing.span = span;
  timing.restart_after = restart_after;
  return timing;
}

}  // namespace

TEST_CASE("without a stamp a static edge stays static in an update of dynamic ones") {
  Arm arm;
  REQUIRE(arm.sample(1, kNow - 2s));
  arm.clock = kNow - 1s;
  const bool by_handle = GENERATE(false, true);
  if (by_handle) {
    const Handle moving = *arm.forest.find("arm");
    const Handle fixed = *arm.forest.find("hand");
    REQUIRE(arm.forest.update(std::vector<HandleUpdate>{{fixed, along_x(5)}, {moving, along_x(2)}},
                              {}));
  } else {
    REQUIRE(
        arm.forest.update(std::vector<EdgeUpdate>{{"hand", along_x(5)}, {"arm", along_x(2)}}, {}));
  }
  CHECK(arm.history().samples == 2);
  CHECK_FALSE(arm.history("hand").dynamic());
  arm.clock = kNow;
  REQUIRE(arm.sample(3, kNow));
  Query query;
  CHECK(x_of(arm.forest.lookup("world", "hand", query)) == 8);
  query.at = kNow - 2s;
  CHECK(x_of(arm.forest.lookup("world", "hand", query)) == 6);
}

TEST_CASE("a stamp from the future is rejected and the error names both times") {
  Arm arm;
  // The edge is still static.
  const auto first = arm.sample(1, time_of(9'000'000'000'000'000'000));
  REQUIRE_FALSE(first);
  CHECK(first.error().code == Errc::kInvalidInput);
  CHECK_THAT(first.error().message, ContainsSubstring("'arm'") && ContainsSubstring("2255-03-14") &&
                                        ContainsSubstring("2023-11-14 22:13:20.000 UTC") &&
                                        ContainsSubstring("more than the 60.0 s allowed"));
  CHECK(arm.x() == 7);
  CHECK(arm.history().refused_ahead == 1);
  REQUIRE(arm.sample(1, kNow));
  CHECK_FALSE(arm.sample(2, kNow + 60s + 1ns));
  REQUIRE(arm.sample(3, kNow + 60s));
  CHECK(arm.history().refused_ahead == 2);
  CHECK(arm.history().newest == kNow + 60s);
  // All edges of an update, or none.
  CHECK_FALSE(arm.forest.update(std::vector<EdgeUpdate>{{"arm", {}}, {"hand", {}}}, kNow + 99s));
  CHECK(arm.history("hand").samples == 0);
  arm.clock += 39s;
  REQUIRE(arm.sample(4, kNow + 99s));
  CHECK(arm.x() == 4);
}

TEST_CASE("each edge limits how far ahead a stamp may be") {
  Arm arm;
  EdgeTiming timing;
  timing.max_ahead = 0ns;
  REQUIRE(arm.forest.set_timing("arm", timing));
  CHECK_FALSE(arm.sample(1, kNow + 1ns));
  REQUIRE(arm.sample(1, kNow));
  timing.max_ahead = std::chrono::nanoseconds::max();
  REQUIRE(arm.forest.set_timing("arm", timing));
  REQUIRE(arm.sample(2, time_of(kLast)));
  REQUIRE(arm.forest.update("hand", along_x(1), kNow + 60s));
  timing.max_ahead = -1ns;
  CHECK_FALSE(arm.forest.set_timing("arm", timing));
  // Without a clock there is nothing to compare with.
  Forest plain;
  REQUIRE(plain.add("arm", "", {}));
  CHECK(plain.update("arm", {}, time_of(kLast)));
}

TEST_CASE("a clock that is set back is noticed") {
  Arm arm;
  REQUIRE(arm.sample(0, kNow));
  arm.clock -= 1h;
  int taken = 0;
  while (taken < 1000 && arm.sample(1, kNow + Milliseconds(taken + 1))) ++taken;
  CHECK(taken < 64);
}

TEST_CASE("an observation with a stamp from the future is rejected") {
  Arm arm;
  REQUIRE(arm.sample(1, kNow));
  CHECK_FALSE(arm.forest.revise({{"arm", along_x(2), {}}}, kNow + 1h, UINT64_MAX));
  CHECK(arm.x() == 1);
}

TEST_CASE("stamps at the ends of the type cause no overflow") {
  EdgeTiming timing = kept_for(std::chrono::nanoseconds::max());
  timing.max_ahead = std::chrono::nanoseconds::max();
  timing.process_noise = *Covariance::from_stddev({1, 1, 1, 1, 1, 1});
  Arm arm(timing);
  for (const std::int64_t stamp : {kFirst, kFirst + 1, std::int64_t{-1}}) {
    CHECK(outcome(arm.sample(1, time_of(stamp))) == "invalid_input");
  }
  for (const std::int64_t stamp : {kLast, std::int64_t{0}, kLast - 1, std::int64_t{2}}) {
    REQUIRE(arm.sample(static_cast<double>(stamp % 1000), time_of(stamp)));
  }
  CHECK(arm.history().samples == 4);
  for (const std::int64_t at : {kFirst, std::int64_t{-1}, std::int64_t{0}, std::int64_t{1},
                                std::int64_t{3}, kLast - 1, kLast}) {
    for (const std::int64_t other : {kFirst, std::int64_t{0}, kLast}) {
      const Query query{time_of(at), std::chrono::nanoseconds(other), time_of(other),
                        Order::kSecond};
      const auto found = arm.forest.lookup("world", "arm", query);
      CHECK(found.has_value() == (at >= 0));
      if (!found) CHECK(found.error().code == Errc::kTooOld);
      (void)arm.forest.lookup_segments({{"world", "arm"}}, query, time_of(other));
    }
  }
  // The clock's own stamp cannot be later than the last, whose value is replaced.
  CHECK(outcome(arm.forest.update("arm", along_x(5))) == "ok");
  CHECK(arm.history().newest == time_of(kLast));
  CHECK(arm.x() == 5);
}

TEST_CASE("consecutive samples from a clock that jumped back restart the history") {
  Arm arm(kept_for(10s));
  for (int i = 0; i < 100; ++i) REQUIRE(arm.sample(i, kNow + i * 10ms));
  const Time back = kNow - 1h;
  for (int i = 0; i < 4; ++i) {
    CHECK(outcome(arm.sample(1000 + i, back + i * 10ms)) == "too_old");
  }
  CHECK(arm.x() == 99);
  CHECK(arm.history().refused_old == 4);
  CHECK(arm.restarts.empty());
  REQUIRE(arm.sample(1004, back + 40ms));
  REQUIRE(arm.restarts.size() == 1);
  CHECK(arm.restarts[0].id == "arm");
  CHECK(arm.restarts[0].newest == kNow + 990ms);
  CHECK(arm.restarts[0].stamp == back + 40ms);
  CHECK(arm.x() == 1004);
  CHECK(arm.history().samples == 1);
  CHECK(arm.history().refused_old == 4);
  for (int i = 5; i < 50; ++i) REQUIRE(arm.sample(1000 + i, back + i * 10ms));
  CHECK(arm.history().samples == 46);
  CHECK(x_of(arm.forest.lookup("world", "arm", {back + 45ms, 0ns, {}})) == 1004.5);
  CHECK_FALSE(arm.forest.lookup("world", "arm", {kNow, 0ns, {}}));
  CHECK(arm.restarts.size() == 1);
}

TEST_CASE("stray samples never restart a history") {
  Arm arm(kept_for(10s));
  REQUIRE(arm.sample(0, kNow));
  const Time back = kNow - 1h;
  double x = 0;  // of the newest sample
  SECTION("of an old source beside a current one") {
    for (int i = 1; i < 1000; ++i) {
      if (i % 4 == 0) REQUIRE(arm.sample(i, kNow + i * 1ms));
      CHECK_FALSE(arm.sample(-1, back + i * 1ms));
    }
    x = 996;
  }
  SECTION("beside late samples that are accepted") {
    for (int i = 1; i < 1000; ++i) {
      if (i % 4 == 0) REQUIRE(arm.sample(0, kNow - i * 1ms));
      CHECK_FALSE(arm.sample(-1, back + i * 1ms));
    }
  }
  SECTION("in random order") {
    for (int i = 1; i < 1000; ++i) CHECK_FALSE(arm.sample(-1, back - i * 1ms));
  }
  SECTION("of one stamp") {
    for (int i = 1; i < 1000; ++i) CHECK_FALSE(arm.sample(-1, back));
  }
  SECTION("if restarts are switched off") {
    REQUIRE(arm.forest.set_timing("arm", kept_for(10s, 0)));
    REQUIRE(arm.sample(0, kNow));
    for (int i = 1; i < 1000; ++i) CHECK_FALSE(arm.sample(-1, back + i * 1ms));
  }
  SECTION("of small jumps within the history") {
    REQUIRE(arm.sample(0, kNow + 1s));
    for (int i = 1; i < 1000; ++i) REQUIRE(arm.sample(-1, kNow - 8s + i * 1ms));
  }
  CHECK(arm.x() == x);
  CHECK(arm.restarts.empty());
}

TEST_CASE("edges that are updated together restart together") {
  Arm arm(kept_for(10s, 3));
  const std::vector<EdgeUpdate> both{{"arm", along_x(1)}, {"hand", along_x(2)}};
  REQUIRE(arm.forest.update(both, kNow));
  const Time back = kNow - 1h;
  // The hand has been ahead by one sample.
  CHECK_FALSE(arm.forest.update("hand", along_x(3), back));
  CHECK_FALSE(arm.forest.update(both, back + 1ms));
  CHECK_FALSE(arm.forest.update(both, back + 2ms));
  CHECK(arm.restarts.empty());
  REQUIRE(arm.forest.update(both, back + 3ms));
  CHECK(arm.restarts.size() == 2);
  CHECK(arm.history("hand").newest == back + 3ms);
  CHECK(testing::x_of(arm.forest.lookup("world", "hand")) == 3);
}

TEST_CASE("a history restarts as often as its source does") {
  Arm arm(kept_for(1s, 1));
  for (int round = 0; round < 200; ++round) {
    for (int i = 0; i < 20; ++i) REQUIRE(arm.sample(i, kNow - 1h + i * 200ms));
    CHECK(arm.x() == 19);
    CHECK(arm.history().samples == 6);
  }
  CHECK(arm.restarts.size() == 199);
}

}  // namespace tfdude
