#include "runtime/watch_mirror.hpp"

#include <string>
#include <vector>

#include "support/catch.hpp"
#include "support/forest_support.hpp"

namespace tfdude {
namespace {

using testing::along_x;
using testing::Approx;
using testing::outcome;

Time ms(std::int64_t milliseconds) { return Time(Milliseconds(milliseconds)); }

Query at(std::int64_t milliseconds) {
  Query query;
  query.at = ms(milliseconds);
  return query;
}

constexpr std::uint64_t kArms = 11;
constexpr std::uint64_t kTools = 12;

// world -> arm -> hand of "arms", -> tool of "tools".
WatchRoute route() {
  WatchRoute route;
  route.edges = {{"arm", "world"}, {"hand", "arm"}, {"tool", "hand"}};
  route.sources = {{"arms", 1, kArms, {"arm", "hand"}}, {"tools", 1, kTools, {"tool"}}};
  return route;
}

PushedValue entry(std::uint32_t index, double x, std::uint64_t history, bool begins = true) {
  PushedValue value{index, {}, along_x(x), {}, history, {}};
  if (begins) value.process_noise = Covariance();
  return value;
}
PushedValue sample(std::uint32_t index, std::int64_t t, double x, std::uint64_t history,
                   bool begins = false) {
  PushedValue value = entry(index, x, history, begins);
  value.stamp = ms(t);
  return value;
}

struct Watched {
  Watched() {
    REQUIRE(mirror.take({kArms, {entry(0, 1, 1), entry(1, 10, 2)}, 0, 5}));
    REQUIRE(mirror.take({kTools, {entry(0, 100, 1)}, 0, 3}));
    REQUIRE(mirror.complete());
  }
  double x() const {
    const auto found = mirror.lookup({});
    return found ? found->pose.translation().x() : -1;
  }
  WatchMirror mirror{"world", "tool", route(), {}};
};

}  // namespace

TEST_CASE("watch mirror: it is complete when all owners have sent their values") {
  WatchMirror mirror("world", "tool", route(), {});
  CHECK(mirror.lacks());
  CHECK(mirror.take({kArms, {entry(0, 1, 1), entry(1, 10, 2)}, 0, 5}));
  CHECK_FALSE(mirror.complete());
  CHECK_FALSE(mirror.take({99, {entry(0, 7, 1)}, 0, 9}));  // of another route
  // A push that follows an unknown commit has no value for an unknown edge: it must be requested.
  CHECK_FALSE(mirror.take({kTools, {entry(0, 200, 1, false)}, 3, 4}));
  CHECK_FALSE(mirror.complete());
  CHECK(mirror.take({kTools, {entry(0, 100, 1)}, 0, 3}));
  CHECK(mirror.complete());
  CHECK(mirror.lacks());
  CHECK(mirror.take({kTools, {entry(0, 200, 1)}, 0, 4}));
  CHECK_FALSE(mirror.lacks());
  CHECK(mirror.lookup({})->pose.translation().x() == 211);
}

TEST_CASE("watch mirror: an older reply or push never replaces a newer value") {
  Watched watched;
  CHECK(watched.mirror.take({kArms, {entry(0, 2, 1, false)}, 5, 6}));
  CHECK(watched.x() == 112);
  CHECK_FALSE(
      watched.mirror.take({kArms, {entry(0, 1, 1), entry(1, 10, 2)}, 0, 5}));  // a late reply
  CHECK_FALSE(watched.mirror.take({kArms, {entry(0, 3, 1, false)}, 5, 6}));
  CHECK(watched.x() == 112);
  CHECK_FALSE(watched.mirror.lacks());
  // Earlier samples that the reply left out are still accepted.
  CHECK(watched.mirror.take({kTools, {sample(0, 30, 3, 4, true)}, 0, 9}));
  CHECK_FALSE(watched.mirror.take({kTools, {sample(0, 20, 2, 4), sample(0, 30, 7, 4)}, 3, 9}));
  CHECK(watched.mirror.lookup(at(20))->pose.translation().x() == 14);
  CHECK(watched.mirror.lookup(at(30))->pose.translation().x() == 15);
}

TEST_CASE("watch mirror: what was told of a stamp, an answer of before does not take back") {
  Watched watched;
  WatchMirror& mirror = watched.mirror;
  const Correlation first{false, {{"first", false, Loading::Ones(6, 1) * 1e-3}}, {}};
  const Correlation second{false, {{"second", false, Loading::Ones(6, 1) * 1e-3}}, {}};
  CHECK(mirror.take({kTools, {sample(0, 20, 2, 4, true)}, 0, 9}));
  // Commit 10 was lost. It has corrected the sample, and so has commit 12.
  PushedValue corrected = sample(0, 20, 5, 4);
  corrected.correlation = second;
  CHECK(mirror.take({kTools, {corrected}, 11, 12}));
  CHECK(mirror.lookup(at(20))->pose.translation().x() == 16);
  // The answer was made between both.
  PushedValue late = sample(0, 10, 1, 4);
  PushedValue stale = sample(0, 20, 3, 4);
  stale.correlation = first;
  CHECK(mirror.take({kTools, {late, stale}, 0, 11}));
  CHECK(mirror.lookup(at(20))->pose.translation().x() == 16);
  CHECK(mirror.lookup(at(20))->basis.sources == std::vector<std::string>{"second"});
  CHECK(mirror.lookup(at(10))->pose.translation().x() == 12);
  CHECK(mirror.lacks());
  // The next one has the rest of commit 12.
  PushedValue whole = sample(0, 20, 6, 4);
  whole.correlation = first;
  CHECK(mirror.take({kTools, {late, whole}, 0, 12}));
  CHECK_FALSE(mirror.lacks());
  CHECK(mirror.lookup(at(20))->pose.translation().x() == 17);
  CHECK(mirror.lookup(at(20))->basis.sources == std::vector<std::string>{"first"});
}

TEST_CASE("watch mirror: an answer tells nothing of earlier samples than it has") {
  const auto x = [](const WatchMirror& mirror, std::int64_t t) {
    return mirror.lookup(at(t))->pose.translation().x() - 11;
  };
  SECTION("the push that corrected one was lost") {
    Watched watched;
    WatchMirror& mirror = watched.mirror;
    CHECK(mirror.take({kTools, {sample(0, 10, 1, 4, true), sample(0, 20, 2, 4)}, 0, 9}));
    CHECK(mirror.ask_for_skipped() == Time());
    mirror.told_from(Time());
    CHECK(mirror.take({kTools, {sample(0, 30, 3, 4)}, 10, 11}));
    CHECK(mirror.take({kTools, {sample(0, 30, 3, 4)}, 0, 11}));
    CHECK(mirror.skipped_from() == ms(20));
    (void)mirror.take({kTools, {sample(0, 20, 5, 4), sample(0, 30, 3, 4)}, 0, 11});
    CHECK(x(mirror, 20) == 5);
  }
  SECTION("it overtakes the push") {
    Watched watched;
    WatchMirror& mirror = watched.mirror;
    CHECK(mirror.take({kTools, {sample(0, 10, 1, 4, true), sample(0, 20, 2, 4)}, 0, 9}));
    CHECK(mirror.take({kTools, {sample(0, 20, 2, 4)}, 0, 12}));
    (void)mirror.take({kTools, {sample(0, 10, 5, 4), sample(0, 20, 7, 4)}, 9, 11});
    CHECK(x(mirror, 10) == 5);
    CHECK(x(mirror, 20) == 2);
  }
}

TEST_CASE("watch mirror: what is said of an edge is that of the latest commit") {
  const auto said = [](const char* source) {
    return Correlation{false, {{source, false, Loading::Ones(6, 1) * 1e-3}}, {}};
  };
  Watched watched;
  WatchMirror& mirror = watched.mirror;
  PushedValue first = sample(0, 10, 1, 4, true);
  first.correlation = said("k");
  CHECK(mirror.take({kTools, {first}, 0, 9}));
  const auto sources = [&] { return mirror.lookup(at(40))->basis.sources; };
  PushedValue newest = sample(0, 40, 4, 4);
  SECTION("an answer overtakes a push") {
    newest.correlation = said("k");
    CHECK(mirror.take({kTools, {newest}, 0, 11}));
    (void)mirror.take({kTools, {sample(0, 30, 3, 4), newest}, 9, 11});
    CHECK(sources() == std::vector<std::string>{"k"});
  }
  SECTION("a push tells what was said before") {
    newest.correlation = said("later");
    CHECK(mirror.take({kTools, {newest}, 0, 12}));
    PushedValue before = sample(0, 30, 3, 4);
    before.correlation = said("k");
    (void)mirror.take({kTools, {before}, 9, 11});
    CHECK(sources() == std::vector<std::string>{"later"});
  }
}

TEST_CASE("watch mirror: an answer that leaves edges out is no push") {
  Watched watched;
  WatchMirror& mirror = watched.mirror;
  CHECK(mirror.take({kTools, {sample(0, 10, 1, 4, true), sample(0, 20, 2, 4)}, 0, 9}));
  (void)mirror.take({kTools, {sample(0, 20, 2, 4)}, 12, 12});
  (void)mirror.take({kTools, {sample(0, 10, 5, 4)}, 9, 11});
  CHECK(mirror.lookup(at(10))->pose.translation().x() == 16);
}

TEST_CASE("watch mirror: after a lost push no half of a commit is visible") {
  Watched watched;
  // A commit of both edges was lost, and one of the edges was written again.
  CHECK(watched.mirror.take({kArms, {entry(1, 30, 2, false)}, 6, 7}));
  CHECK(watched.x() == 111);
  CHECK(watched.mirror.lacks());
  CHECK_FALSE(watched.mirror.take({kArms, {entry(0, 1, 1), entry(1, 10, 2)}, 0, 5}));
  CHECK(watched.mirror.lacks());
  CHECK(watched.mirror.take({kArms, {entry(0, 2, 1), entry(1, 30, 2)}, 0, 8}));
  CHECK(watched.x() == 132);
  CHECK_FALSE(watched.mirror.lacks());
  // A sample is valid for its instant, whatever else was lost.
  CHECK(watched.mirror.take({kTools, {sample(0, 10, 100, 1)}, 3, 4}));
  CHECK(watched.mirror.take({kTools, {sample(0, 30, 300, 1)}, 5, 6}));
  CHECK(watched.x() == 332);
  CHECK(watched.mirror.lacks());
}

TEST_CASE("watch mirror: a covariance that was pushed before is reused by its number") {
  const auto uncertain = [](PushedValue value, double stddev, std::uint32_t number, bool known) {
    const Covariance covariance =
        *Covariance::from_stddev({stddev, stddev, stddev, stddev, stddev, stddev});
    if (!known) value.X.covariance = covariance;
    value.covariance_number = number;
    value.covariance_known = known;
    return value;
  };
  Watched watched;
  const auto stddev = [&] {
    return watched.mirror.lookup({})->covariance.of_specified().stddev()[0];
  };
  CHECK(watched.mirror.take({kTools, {uncertain(entry(0, 100, 1, false), 0.1, 4, false)}, 3, 4}));
  CHECK(stddev() == Approx(0.1));
  CHECK(watched.mirror.take({kTools, {uncertain(entry(0, 200, 1, false), 0, 4, true)}, 4, 5}));
  CHECK(watched.x() == 211);
  CHECK(stddev() == Approx(0.1));
  CHECK_FALSE(watched.mirror.lacks());
  // The message with number 5 was lost, though its commit was not: nothing is guessed.
  CHECK(watched.mirror.take({kTools, {uncertain(entry(0, 300, 1, false), 0, 5, true)}, 5, 6}));
  CHECK(watched.x() == 211);
  CHECK(stddev() == Approx(0.1));
  CHECK(watched.mirror.lacks());
  CHECK(watched.mirror.take({kTools, {uncertain(entry(0, 300, 1), 0.2, 5, false)}, 0, 6}));
  CHECK(watched.x() == 311);
  CHECK(stddev() == Approx(0.2));
  CHECK_FALSE(watched.mirror.lacks());
  CHECK(watched.mirror.take({kTools, {uncertain(sample(0, 7, 400, 1), 0, 5, true)}, 6, 7}));
  CHECK(watched.x() == 411);
  CHECK(stddev() == Approx(0.2));
}

TEST_CASE("watch mirror: values in several messages become visible with the last of them") {
  Watched watched;
  CHECK_FALSE(watched.mirror.take({kArms, {entry(0, 2, 1, false)}, 5, 6, 0, 2}));
  CHECK(watched.x() == 111);
  CHECK(watched.mirror.take({kArms, {entry(1, 20, 2, false)}, 5, 6, 1, 2}));
  CHECK(watched.x() == 122);
}

TEST_CASE("watch mirror: the newest history of an edge is visible") {
  Watched watched;
  CHECK(watched.mirror.take({kTools, {sample(0, 10, 100, 1), sample(0, 20, 200, 1)}, 3, 4}));
  CHECK(watched.mirror.take({kTools, {entry(0, 500, 5)}, 4, 5}));
  CHECK(watched.x() == 511);
  CHECK_FALSE(watched.mirror.lookup({})->stamp);
  CHECK(watched.mirror.take({kTools, {sample(0, 30, 300, 1)}, 5, 6}));  // of the one before
  CHECK(watched.x() == 511);
}

TEST_CASE("watch mirror: a new route takes over the samples of the edges it shares") {
  Watched watched;
  for (int t = 1; t <= 9; ++t) {
    const auto commit = static_cast<std::uint64_t>(t + 3);
    REQUIRE(watched.mirror.take({kTools, {sample(0, 10 * t, 100 * t, 1)}, commit - 1, commit}));
  }
  WatchRoute other = route();
  other.edges[0].parent = "track";
  other.edges.insert(other.edges.begin(), FrameInfo{"track", "world"});
  other.sources[0] = {"arms", 1, 77, {"track", "arm", "hand"}};
  CHECK_FALSE(other.is_same(route()));
  WatchMirror next("world", "tool", other, {});
  next.inherit(watched.mirror);
  CHECK_FALSE(next.complete());
  CHECK(next.take({kTools, {sample(0, 90, 900, 1, true)}, 0, 11}));
  CHECK(next.take({77, {entry(0, 1000, 6), entry(1, 1, 7), entry(2, 10, 2)}, 0, 9}));
  CHECK(next.complete());
  CHECK(next.lookup(at(45))->pose.translation().x() == Approx(1461));
  // The tools were heard up to commit 12 there.
  CHECK(next.is_behind(watched.mirror));
  CHECK(next.take({kTools, {}, 11, 12}));
  CHECK_FALSE(next.is_behind(watched.mirror));
  // Nothing is taken over from an owner that has restarted.
  other.sources[1] = {"tools", 2, 13, {"tool"}};
  WatchMirror restarted("world", "tool", other, {});
  restarted.inherit(watched.mirror);
  CHECK(restarted.take({77, {entry(0, 1000, 6), entry(1, 1, 7), entry(2, 10, 2)}, 0, 9}));
  CHECK(restarted.take({13, {sample(0, 5, 7, 1, true)}, 0, 1}));
  CHECK_FALSE(restarted.is_behind(watched.mirror));
  CHECK(outcome(restarted.lookup(at(45))) == "not_yet");
}

TEST_CASE("watch mirror: it knows from which instant on it lacks samples") {
  Watched watched;
  CHECK_FALSE(watched.mirror.lacks_history());
  CHECK(watched.mirror.take({kTools, {sample(0, 30, 100, 1)}, 3, 4}));
  CHECK_FALSE(watched.mirror.lacks_history());
  CHECK(watched.mirror.take({kArms, {sample(0, 20, 2, 1)}, 5, 6}));
  CHECK(outcome(watched.mirror.lookup({})) == "too_old");
  CHECK(watched.mirror.lacks_history() == ms(20));
  CHECK(watched.mirror.take({kTools, {sample(0, 10, 80, 1, true), sample(0, 30, 100, 1)}, 0, 5}));
  CHECK_FALSE(watched.mirror.lacks_history());
  CHECK(watched.mirror.lookup({})->stamp == ms(20));
}

TEST_CASE("watch mirror: it knows which samples an answer leaves out") {
  Watched watched;
  WatchMirror& mirror = watched.mirror;
  CHECK(mirror.take({kTools, {sample(0, 10, 100, 1)}, 3, 4}));
  CHECK(mirror.take({kTools, {sample(0, 20, 110, 1)}, 4, 5}));
  // The same again, and an answer without a newer sample.
  CHECK_FALSE(mirror.take({kTools, {sample(0, 20, 110, 1, true)}, 0, 5}));
  CHECK(mirror.take({kTools, {sample(0, 20, 110, 1, true)}, 0, 6}));
  CHECK_FALSE(mirror.skipped_from());
  // Commit 7 is lost: whatever came after it, samples may be missing after the last complete one.
  CHECK(mirror.take({kTools, {sample(0, 40, 130, 1)}, 7, 8}));
  CHECK(mirror.lacks());
  CHECK(mirror.take({kTools, {sample(0, 40, 130, 1, true)}, 0, 8}));
  CHECK_FALSE(mirror.lacks());
  CHECK(mirror.skipped_from() == ms(20));
  const std::vector<PushedValue> all{sample(0, 20, 110, 1, true), sample(0, 30, 120, 1),
                                     sample(0, 40, 130, 1), sample(0, 50, 150, 1)};
  CHECK(mirror.ask_for_skipped() == ms(20));
  CHECK(mirror.take({kTools, all, 0, 9}));
  mirror.told_from(ms(20));
  CHECK_FALSE(mirror.skipped_from());
  CHECK(mirror.lookup(at(30))->pose.translation().x() == Approx(131));
  // An edge that had no sample, and one whose history began again, lack all.
  CHECK(mirror.take({kArms, {sample(0, 50, 1, 1, true)}, 0, 6}));
  CHECK(mirror.ask_for_skipped() == Time());
  mirror.told_from(Time());
  CHECK(mirror.take({kTools, {sample(0, 60, 140, 9, true)}, 0, 10}));
  CHECK(mirror.ask_for_skipped() == Time());
  mirror.told_from(Time());
  // So does one that a push after a lost one began, whose stamps are earlier than those before.
  CHECK(mirror.take({kTools, {sample(0, 10, 100, 12, true)}, 11, 12}));
  CHECK(mirror.lacks());
  CHECK(mirror.take({kTools, {sample(0, 30, 120, 12, true)}, 0, 14}));
  CHECK(mirror.skipped_from() == Time());
}

}  // namespace tfdude
