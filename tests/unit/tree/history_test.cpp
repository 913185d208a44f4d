#include <chrono>
#include <string>
#include <vector>

#include "tfdude/math/interpolate.hpp"

#include "support/catch.hpp"
#include "support/forest_support.hpp"
#include "support/pose_diff.hpp"
#include "support/random.hpp"
#include "tree/forest.hpp"

namespace tfdude {
namespace {

using testing::along_x;
using testing::Approx;
using testing::outcome;
using testing::transform_diff;
using testing::x_of;
using namespace std::chrono_literals;

Time at(std::int64_t milliseconds) { return Time(Milliseconds(milliseconds)); }

Query query(std::int64_t milliseconds) { return {at(milliseconds), 0ns, {}}; }

Query extrapolating(std::int64_t milliseconds, std::chrono::nanoseconds limit) {
  return {at(milliseconds), limit, {}};
}

double x_of(const Result<StampedTransform>& X) {
  return X ? X->pose.translation().x() : std::numeric_limits<double>::quiet_NaN();
}

std::string message(const Result<StampedTransform>& X) { return X ? "" : X.error().message; }

bool says(const std::string& message, const std::vector<std::string>& parts) {
  return std::all_of(parts.begin(), parts.end(), [&](const std::string& part) {
    return message.find(part) != std::string::npos;
  });
}

// world -> arm -> hand, the edges of arm and hand with samples at 1,000 and 2,000 ms.
struct Arm {
  Arm() {
    REQUIRE(forest.add("world", "", {}));
    REQUIRE(forest.add("base", "world", along_x(1)));
    REQUIRE(forest.add("arm", "base", along_x(7)));
    REQUIRE(forest.add("hand", "arm", along_x(7)));
    for (const int second : {1, 2}) {
      REQUIRE(forest.update("arm", along_x(10 * second), at(1000 * second)));
      REQUIRE(forest.update("hand", along_x(100 * second), at(1000 * second)));
    }
  }
  Result<StampedTransform> hand(const Query& when) const {
    return forest.lookup("world", "hand", when);
  }

  std::int64_t clock_ms = 5000;
  Forest forest{[this] { return at(clock_ms); }};
};

}  // namespace

TEST_CASE("a static edge holds for all times") {
  Forest forest;
  REQUIRE(forest.add("world", "", {}));
  REQUIRE(forest.add("base", "world", along_x(1)));
  for (const std::int64_t when : {1LL, 1'700'000'000'000LL}) {
    const auto X = forest.lookup("world", "base", query(when));
    CHECK(x_of(X) == 1);
    CHECK_FALSE(X->stamp.has_value());
  }
  REQUIRE(forest.update("base", along_x(2)));
  CHECK(x_of(forest.lookup("world", "base", query(1))) == 2);
  CHECK_FALSE(forest.lookup("world", "base", Query{})->stamp.has_value());
}

TEST_CASE("only its samples define the value of a dynamic edge") {
  const Arm arm;
  CHECK(x_of(arm.hand(query(1000))) == 111);
  CHECK(x_of(arm.hand(query(1500))) == Approx(166));
  CHECK(x_of(arm.hand(query(2000))) == 221);
  CHECK(arm.hand(query(1500))->stamp == at(1500));
  CHECK(outcome(arm.hand(query(2001))) == "not_yet");
  CHECK(says(message(arm.hand(query(2001))), {"'hand'", "1.000 ms older", "2.001 s"}));
  CHECK(outcome(arm.hand(query(750))) == "too_old");
  CHECK(says(message(arm.hand(query(750))), {"'hand'", "250.000 ms later"}));
  CHECK(x_of(arm.forest.lookup("world", "base", query(1))) == 1);
}

TEST_CASE("the latest common time is that of all dynamic edges of the path") {
  Arm arm;
  CHECK(arm.hand({})->stamp == at(2000));
  REQUIRE(arm.forest.update("arm", along_x(40), at(3000)));
  CHECK(arm.hand({})->stamp == at(2000));
  CHECK(x_of(arm.hand({})) == 221);
  CHECK(arm.forest.lookup("world", "arm", Query{})->stamp == at(3000));
  CHECK(x_of(arm.forest.lookup("world", "arm")) == 41);
  REQUIRE(arm.forest.update("hand", along_x(500), at(2500)));
  CHECK(arm.hand({})->stamp == at(2500));
  CHECK(x_of(arm.hand({})) == Approx(1 + 30 + 500));
  CHECK(x_of(arm.forest.lookup("world", "hand")) == Approx(531));
  CHECK(arm.forest.lookup_pose("world", "hand")->translation().x() == Approx(531));
}

TEST_CASE("edges without a common time are reported with the name of the younger one") {
  Arm arm;
  REQUIRE(arm.forest.add("tip", "hand", {}));
  REQUIRE(arm.forest.update("tip", along_x(1), at(2003)));
  const auto X = arm.forest.lookup("world", "tip", Query{});
  CHECK(outcome(X) == "too_old");
  CHECK(says(message(X), {"'tip'", "3.000 ms later"}));
}

TEST_CASE("a late sample is added but not one with a taken stamp or one older than the history") {
  Arm arm;
  REQUIRE(arm.forest.update("hand", along_x(1000), at(1500)));
  CHECK(x_of(arm.forest.lookup("arm", "hand", query(1500))) == 1000);
  CHECK(x_of(arm.forest.lookup("arm", "hand", query(1750))) == Approx(600));
  CHECK(x_of(arm.forest.lookup("arm", "hand", query(1250))) == Approx(550));
  CHECK(x_of(arm.forest.lookup("arm", "hand")) == 200);
  const auto twice = arm.forest.update("hand", along_x(3), at(1500));
  CHECK(outcome(twice) == "stamp_taken");
  CHECK(says(twice.error().message, {"'hand'", "1970-01-01 00:00:01.500"}));
  CHECK(outcome(arm.forest.update("hand", along_x(3), at(2000))) == "stamp_taken");
  REQUIRE(arm.forest.update("hand", along_x(300), at(12'000)));
  const auto old = arm.forest.update("hand", along_x(3), at(1999));
  CHECK(outcome(old) == "too_old");
  CHECK(says(old.error().message, {"'hand'", "10001.000 ms older", "10000.000 ms"}));
  REQUIRE(arm.forest.update("hand", along_x(3), at(2001)));
  const auto history = arm.forest.histories("hand").at(0);
  CHECK(history.refused_old == 1);
  CHECK(history.refused_equal == 2);
  CHECK(history.samples == 3);
  CHECK(history.oldest == at(2000));
}

TEST_CASE("a batch has one stamp and is applied as a whole or not at all") {
  Arm arm;
  REQUIRE(arm.forest.update({{"arm", along_x(30)}, {"hand", along_x(300)}}, at(3000)));
  CHECK(x_of(arm.hand({})) == 331);
  CHECK(outcome(arm.forest.update({{"base", along_x(5)}, {"hand", along_x(0)}}, at(3000))) ==
        "stamp_taken");
  CHECK(x_of(arm.forest.lookup("world", "base")) == 1);
  // The later of two for one edge counts, as without stamps; also of a late one.
  for (const std::int64_t when : {4000, 3500}) {
    REQUIRE(arm.forest.update({{"arm", along_x(0)}, {"arm", along_x(50)}}, at(when)));
    CHECK(x_of(arm.forest.lookup("base", "arm", query(when))) == 50);
  }
  CHECK(arm.forest.histories("arm").at(0).samples == 5);
}

TEST_CASE("a history is limited in number and in time") {
  Arm arm;
  EdgeTiming timing;
  timing.count = 5;
  timing.span = 100ms;
  REQUIRE(arm.forest.set_timing("arm", timing));
  CHECK_FALSE(arm.forest.lookup("world", "arm", Query{})->stamp.has_value());
  for (int i = 1; i <= 100; ++i) REQUIRE(arm.forest.update("arm", along_x(i), at(i)));
  CHECK(arm.forest.histories("arm").at(0).samples == 5);
  CHECK(x_of(arm.forest.lookup("base", "arm", query(96))) == 96);
  CHECK(outcome(arm.forest.lookup("base", "arm", query(95))) == "too_old");
  const auto before_all = arm.forest.update("arm", along_x(0), at(95));
  CHECK(outcome(before_all) == "too_old");
  CHECK(says(before_all.error().message, {"'arm'", "1.000 ms older", "the 5 that"}));
  REQUIRE(arm.forest.update("arm", along_x(0), at(250)));
  CHECK(arm.forest.histories("arm").at(0).samples == 1);
  timing.count = 1;
  CHECK(outcome(arm.forest.set_timing("arm", timing)) == "invalid_input");
  timing = {};
  timing.span = 0ms;
  CHECK(outcome(arm.forest.set_timing("arm", timing)) == "invalid_input");
  CHECK(outcome(arm.forest.set_timing("nobody", {})) == "unknown_frame");
}

TEST_CASE("the memory of a history is bounded however many samples come") {
  Arm arm;
  EdgeTiming timing;
  timing.count = 100;
  REQUIRE(arm.forest.set_timing("arm", timing));
  for (int i = 1; i <= 200; ++i) REQUIRE(arm.forest.update("arm", along_x(i), at(i)));
  const std::size_t bytes = arm.forest.histories("arm").at(0).bytes;
  for (int i = 201; i <= 20'000; ++i) REQUIRE(arm.forest.update("arm", along_x(i), at(i)));
  CHECK(arm.forest.histories("arm").at(0).bytes == bytes);
  CHECK(bytes < 100 * 400);
}

TEST_CASE("a lookup beyond the newest sample needs permission to extrapolate") {
  Arm arm;
  CHECK(outcome(arm.hand(extrapolating(2100, 99ms))) == "not_yet");
  CHECK(says(message(arm.hand(extrapolating(2100, 99ms))), {"100.000 ms", "99.000 ms"}));
  CHECK(x_of(arm.hand(extrapolating(2100, 100ms))) == Approx(1 + 21 + 210));
  REQUIRE(arm.forest.add("tip", "hand", {}));
  REQUIRE(arm.forest.update("tip", along_x(1), at(2000)));
  const auto alone = arm.forest.lookup("world", "tip", extrapolating(2001, 1s));
  CHECK(outcome(alone) == "not_yet");
  CHECK(says(message(alone), {"'tip'", "the only one"}));
}

TEST_CASE("an edge is extrapolated no further than its two newest samples carry") {
  Arm arm;
  REQUIRE(arm.forest.add("tip", "hand", {}));
  // A millimetre within a nanosecond would be 50 km after 50 ms.
  REQUIRE(arm.forest.update("tip", along_x(1), at(1990)));
  REQUIRE(arm.forest.update("tip", along_x(1.001), Time(at(1990) + 1ns)));
  const auto far = arm.forest.lookup("hand", "tip", extrapolating(2040, 1h));
  CHECK(outcome(far) == "not_yet");
  CHECK(says(message(far),
             {"'tip'", "50.000 ms older", "too close together", "more than 100 ns", "1.990 s"}));
  Query near = extrapolating(1990, 1h);
  near.at = Time(at(1990) + 101ns);
  CHECK(x_of(arm.forest.lookup("hand", "tip", near)) == Approx(1.101));
  near.at = Time(at(1990) + 102ns);
  CHECK(outcome(arm.forest.lookup("hand", "tip", near)) == "not_yet");
  // A hundred intervals are carried, one more nanosecond is not.
  REQUIRE(arm.forest.update("tip", along_x(2), at(2000)));
  REQUIRE(arm.forest.update("tip", along_x(3), at(2010)));
  CHECK(x_of(arm.forest.lookup("hand", "tip", extrapolating(3010, 1h))) == Approx(103));
  CHECK(outcome(arm.forest.lookup("hand", "tip", extrapolating(3011, 1h))) == "not_yet");
}

TEST_CASE("process noise is added between samples and beyond them and with age if asked for") {
  Arm arm;
  EdgeTiming timing;
  timing.process_noise = *Covariance::from_stddev({2, 0, 0, 0, 0, 0});
  REQUIRE(arm.forest.set_timing("hand", timing));
  for (const int second : {1, 2}) {
    REQUIRE(arm.forest.update("hand", along_x(100 * second), at(1000 * second)));
  }
  const auto variance = [&](const Query& when) {
    return arm.forest.lookup("arm", "hand", when)->covariance.of_specified().upper()[0];
  };
  CHECK(variance(query(2000)) == 0);
  CHECK(variance(query(1500)) == Approx(0.25 * 4));
  CHECK(variance(query(1100)) == Approx(0.09 * 4));
  // The twist is wrong by what the random walk moved within the second before.
  CHECK(variance(extrapolating(2500, 1s)) == Approx(0.5 * (1 + 0.5) * 4));
  CHECK(variance({std::nullopt, 0ns, at(5000)}) == Approx(3 * 4));
  CHECK(variance({at(1500), 0ns, at(1600)}) == Approx((0.25 + 0.1) * 4));
  CHECK(variance({at(1500), 0ns, at(1400)}) == Approx(0.25 * 4));  // not younger than it is
}

TEST_CASE("an update without a stamp is a sample of now only for a dynamic edge") {
  Arm arm;
  REQUIRE(arm.forest.update("arm", along_x(50)));
  CHECK(arm.forest.lookup("world", "arm", Query{})->stamp == at(5000));
  REQUIRE(arm.forest.update("base", along_x(3)));
  CHECK(arm.forest.histories("base").empty());
  // The clock is set back: stamps do not go back, and the newest sample is replaced.
  arm.clock_ms = 3000;
  REQUIRE(arm.forest.update("arm", along_x(60)));
  CHECK(arm.forest.lookup("world", "arm", Query{})->stamp == at(5000));
  CHECK(arm.forest.histories("arm").at(0).samples == 3);
  CHECK(x_of(arm.forest.lookup("base", "arm")) == 60);
  EdgeTiming timing;
  timing.moving = true;
  REQUIRE(arm.forest.set_timing("base", timing));
  REQUIRE(arm.forest.update("base", along_x(4)));
  CHECK(arm.forest.lookup("world", "base", Query{})->stamp == at(3000));
  Forest timeless;
  REQUIRE(timeless.add("world", "", {}));
  REQUIRE(timeless.update("world", {}, at(1)));
  CHECK(outcome(timeless.update("world", {})) == "invalid_input");
  CHECK(outcome(timeless.update("world", {}, Time{})) == "ok");
  CHECK(outcome(timeless.update("world", {}, at(-5))) == "invalid_input");
}

TEST_CASE("the partition's limits apply to frames without their own") {
  int now = 0;
  Forest forest([&] { return at(++now); });
  EdgeTiming timing;
  timing.count = 3;
  timing.moving = true;
  REQUIRE(forest.set_default_timing(timing));
  REQUIRE(forest.add("a", "", {}));
  for (int i = 0; i < 10; ++i) REQUIRE(forest.update("a", along_x(i)));
  CHECK(forest.histories("a").at(0).samples == 3);
  CHECK(forest.histories("a").at(0).count_limit == 3);
}

TEST_CASE("a frame that is moved or removed loses its history") {
  Arm arm;
  REQUIRE(arm.forest.move("hand", "base"));
  CHECK_FALSE(arm.forest.lookup("base", "hand", Query{})->stamp.has_value());
  CHECK(x_of(arm.forest.lookup("base", "hand", query(1))) == 200);
  REQUIRE(arm.forest.update("hand", along_x(1), at(10)));
  CHECK(arm.forest.histories("hand").at(0).samples == 1);
  REQUIRE(arm.forest.remove("arm"));
  REQUIRE(arm.forest.add("arm", "base", along_x(3)));
  CHECK(x_of(arm.forest.lookup("base", "arm", query(1))) == 3);
  CHECK(arm.forest.histories("arm").empty());
  // What hangs elsewhere because a frame above it was moved keeps its history.
  REQUIRE(arm.forest.add("tip", "hand", {}));
  REQUIRE(arm.forest.update("tip", along_x(1), at(1)));
  REQUIRE(arm.forest.update("tip", along_x(2), at(2)));
  REQUIRE(arm.forest.move("hand", "arm"));
  CHECK(x_of(arm.forest.lookup("hand", "tip", query(1))) == 1);
  REQUIRE(arm.forest.update("tip", along_x(3), at(3)));
  CHECK(arm.forest.histories("tip").at(0).samples == 3);
}

TEST_CASE("several segments are answered for one instant and for the hint if possible") {
  Arm arm;
  REQUIRE(arm.forest.update("arm", along_x(40), at(3000)));
  const std::vector<PathEnds> segments{{"base", "arm"}, {"arm", "hand"}, {"world", "base"}};
  const auto newest = arm.forest.lookup_segments(segments, {}, at(1500));
  REQUIRE(newest);
  CHECK(newest->stamp == at(2000));
  CHECK(newest->period == 1000ms);
  CHECK(newest->values.at(0).pose.translation().x() == 20);
  CHECK(newest->values.at(1).pose.translation().x() == 200);
  CHECK(newest->values.at(2).pose.translation().x() == 1);
  REQUIRE(newest->at_hint.values.size() == 3);
  CHECK(newest->at_hint.values[0].pose.translation().x() == Approx(15));
  CHECK(arm.forest.lookup_segments(segments, {}, at(2500))->at_hint.values.empty());
  CHECK(arm.forest.lookup_segments({{"world", "base"}}, {}, at(1))->at_hint.values.empty());
  CHECK_FALSE(arm.forest.lookup_segments({{"world", "base"}})->stamp.has_value());
  CHECK(outcome(arm.forest.lookup_segments(segments, query(2500))) == "not_yet");
  CHECK(arm.forest.lookup_segments(segments, query(1250))->stamp == at(1250));
}

TEST_CASE("a history reports rate and gaps and jitter") {
  Arm arm;
  for (const int ms : {2010, 2020, 2030, 2060}) REQUIRE(arm.forest.update("arm", {}, at(ms)));
  const auto history = arm.forest.histories("arm").at(0);
  CHECK(history.id == "arm");
  CHECK(history.samples == 6);
  CHECK(history.oldest == at(1000));
  CHECK(history.newest == at(2060));
  CHECK(history.max_gap == 1000ms);
  CHECK(history.mean_gap == 212ms);
  CHECK(history.jitter > 390ms);
  CHECK(history.jitter < 400ms);
  CHECK(arm.forest.histories().size() == 2);
  CHECK(arm.forest.histories("nobody").empty());
}

TEST_CASE("settings for samples that may come make no edge a dynamic one") {
  Arm arm;
  EdgeTiming timing;
  timing.count = 500;
  REQUIRE(arm.forest.add("lamp", "world", {}));
  REQUIRE(arm.forest.set_timing("lamp", timing));
  CHECK(arm.forest.histories("lamp").empty());
  CHECK(arm.forest.histories().size() == 2);
  // What was rejected is told, but of no history.
  CHECK(outcome(arm.forest.update("lamp", along_x(1), at(10'000'000))) == "invalid_input");
  REQUIRE(arm.forest.histories("lamp").size() == 1);
  CHECK(arm.forest.histories("lamp").at(0).refused_ahead == 1);
  CHECK(arm.forest.histories("lamp").at(0).count_limit == 0);
  timing.moving = true;
  REQUIRE(arm.forest.add("door", "world", {}));
  REQUIRE(arm.forest.set_timing("door", timing));
  const HistoryInfo door = arm.forest.histories("door").at(0);
  CHECK(door.count_limit == 500);
  CHECK_FALSE(door.newest);
  REQUIRE(arm.forest.update("lamp", along_x(1), at(1000)));
  CHECK(arm.forest.histories("lamp").at(0).count_limit == 500);
}

TEST_CASE("each value is reported once and values of one stamp together") {
  Arm arm;
  std::vector<EdgeCursor> cursors;
  for (const char* id : {"base", "arm", "hand"}) {
    cursors.push_back({id, arm.forest.info(id)->parent});
  }
  const auto told = [&](bool newest_only = false) {
    std::string text;
    for (const PushedValue& one : arm.forest.values_since(cursors, {newest_only}).values) {
      text += std::to_string(one.index) + "@" +
              (one.stamp ? std::to_string(nanoseconds(*one.stamp) / 1'000'000) : "-") + " ";
    }
    return text;
  };
  CHECK(told() == "0@- 1@2000 2@2000 ");
  CHECK(told() == "");
  REQUIRE(arm.forest.update({{"arm", {}}, {"hand", {}}}, at(3000)));
  REQUIRE(arm.forest.update("hand", {}, at(3500)));
  REQUIRE(arm.forest.update({{"arm", {}}, {"hand", {}}}, at(4000)));
  REQUIRE(arm.forest.update("base", along_x(2)));
  CHECK(told() == "0@- 1@3000 2@3000 2@3500 1@4000 2@4000 ");
  REQUIRE(arm.forest.update("hand", {}, at(4500)));
  REQUIRE(arm.forest.update("hand", {}, at(5000)));
  CHECK(told(true) == "2@5000 ");
  REQUIRE(arm.forest.remove("hand"));
  CHECK(told() == "");
}

}  // namespace tfdude
