// What errors about an instant say: which edge limits, what it has, and when all edges have data.

#include <optional>
#include <string>
#include <tuple>

#include "support/catch.hpp"
#include "support/forest_support.hpp"
#include "tree/forest.hpp"

namespace tfdude {
namespace {

using namespace std::chrono_literals;
using testing::along_x;
using testing::ContainsSubstring;

constexpr Time kNow{1'795'677'150s};  // 2026-11-26 07:12:30 UTC

Query at(Time when, std::chrono::nanoseconds beyond = 0ns) { return {when, beyond, {}}; }

// world -> arm -> hand -> tool, all with samples.
struct Robot {
  explicit Robot(Time start) : start_(start) {
    REQUIRE(forest.add("world", "", {}));
    REQUIRE(forest.add("mast", "world", {}));
    REQUIRE(forest.add("arm", "mast", {}));
    REQUIRE(forest.add("hand", "arm", {}));
    REQUIRE(forest.add("tool", "hand", {}));
    REQUIRE(forest.set_default_timing(timing()));
  }
  static EdgeTiming timing() {
    EdgeTiming all;
    all.span = 24h;
    all.max_ahead = std::chrono::nanoseconds::max();
    return all;
  }
  void sample(const std::string& id, std::chrono::nanoseconds when) {
    REQUIRE(forest.update(id, along_x(1), start_ + when));
  }
  std::string why(const std::string& a, const std::string& b, const Query& query) const {
    const auto X = forest.lookup(a, b, query);
    return X ? "found" : std::string(to_string(X.error().code)) + ": " + X.error().message;
  }

  Time start_;
  std::optional<Time> now;
  Forest forest{[this] { return now; }};
};

}  // namespace

TEST_CASE("no data: an instant before the history") {
  Robot robot(kNow);
  robot.now = kNow;
  robot.sample("hand", -12'345ms);
  robot.sample("hand", -100ms);
  CHECK(robot.why("world", "hand", at(kNow - 15s)) ==
        "too_old: the edge of 'hand' has no data for 2026-11-26 07:12:15.000 UTC (15.0 s ago): its "
        "oldest sample is 2.655 s later; it has samples from 2026-11-26 07:12:17.655 to "
        "07:12:29.900 UTC (12.3 s ago to 100.000 ms ago)");
}

TEST_CASE("no data: an instant after the newest sample") {
  Robot robot(kNow);
  robot.now = kNow;
  robot.sample("hand", -200s);
  const std::string samples = "; it has one sample, of 2026-11-26 07:09:10.000 UTC (3.3 min ago)";
  const std::string head =
      "not_yet: the edge of 'hand' has no data for 2026-11-26 07:12:30.500 UTC (in 500.000 ms): "
      "its newest sample is 3.3 min older";
  CHECK(robot.why("world", "hand", at(kNow + 500ms)) == head + samples);
  CHECK(robot.why("world", "hand", at(kNow + 500ms, 2s)) ==
        head + ", and the extrapolation limit is 2.000 s" + samples);
  CHECK(robot.why("world", "hand", at(kNow + 500ms, 1h)) ==
        head + ", and the only one: cannot extrapolate" + samples);
}

TEST_CASE("no data: stamps of a simulation are in seconds, and have no age by another clock") {
  Robot robot{Time()};
  robot.sample("hand", 1s);
  robot.sample("hand", 2s);
  const std::string expected =
      "not_yet: the edge of 'hand' has no data for 2.500 s: its newest sample is 500.000 ms older; "
      "it has samples from 1.000 s to 2.000 s";
  CHECK(robot.why("world", "hand", at(Time(2500ms))) == expected);
  robot.now = kNow;
  CHECK(robot.why("world", "hand", at(Time(2500ms))) == expected);
  robot.now = Time(3s);
  CHECK_THAT(robot.why("world", "hand", at(Time(2500ms))),
             ContainsSubstring("(2.000 s ago to 1.000 s ago)"));
}

TEST_CASE("no data: of a path, the edge that limits, and when all edges have data") {
  Robot robot{Time()};
  for (const auto& [id, from, to] :
       {std::tuple{"arm", 1s, 9s}, {"hand", 3s, 8s}, {"tool", 2s, 7s}}) {
    robot.sample(id, from);
    robot.sample(id, to);
  }
  const std::string all = "; all 3 dynamic edges here have data from 3.000 s to 7.000 s";
  CHECK(robot.why("world", "tool", at(Time(500ms))) ==
        "too_old: the edge of 'hand' has no data for 0.500 s: its oldest sample is 2.500 s later; "
        "it has samples from 3.000 s to 8.000 s" +
            all);
  CHECK(robot.why("world", "tool", at(Time(8500ms))) ==
        "not_yet: the edge of 'tool' has no data for 8.500 s: its newest sample is 1.500 s older; "
        "it has samples from 2.000 s to 7.000 s" +
            all);
  // An edge that may be extrapolated does not limit.
  REQUIRE(robot.forest.clear_history("hand"));
  robot.sample("hand", 8s);
  CHECK_THAT(robot.why("world", "tool", at(Time(8500ms), 2s)),
             ContainsSubstring("the edge of 'hand' has no data for 8.500 s") &&
                 ContainsSubstring("cannot extrapolate"));
  // The same for others.
  const auto asked =
      robot.forest.lookup_segments({{"world", "arm"}, {"hand", "tool"}}, at(Time(8500ms)));
  REQUIRE_FALSE(asked);
  CHECK_THAT(asked.error().message,
             ContainsSubstring("the edge of 'tool'") &&
                 ContainsSubstring("all 2 dynamic edges here have data from 2.000 s to 7.000 s"));
}

TEST_CASE("no data: edges that have no instant in common") {
  Robot robot{Time()};
  robot.sample("arm", 1s);
  robot.sample("arm", 2s);
  robot.sample("hand", 5s);
  const std::string both =
      "; the 2 dynamic edges here have no instant in common: the edge of 'arm' has samples until "
      "2.000 s, the edge of 'hand' from 5.000 s on";
  const std::string newest =
      "too_old: there is no latest common time: the edge of 'hand' has no data for 2.000 s: its "
      "oldest sample is 3.000 s later; it has one sample, of 5.000 s" +
      both;
  CHECK(robot.why("world", "hand", {}) == newest);
  const auto plain = robot.forest.lookup("world", "hand");
  REQUIRE_FALSE(plain);
  CHECK("too_old: " + plain.error().message == newest);
  CHECK(robot.forest.lookup_pose("world", "hand").error().message == plain.error().message);
  const auto asked = robot.forest.lookup_segments({{"world", "arm"}, {"arm", "hand"}}, {});
  REQUIRE_FALSE(asked);
  CHECK("too_old: " + asked.error().message == newest);
  REQUIRE(robot.forest.clear_history("arm"));
  CHECK(robot.why("world", "hand", {}) ==
        "not_yet: the edge of 'arm' has had no sample since its history was cleared");
}

TEST_CASE("no data: instants at the ends of the type") {
  Robot robot(kNow);
  robot.now = kNow;
  robot.sample("hand", 0s);
  for (const std::int64_t t : {INT64_MIN, INT64_MIN + 1, std::int64_t{-1}, INT64_MAX}) {
    CHECK_THAT(robot.why("world", "hand", at(time_of(t))), ContainsSubstring("the edge of 'hand'"));
  }
}

}  // namespace tfdude
