// Clocks that start at zero, have no time yet, stop or jump back.

#include <optional>
#include <string>

#include "support/catch.hpp"
#include "support/forest_support.hpp"
#include "tree/forest.hpp"

namespace tfdude {
namespace {

using namespace std::chrono_literals;
using testing::along_x;
using testing::ContainsSubstring;
using testing::outcome;

Time ms(std::int64_t milliseconds) { return Time(Milliseconds(milliseconds)); }

Query at(std::int64_t milliseconds) { return {ms(milliseconds), 0ns, {}}; }

double x_of(const Result<StampedTransform>& X) {
  return X ? X->pose.translation().x() : std::numeric_limits<double>::quiet_NaN();
}

// world -> mast, static; world -> arm -> hand, dynamic from the first sample on.
struct Simulated {
  Simulated() {
    REQUIRE(forest.add("world", "", {}));
    REQUIRE(forest.add("mast", "world", along_x(3)));
    REQUIRE(forest.add("arm", "world", along_x(4)));
    REQUIRE(forest.add("hand", "arm", along_x(5)));
    EdgeTiming timing;
    timing.moving = true;
    REQUIRE(forest.set_timing("arm", timing));
  }

  std::optional<Time> now;
  Forest forest{[this] { return now; }};
};

TEST_CASE("clock: without a time, whatever needs it fails") {
  Simulated sim;
  const auto unstamped = sim.forest.update("arm", along_x(1));
  CHECK(outcome(unstamped) == "not_yet");
  CHECK_THAT(unstamped.error().message,
             ContainsSubstring("'arm'") && ContainsSubstring("has no time yet"));
  // How far it is ahead cannot be judged, even of a small stamp.
  CHECK(outcome(sim.forest.update("hand", along_x(1), ms(1))) == "not_yet");
  CHECK(outcome(sim.forest.update({{"mast", along_x(2)}, {"arm", along_x(1)}})) == "not_yet");
  CHECK(x_of(sim.forest.lookup("world", "mast", Query{})) == 3);
  CHECK(outcome(sim.forest.update("mast", along_x(9))) == "ok");
  EdgeTiming boundless;
  boundless.max_ahead = std::chrono::nanoseconds::max();
  REQUIRE(sim.forest.set_timing("hand", boundless));
  CHECK(outcome(sim.forest.update("hand", along_x(1), ms(1))) == "ok");
  sim.now = ms(0);
  CHECK(outcome(sim.forest.update("arm", along_x(1))) == "ok");
  CHECK(sim.forest.histories("arm").at(0).newest == ms(0));
}

TEST_CASE("clock: samples begin at zero") {
  Simulated sim;
  sim.now = ms(0);
  REQUIRE(sim.forest.update("arm", along_x(0), ms(0)));
  CHECK(outcome(sim.forest.update("arm", along_x(0), ms(0))) == "stamp_taken");
  CHECK(outcome(sim.forest.update("arm", along_x(0), Time(-1ns))) == "invalid_input");
  REQUIRE(sim.forest.update("arm", along_x(10), ms(10)));
  CHECK(x_of(sim.forest.lookup("world", "arm", at(0))) == 0);
  CHECK(x_of(sim.forest.lookup("world", "arm", at(5))) == testing::Approx(5));
  CHECK(outcome(sim.forest.lookup("world", "arm", {Time(-1ns), 0ns, {}})) == "too_old");
}

TEST_CASE("clock: while it stands still, unstamped updates are one sample, with the last value") {
  Simulated sim;
  sim.now = ms(7);
  Query beyond = at(57);
  beyond.extrapolate = 1s;
  for (int i = 0; i < 3; ++i) {
    REQUIRE(sim.forest.update("arm", along_x(i)));
    CHECK(x_of(sim.forest.lookup("world", "arm", Query{})) == i);
    CHECK(outcome(sim.forest.lookup("world", "arm", beyond)) == "not_yet");
  }
  CHECK(sim.forest.histories("arm").at(0).samples == 1);
  CHECK(sim.forest.histories("arm").at(0).newest == ms(7));
  // Nor do stamps at two times that the owner has made up tell a velocity.
  sim.now = ms(17);
  REQUIRE(sim.forest.update("arm", along_x(9)));
  REQUIRE(sim.forest.update("arm", along_x(3)));
  CHECK(x_of(sim.forest.lookup("world", "arm", at(12))) == testing::Approx(2.5));
  const auto made_up = sim.forest.lookup("world", "arm", beyond);
  CHECK(outcome(made_up) == "not_yet");
  CHECK_THAT(made_up.error().message, ContainsSubstring("edge of 'arm' has no data for 0.057 s") &&
                                          ContainsSubstring("40.000 ms older") &&
                                          ContainsSubstring("that of their arrival"));
  // A clock that was set back makes no stamp that is earlier, or told a velocity.
  sim.now = ms(3);
  REQUIRE(sim.forest.update({{"arm", along_x(4)}, {"mast", along_x(8)}}));
  CHECK(x_of(sim.forest.lookup("world", "arm", Query{})) == 4);
  CHECK(x_of(sim.forest.lookup("world", "arm", at(12))) == 3);
  const HistoryInfo history = sim.forest.histories("arm").at(0);
  CHECK(history.samples == 2);
  CHECK(history.newest == ms(17));
  CHECK(history.refused_equal == 0);
  // Named twice, the later counts.
  REQUIRE(sim.forest.update({{"arm", along_x(5)}, {"arm", along_x(6)}}));
  CHECK(x_of(sim.forest.lookup("world", "arm", Query{})) == 6);
  CHECK(outcome(sim.forest.update("arm", along_x(1), ms(17))) == "stamp_taken");
}

TEST_CASE("clock: one that was far ahead does not keep the values behind that follow") {
  Simulated sim;
  std::vector<std::string> restarted;
  sim.forest.on_restart([&](const HistoryRestart& one) { restarted.push_back(one.id); });
  const auto newest = [&] { return sim.forest.histories("arm").at(0).newest; };
  EdgeTiming timing;
  timing.moving = true;
  REQUIRE(sim.forest.set_timing("mast", timing));
  sim.now = ms(3'600'000);
  REQUIRE(sim.forest.update({{"arm", along_x(1)}, {"mast", along_x(1)}}));
  // A little behind: the sample is replaced until the clock has caught up.
  for (int i = 0; i < 10; ++i) {
    sim.now = ms(3'595'000 + i);
    REQUIRE(sim.forest.update("arm", along_x(2)));
  }
  CHECK(newest() == ms(3'600'000));
  // By more than is kept: also replaced, until five in a row were there at times that grow.
  for (int i = 0; i < 4; ++i) {
    sim.now = ms(1000 + i);
    REQUIRE(sim.forest.update({{"arm", along_x(3)}, {"mast", along_x(4)}}));
  }
  REQUIRE(sim.forest.update({{"arm", along_x(3)}, {"mast", along_x(4)}}));
  CHECK(newest() == ms(3'600'000));
  CHECK(restarted.empty());
  sim.now = ms(1004);
  REQUIRE(sim.forest.update({{"arm", along_x(5)}, {"mast", along_x(6)}}));
  CHECK(newest() == ms(1004));
  CHECK(sim.forest.histories("arm").at(0).samples == 1);
  CHECK(restarted == std::vector<std::string>{"arm", "mast"});
  CHECK(x_of(sim.forest.lookup("world", "arm", at(1004))) == 5);
  // A sample that goes on ends the row.
  sim.now = ms(61'000);
  REQUIRE(sim.forest.update("arm", along_x(1)));
  for (int i = 0; i < 8; ++i) {
    sim.now = ms(2000 + i);
    REQUIRE(sim.forest.update("arm", along_x(7)));
    REQUIRE(sim.forest.update("arm", along_x(8), ms(60'000 + i)));
  }
  CHECK(newest() == ms(61'000));
}

TEST_CASE("clock: samples tell a velocity again when two in a row have had stamps") {
  Simulated sim;
  sim.now = ms(100);
  Forest watcher;
  REQUIRE(watcher.add("world", "", {}));
  REQUIRE(watcher.add("arm", "world", {}));
  std::vector<EdgeCursor> cursors{{"arm", "world"}};
  const std::vector<PathEnds> segments{{"world", "arm"}};
  Query beyond = at(150);
  beyond.extrapolate = 1s;
  const auto beyond_of = [&](Forest& forest) {
    return outcome(forest.lookup("world", "arm", beyond));
  };
  const auto follow = [&] {
    watcher.take({*watcher.find("arm")}, sim.forest.values_since(cursors, {}).values);
  };
  const auto outcome_of_all = [&] {
    follow();
    CHECK(beyond_of(watcher) == beyond_of(sim.forest));
    return beyond_of(sim.forest);
  };
  REQUIRE(sim.forest.update("arm", along_x(1), ms(80)));
  follow();
  REQUIRE(sim.forest.update("arm", along_x(2), ms(90)));
  CHECK(outcome_of_all() == "ok");
  CHECK(outcome(sim.forest.check_timed(segments, ms(80))) == "ok");
  REQUIRE(sim.forest.update("arm", along_x(3)));
  CHECK(outcome_of_all() == "not_yet");
  CHECK(outcome(sim.forest.check_timed(segments, ms(85))) == "invalid_input");
  REQUIRE(sim.forest.update("arm", along_x(4), ms(110)));
  CHECK(outcome_of_all() == "not_yet");
  // A late sample moves the place of the one without.
  REQUIRE(sim.forest.update("arm", along_x(1.5), ms(85)));
  CHECK(outcome_of_all() == "not_yet");
  REQUIRE(sim.forest.update("arm", along_x(5), ms(120)));
  CHECK(outcome_of_all() == "ok");
  CHECK(x_of(watcher.lookup("world", "arm", beyond)) == testing::Approx(8));
  CHECK(outcome(sim.forest.check_timed(segments, ms(105))) == "invalid_input");
  CHECK(outcome(sim.forest.check_timed(segments, ms(110))) == "ok");
  // Nor does the first of another history inherit it.
  REQUIRE(sim.forest.update("arm", along_x(6)));
  REQUIRE(sim.forest.clear_history("arm"));
  REQUIRE(sim.forest.update("arm", along_x(7), ms(1)));
  follow();
  REQUIRE(sim.forest.update("arm", along_x(8), ms(101)));
  CHECK(outcome_of_all() == "ok");
}

TEST_CASE("clock: a cleared edge is dynamic and has no value until its next sample") {
  Simulated sim;
  sim.now = ms(5000);
  for (const int t : {1000, 2000}) {
    REQUIRE(sim.forest.update({{"arm", along_x(t)}, {"hand", along_x(1)}}, ms(t)));
  }
  const std::uint64_t before = sim.forest.newest_commit();
  REQUIRE(sim.forest.clear_history("arm"));
  CHECK(sim.forest.newest_commit() == before + 1);
  const Query first{time_of(INT64_MIN + 1), 0ns, {}};
  for (const Query& when : {Query{}, first, at(0), at(1500), at(1'000'000'000)}) {
    const auto X = sim.forest.lookup("world", "arm", when);
    CHECK(outcome(X) == "not_yet");
    CHECK_THAT(X.error().message,
               ContainsSubstring("'arm'") && ContainsSubstring("history was cleared"));
  }
  CHECK(outcome(sim.forest.lookup("world", "hand", Query{})) == "not_yet");
  Query extrapolating = at(2001);
  extrapolating.extrapolate = 1h;
  CHECK(outcome(sim.forest.lookup("world", "arm", extrapolating)) == "not_yet");
  CHECK(outcome(sim.forest.lookup("world", "arm")) == "not_yet");
  CHECK(outcome(sim.forest.lookup_pose("hand", "world")) == "not_yet");
  CHECK(x_of(sim.forest.lookup("arm", "hand", at(1500))) == 1);
  const HistoryInfo history = sim.forest.histories("arm").at(0);
  CHECK(history.samples == 0);
  CHECK_FALSE(history.newest);
  // Any stamp may follow.
  REQUIRE(sim.forest.update("arm", along_x(7), ms(0)));
  CHECK(x_of(sim.forest.lookup("world", "arm", Query{})) == 7);
  REQUIRE(sim.forest.update("arm", along_x(8), ms(1)));
  CHECK(sim.forest.histories("arm").at(0).samples == 2);
  CHECK(outcome(sim.forest.clear_history("mast")) == "ok");
  CHECK(x_of(sim.forest.lookup("world", "mast", Query{})) == 3);
  CHECK(outcome(sim.forest.clear_history("nobody")) == "unknown_frame");
}

TEST_CASE("clock: an edge that got its samples by stamps stays dynamic when cleared") {
  Simulated sim;
  sim.now = ms(5000);
  REQUIRE(sim.forest.update("hand", along_x(1), ms(1000)));
  REQUIRE(sim.forest.clear_history("hand"));
  sim.now = ms(3);
  REQUIRE(sim.forest.update("hand", along_x(2)));
  CHECK(sim.forest.lookup("arm", "hand", Query{})->stamp == ms(3));
}

TEST_CASE("clock: after a jump back only what is earlier holds") {
  Simulated sim;
  sim.now = ms(9000);
  for (const int t : {1000, 2000}) REQUIRE(sim.forest.update("arm", along_x(t), ms(t)));
  for (const int t : {1000, 8000}) REQUIRE(sim.forest.update("hand", along_x(t), ms(t)));
  sim.now = ms(3000);
  CHECK(sim.forest.clear_histories(ms(3000)) == 1);
  CHECK(x_of(sim.forest.lookup("world", "arm", Query{})) == 2000);
  CHECK(outcome(sim.forest.lookup("arm", "hand")) == "not_yet");
  CHECK(x_of(sim.forest.lookup("world", "mast", Query{})) == 3);
  // The clock was read before the jump, but is read again for the next stamp.
  CHECK(outcome(sim.forest.update("hand", along_x(1), ms(64'000))) == "invalid_input");
  CHECK(outcome(sim.forest.update("hand", along_x(1), ms(3000))) == "ok");
  CHECK(sim.forest.clear_histories(ms(3001)) == 0);
  // A sample at the time itself is published again by a replay.
  CHECK(sim.forest.clear_histories(ms(3000)) == 1);
  CHECK(sim.forest.clear_histories(Time::min()) == 1);
  CHECK(sim.forest.clear_histories(Time::min()) == 0);
}

TEST_CASE("clock: a sample that was on its way when it jumped back is rejected") {
  const int back = GENERATE(500, 5000, 30'000, 90'000);
  CAPTURE(back);
  Simulated sim;
  EdgeTiming boundless;
  boundless.max_ahead = std::chrono::nanoseconds::max();
  REQUIRE(sim.forest.set_timing("hand", boundless));
  sim.now = ms(100'000);
  const auto update = [&](const char* id, int t) {
    return outcome(sim.forest.update(id, along_x(t), ms(t)));
  };
  for (const int t : {98'000, 99'900, 100'000}) {
    REQUIRE(update("arm", t) == "ok");
    REQUIRE(update("hand", t) == "ok");
  }
  const int now = 100'000 - back;
  sim.now = ms(now);
  CHECK(sim.forest.clear_histories(ms(now), ms(100'000)) > 0);
  for (const char* id : {"arm", "hand"}) {
    for (const int late : {100'100, 100'000, 99'900}) CHECK(update(id, late) == "invalid_input");
    // Samples may be a little ahead of the clock, as before.
    CHECK(update(id, now) == "ok");
    CHECK(update(id, now + 100) == "ok");
    CHECK(sim.forest.histories(id).at(0).newest == ms(now + 100));
  }
  const auto late = sim.forest.update("arm", along_x(0), ms(100'100));
  CHECK_THAT(late.error().message, ContainsSubstring("'arm'") && ContainsSubstring("100.100 s") &&
                                       ContainsSubstring("jumped back from 100.000 s"));
  CHECK(sim.forest.histories("arm").at(0).refused_ahead == 4);
  // Of another clock.
  CHECK(update("hand", 400'000) == "ok");
  REQUIRE(sim.forest.clear_history("hand"));
  // Samples go on while the clock does.
  for (int t = now + 200; t < 100'000; t += 100) {
    sim.now = ms(t - 10);
    CHECK(update("arm", t) == "ok");
    if (100'000 - t > 300) CHECK(update("arm", 100'050) == "invalid_input");
  }
  sim.now = ms(100'000);
  CHECK(update("hand", 100'100) == "ok");
}

TEST_CASE("clock: cleared samples do not count for the limit of memory") {
  Simulated sim;
  sim.now = ms(0);
  for (int i = 0; i < 100; ++i) REQUIRE(sim.forest.update("arm", along_x(i), ms(i)));
  REQUIRE(sim.forest.clear_history("arm"));
  sim.forest.limit_history(3000);
  for (int i = 0; i < 5; ++i) REQUIRE(sim.forest.update("arm", along_x(i), ms(i)));
  CHECK(sim.forest.histories("arm").at(0).samples == 5);
}

TEST_CASE("clock: watchers are told that a history was cleared") {
  Simulated sim;
  sim.now = ms(9000);
  Forest mirror;
  REQUIRE(mirror.add("world", "", {}));
  REQUIRE(mirror.add("arm", "world", {}));
  const std::vector<Handle> edges{*mirror.find("arm")};
  std::vector<EdgeCursor> cursors{{"arm", "world"}};
  const auto pass_on = [&] {
    auto told = sim.forest.values_since(cursors, {});
    mirror.take(edges, told.values);
    return told.values.size();
  };
  for (const int t : {1000, 2000}) REQUIRE(sim.forest.update("arm", along_x(t), ms(t)));
  REQUIRE(pass_on() > 0);
  CHECK(x_of(mirror.lookup("world", "arm", Query{})) == 2000);
  REQUIRE(sim.forest.clear_history("arm"));
  CHECK(pass_on() == 1);
  CHECK(outcome(mirror.lookup("world", "arm", Query{})) == "not_yet");
  CHECK(pass_on() == 0);
  REQUIRE(sim.forest.update("arm", along_x(5), ms(5)));
  CHECK(pass_on() == 1);
  CHECK(x_of(mirror.lookup("world", "arm", Query{})) == 5);
  CHECK(outcome(mirror.lookup("world", "arm", at(4))) == "too_old");
  // A watcher that begins meanwhile is told, too.
  REQUIRE(sim.forest.clear_history("arm"));
  cursors = {{"arm", "world"}};
  CHECK(pass_on() == 1);
  CHECK(outcome(mirror.lookup("world", "arm", Query{})) == "not_yet");
}

}  // namespace
}  // namespace tfdude
