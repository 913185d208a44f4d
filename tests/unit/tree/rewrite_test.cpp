// The past of an edge is replaced: what lookups, watchers and other processes then find.

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "tfdude/math/interpolate.hpp"
#include "tfdude/math/joint.hpp"

#include "support/catch.hpp"
#include "support/forest_support.hpp"
#include "support/pose_diff.hpp"
#include "support/random.hpp"
#include "support/shared_forest.hpp"
#include "tree/forest.hpp"
#include "tree/remote_edges.hpp"

namespace tfdude {
namespace {

using namespace std::chrono_literals;
using testing::along_x;
using testing::Approx;
using testing::ContainsSubstring;
using testing::outcome;
using testing::Random;
using testing::transform_diff;

constexpr std::int64_t kMs = 1'000'000;

Time at(std::int64_t milliseconds) { return time_of(milliseconds * kMs); }
TimeInterval between(std::int64_t from, std::int64_t to) { return {at(from), at(to)}; }

Query query(std::int64_t milliseconds) {
  Query query;
  query.at = at(milliseconds);
  return query;
}

EdgeTiming long_timing(std::size_t count = 100'000) {
  EdgeTiming timing;
  timing.span = std::chrono::hours(1);
  timing.count = count;
  timing.max_ahead = std::chrono::nanoseconds::max();
  timing.moving = true;
  return timing;
}

// world -> odom, which was sampled.
struct Slam {
  explicit Slam(std::size_t count = 100'000) {
    REQUIRE(forest.add("world", "", {}));
    REQUIRE(forest.add("odom", "world", along_x(0)));
    REQUIRE(forest.set_timing("odom", long_timing(count)));
  }
  void sample(std::int64_t ms, const Transform& X) { REQUIRE(forest.update("odom", X, at(ms))); }
  double x(std::int64_t ms) const {
    const auto X = forest.lookup("world", "odom", query(ms));
    return X ? X->pose.translation().x() : std::numeric_limits<double>::quiet_NaN();
  }

  Forest forest;
};

// What an edge's samples are: nothing but a map.
using Samples = std::map<std::int64_t, Transform>;

std::optional<Transform> value(const Samples& samples, std::int64_t ms) {
  const auto after = samples.lower_bound(ms);
  if (after == samples.end()) return std::nullopt;
  if (after->first == ms) return after->second;
  if (after == samples.begin()) return std::nullopt;
  const auto before = std::prev(after);
  Transform X;
  interpolate(
      before->second, after->second,
      static_cast<double>(ms - before->first) / static_cast<double>(after->first - before->first),
      X);
  return X;
}

std::string difference(const Forest& forest, const Samples& samples, std::int64_t ms) {
  const auto found = forest.lookup("world", "odom", query(ms));
  const auto expected = value(samples, ms);
  if (!found || !expected) return found.has_value() == expected.has_value() ? "" : outcome(found);
  return transform_diff(*found, *expected, 1e-9);
}

// Samples at random instants of an interval, in order; at least one.
std::vector<EdgeSample> random_samples(Random& random, std::int64_t from, std::int64_t to) {
  std::vector<EdgeSample> samples;
  const Covariance shared = random.covariance();
  const bool own = random.index(2) == 0;
  const auto longest = static_cast<std::size_t>(std::max<std::int64_t>((to - from) / 4, 1));
  for (std::int64_t t = from + static_cast<std::int64_t>(random.index(3)); t <= to;
       t += 1 + static_cast<std::int64_t>(random.index(longest))) {
    const Pose X = random.pose();
    samples.push_back({at(t), {X, own ? random.covariance() : shared}});
  }
  if (samples.empty()) samples.push_back({at(from), random.transform()});
  return samples;
}

void apply(Samples& samples, std::int64_t from, std::int64_t to,
           const std::vector<EdgeSample>& by) {
  samples.erase(samples.lower_bound(from), samples.upper_bound(to));
  for (const EdgeSample& one : by) samples[nanoseconds(one.stamp) / kMs] = one.X_PC;
}

TEST_CASE("a rewrite replaces the samples of its interval, and no others") {
  Slam slam;
  for (int i = 0; i <= 20; ++i) slam.sample(100 * i, along_x(i));
  REQUIRE(slam.forest.rewrite("odom", between(500, 1000),
                              {{at(520), along_x(50)}, {at(900), along_x(90)}}));
  CHECK(slam.x(400) == 4);
  CHECK(slam.x(460) == Approx(4 + 46 * 0.5));  // half the way to the first new one
  CHECK(slam.x(520) == 50);
  CHECK(slam.x(710) == Approx(70));
  CHECK(slam.x(900) == 90);
  CHECK(slam.x(1000) == Approx((90 + 11) / 2.0));
  CHECK(slam.x(1100) == 11);
  CHECK(slam.x(2000) == 20);
  const HistoryInfo info = slam.forest.histories("odom").at(0);
  CHECK(info.samples == 21 - 6 + 2);
  CHECK(info.newest == at(2000));
}

TEST_CASE("a rewrite may reach to the end, begin a history, and end before the newest sample") {
  Slam slam;
  REQUIRE(slam.forest.rewrite("odom", between(0, 1000), {{at(10), along_x(1)}}));
  CHECK(slam.x(10) == 1);
  slam.sample(20, along_x(2));
  REQUIRE(
      slam.forest.rewrite("odom", between(15, 5000), {{at(30), along_x(3)}, {at(40), along_x(4)}}));
  CHECK(slam.x(20) == Approx(2));  // between 1 and 3, by time
  CHECK(testing::x_of(slam.forest.lookup("world", "odom")) == 4);
  REQUIRE(slam.forest.rewrite("odom", between(35, 5000), {{at(36), along_x(9)}}));
  CHECK(testing::x_of(slam.forest.lookup("world", "odom")) == 9);
  CHECK(outcome(slam.forest.lookup("world", "odom", query(40))) == "not_yet");
  slam.sample(40, along_x(10));
  CHECK(slam.x(38) == Approx(9.5));
}

TEST_CASE(
    "random samples, late ones and rewrites give what a map of samples gives, also to who "
    "watches") {
  Random random(4711);
  INFO("seed " << random.seed());
  for (int round = 0; round < 30; ++round) {
    Slam slam;
    Samples samples;
    Forest mirror;
    REQUIRE(mirror.add("world", "", {}));
    REQUIRE(mirror.add("odom", "world", along_x(0)));
    REQUIRE(mirror.set_default_timing(long_timing()));
    const std::vector<Handle> edges{*mirror.find("odom")};
    std::vector<EdgeCursor> cursors{{"odom", "world"}};
    std::uint64_t known = 0;  // the history that the watcher has
    std::size_t told = 0;
    std::int64_t now = 1000;
    for (int step = 0; step < 60; ++step) {
      const std::size_t kind = random.index(10);
      if (kind < 5 || samples.size() < 2) {
        now += 1 + static_cast<std::int64_t>(random.index(20));
        samples[now] = random.transform();
        slam.sample(now, samples[now]);
      } else if (kind < 7) {
        const std::int64_t first = samples.begin()->first;
        const auto t =
            first + static_cast<std::int64_t>(random.index(static_cast<std::size_t>(now - first)));
        if (samples.count(t) > 0) continue;
        samples[t] = random.transform();
        slam.sample(t, samples[t]);
      } else {
        const std::int64_t first = samples.begin()->first;
        const auto from = first + static_cast<std::int64_t>(
                                      random.index(static_cast<std::size_t>(now - first + 5)));
        const auto to = from + static_cast<std::int64_t>(random.index(80));
        const auto by = random_samples(random, from, to);
        REQUIRE(slam.forest.rewrite("odom", between(from, to), by));
        apply(samples, from, to, by);
        now = samples.rbegin()->first;
      }
      if (random.index(3) > 0) continue;
      auto values = slam.forest.values_since(cursors, {false, at(0), true}).values;
      told += values.size();
      join_histories(values);
      for (PushedValue& value : values) {
        const bool begins = value.history > known;
        if (!begins) value.process_noise.reset();
        if (!begins || value.continues != known) value.kept_before.reset();
        known = value.history;
      }
      mirror.take(edges, values);
      for (int i = 0; i < 5; ++i) {
        const auto t = samples.begin()->first - 3 +
                       static_cast<std::int64_t>(random.index(
                           static_cast<std::size_t>(now - samples.begin()->first + 8)));
        INFO("round " << round << ", step " << step << ", at " << t);
        REQUIRE(difference(slam.forest, samples, t) == "");
        REQUIRE(difference(mirror, samples, t) == "");
      }
    }
    CHECK(told > 0);
  }
}

TEST_CASE("a watcher is told a rewrite only from its interval on") {
  Slam slam;
  std::vector<EdgeCursor> cursors{{"odom", "world"}};
  for (int i = 0; i < 1000; ++i) slam.sample(10 * i, along_x(i));
  (void)slam.forest.values_since(cursors, {});
  REQUIRE(slam.forest.rewrite("odom", between(9900, 9950), {{at(9910), along_x(7)}}));
  auto values = slam.forest.values_since(cursors, {}).values;
  // The sample, those after it, and where the history before ends.
  REQUIRE(values.size() == 1 + 4 + 1);
  CHECK(values[0].history < values[1].history);
  join_histories(values);
  REQUIRE(values.size() == 5);
  CHECK(values[0].kept_before == at(9900));
  CHECK(values[0].X.pose.translation().x() == 7);

  // Of so many histories that the owner does not remember the first: all of it.
  for (int i = 0; i < 6; ++i) {
    REQUIRE(slam.forest.rewrite("odom", between(9900, 9950), {{at(9910), along_x(i)}}));
  }
  values = slam.forest.values_since(cursors, {}).values;
  join_histories(values);
  CHECK(values.size() == slam.forest.histories("odom").at(0).samples);
  CHECK_FALSE(values[0].kept_before);
}

TEST_CASE("who watches a joint has all of its way after a rewrite, also to a late position") {
  // More than half a turn before the late position, and less than that before what was there.
  const std::int64_t late = GENERATE(150, 320);
  const Joint joint = revolute_joint(along_x(1), {0, 0, 1});
  Forest robot;
  Forest mirror;
  for (Forest* forest : {&robot, &mirror}) {
    REQUIRE(forest->add("base", "", {}));
    REQUIRE(forest->add("arm", "base", joint_transform(joint, 0, 0)));
    REQUIRE(forest->set_default_timing(long_timing()));
  }
  const auto turn = [&](double position, std::int64_t milliseconds) {
    const CorrelatedUpdate update{*robot.find("arm"),
                                  joint_transform(joint, position, 0.01),
                                  nullptr,
                                  {&joint, {position, 0.01}, 0}};
    REQUIRE(robot.update_correlated({update}, at(milliseconds)));
  };
  std::vector<EdgeCursor> cursors{{"arm", "base"}};
  const auto follow = [&] {
    auto values = robot.values_since(cursors, {}).values;
    join_histories(values);
    mirror.take({*mirror.find("arm")}, values);
  };
  turn(0, 100);
  follow();
  turn(1, 200);
  turn(1, 400);
  follow();
  REQUIRE(robot.rewrite("arm", between(300, 400), {{at(350), along_x(3)}}));
  turn(5, late);
  follow();
  for (std::int64_t t = 100; t <= 350; t += 5) {
    const auto X = robot.lookup("base", "arm", query(t));
    const auto Y = mirror.lookup("base", "arm", query(t));
    INFO("at " << t << ": " << outcome(X) << " and " << outcome(Y));
    REQUIRE(X);
    REQUIRE(Y);
    CHECK(transform_diff(*Y, *X, 1e-9) == "");
  }
}

TEST_CASE("who begins to watch before a rewrite has all of the other history after it") {
  Slam slam;
  for (int i = 0; i < 10; ++i) slam.sample(100 * i, along_x(i));
  // As a group of watchers, whose first one was told the newest value.
  std::vector<EdgeCursor> cursors{{"odom", "world"}};
  cursors[0].commit = slam.forest.newest_commit();
  REQUIRE(slam.forest.rewrite("odom", between(300, 400), {{at(350), along_x(7)}}));
  const auto values = slam.forest.values_since(cursors, {}).values;
  CHECK(values.size() == 9);
}

TEST_CASE("who watches a rewrite knows as well which stamp the owner has made up") {
  Forest owner([] { return at(500); });
  Forest mirror;
  for (Forest* forest : {&owner, &mirror}) {
    REQUIRE(forest->add("world", "", {}));
    REQUIRE(forest->add("odom", "world", along_x(0)));
    REQUIRE(forest->set_default_timing(long_timing()));
  }
  std::vector<EdgeCursor> cursors{{"odom", "world"}};
  const auto follow = [&] {
    auto values = owner.values_since(cursors, {}).values;
    join_histories(values);
    mirror.take({*mirror.find("odom")}, values);
  };
  REQUIRE(owner.update("odom", along_x(0), at(100)));
  follow();
  REQUIRE(owner.update("odom", along_x(1), at(200)));
  follow();
  REQUIRE(owner.update("odom", along_x(2)));  // arrives at 500
  REQUIRE(owner.update("odom", along_x(3), at(510)));
  REQUIRE(owner.rewrite("odom", between(150, 250), {{at(220), along_x(7)}}));
  follow();
  Query beyond = query(515);
  beyond.extrapolate = 1s;
  CHECK(outcome(owner.lookup("world", "odom", beyond)) == "not_yet");
  CHECK(outcome(mirror.lookup("world", "odom", beyond)) == "not_yet");
  REQUIRE(owner.update("odom", along_x(4), at(520)));
  follow();
  beyond.at = at(525);
  CHECK(outcome(owner.lookup("world", "odom", beyond)) == "ok");
  CHECK(outcome(mirror.lookup("world", "odom", beyond)) == "ok");
}

TEST_CASE("what an earlier process has left does not reach into a rewritten history") {
  Slam slam;
  REQUIRE(slam.forest.resume("odom", {}, {at(1000), false}));
  std::vector<EdgeCursor> cursors{{"odom", "world"}};
  REQUIRE(slam.forest.values_since(cursors, {}).values.size() == 1);
  REQUIRE(slam.forest.rewrite("odom", between(2000, 3000), {{at(2000), along_x(2)}}));
  CHECK(slam.x(2000) == 2);
  CHECK(outcome(slam.forest.lookup("world", "odom", query(1500))) == "too_old");
  auto values = slam.forest.values_since(cursors, {}).values;
  join_histories(values);
  REQUIRE(values.size() == 1);
  CHECK(values[0].process_noise);
  CHECK_FALSE(values[0].kept_before);
}

TEST_CASE("a rewrite that cannot be done says why, and changes nothing") {
  Slam slam(20);
  for (int i = 0; i <= 10; ++i) slam.sample(100 * i, along_x(i));
  REQUIRE(slam.forest.add("fixed", "world", along_x(0)));
  REQUIRE(slam.forest.add("wheels", "world", along_x(0)));
  EdgeTiming drifting = long_timing();
  drifting.drifts = true;
  REQUIRE(slam.forest.set_timing("wheels", drifting));
  REQUIRE(slam.forest.update("wheels", along_x(0), at(1)));
  REQUIRE(slam.forest.put_remote("far", "world", 3));
  const std::uint64_t commit = slam.forest.newest_commit();
  const auto why = [&](const std::string& id, const TimeInterval& interval,
                       const std::vector<EdgeSample>& samples) {
    const auto done = slam.forest.rewrite(id, interval, samples);
    return done ? "done" : outcome(done) + ": " + done.error().message;
  };
  const std::vector<EdgeSample> good{{at(300), along_x(1)}};
  CHECK_THAT(why("nobody", between(200, 400), good), ContainsSubstring("unknown_frame"));
  CHECK_THAT(why("far", between(200, 400), good), ContainsSubstring("not_owner"));
  CHECK_THAT(why("fixed", between(200, 400), good), ContainsSubstring("static"));
  CHECK_THAT(why("wheels", between(200, 400), good), ContainsSubstring("drifts"));
  CHECK_THAT(why("odom", between(400, 200), good), ContainsSubstring("invalid_input"));
  CHECK_THAT(why("odom", between(-5, 400), good), ContainsSubstring("negative"));
  CHECK_THAT(why("odom", between(200, 400), {}), ContainsSubstring("no samples"));
  CHECK_THAT(why("odom", between(200, 299), good), ContainsSubstring("outside of the interval"));
  CHECK_THAT(why("odom", between(200, 400), {{at(300), along_x(1)}, {at(300), along_x(2)}}),
             ContainsSubstring("sample 1"));
  CHECK_THAT(why("odom", between(200, 400),
                 {{at(300), along_x(std::numeric_limits<double>::quiet_NaN())}}),
             ContainsSubstring("invalid_input"));
  std::vector<EdgeSample> many;
  for (int i = 0; i < 15; ++i) many.push_back({at(201 + i), along_x(i)});
  CHECK_THAT(why("odom", between(200, 400), many), ContainsSubstring("too_much"));
  EdgeTiming short_one = long_timing();
  short_one.span = 500ms;
  REQUIRE(slam.forest.add("short", "world", along_x(0)));
  REQUIRE(slam.forest.set_timing("short", short_one));
  REQUIRE(slam.forest.update("short", along_x(0), at(1000)));
  CHECK_THAT(why("short", between(200, 400), good), ContainsSubstring("too_old"));
  CHECK(slam.forest.newest_commit() == commit + 3);  // the new frame, its timing and its sample
  for (int i = 0; i <= 10; ++i) CHECK(slam.x(100 * i) == i);
  CHECK(slam.forest.rewrite("odom", between(200, 400), good));
}

TEST_CASE("a stamp that is ahead of the owner's clock is rejected in a rewrite, too") {
  Forest forest([] { return at(1000); });
  REQUIRE(forest.add("world", "", {}));
  REQUIRE(forest.add("odom", "world", along_x(0)));
  REQUIRE(forest.update("odom", along_x(0), at(900)));
  CHECK(outcome(forest.rewrite("odom", between(0, 1'000'000), {{at(100'000), along_x(1)}})) ==
        "invalid_input");
  CHECK(forest.rewrite("odom", between(0, 1'000'000), {{at(1001), along_x(1)}}));
}

// An observation has tied both edges: their errors have a part in common, which cancels.
struct Tied {
  explicit Tied(Random& random) : F(random.loading(2)), own(random.covariance()) {
    REQUIRE(forest.add("world", "", {}));
    for (const std::string id : {"a", "b"}) {
      REQUIRE(forest.add(id, "world", {Pose(), random.covariance()}));
      REQUIRE(forest.set_timing(id, long_timing()));
      REQUIRE(forest.update(id, {Pose(), own}, at(1000)));
      REQUIRE(forest.update(id, {Pose(), own}, at(2000)));
    }
    const std::uint64_t seen = forest.newest_commit();
    const std::vector<CommonError> tie{{"observed:x", false, F}};
    REQUIRE(forest.revise(
        {{"a", {Pose(), own}, {false, tie, {"b"}}}, {"b", {Pose(), own}, {false, tie, {"a"}}}},
        at(1000), seen));
  }
  [[nodiscard]] Matrix6d covariance(std::int64_t ms) const {
    return forest.lookup("a", "b", query(ms)).value().covariance.of_specified().matrix();
  }

  Loading F;
  Covariance own;
  Forest forest;
};

TEST_CASE("a rewritten sample has lost what an observation had tied it to") {
  Random random(92);
  INFO("seed " << random.seed());
  Tied tied(random);
  const Matrix6d own = tied.own.matrix();
  REQUIRE((tied.covariance(1000) - 2 * own).norm() < 1e-12);  // the common part cancels
  const Covariance given = random.covariance();
  const auto after = GENERATE(1000, 1500);
  REQUIRE(tied.forest.rewrite("a", between(500, after), {{at(1000), {Pose(), given}}}));
  // Independent of b, which still has all of its own error.
  const Matrix6d expected = given.matrix() + own + tied.F * tied.F.transpose();
  CHECK((tied.covariance(1000) - expected).norm() < 1e-12);
}

TEST_CASE("an observation that has seen samples which were rewritten since is rejected") {
  Random random(93);
  INFO("seed " << random.seed());
  Tied tied(random);
  const std::uint64_t seen = tied.forest.newest_commit();
  // Between both samples, of which none is written again.
  REQUIRE(tied.forest.update("a", {Pose(), tied.own}, at(3000)));
  REQUIRE(tied.forest.update("a", {Pose(), tied.own}, at(4000)));
  REQUIRE(tied.forest.rewrite("a", between(2500, 3500), {{at(2600), {Pose(), tied.own}}}));
  const auto revised = tied.forest.revise({{"a", {Pose(), tied.own}, {}}}, at(1500), seen);
  CHECK(outcome(revised) == "changed_meanwhile");
}

// ---- readers beside rewrites

// Generation k says k at all instants, at stamps of its own.
std::vector<EdgeSample> generation(int k, std::int64_t from, std::int64_t to) {
  std::vector<EdgeSample> samples;
  samples.push_back({at(from), along_x(k)});
  for (std::int64_t t = from + 1 + k % 7; t < to; t += 3 + k % 5) {
    samples.push_back({at(t), along_x(k)});
  }
  samples.push_back({at(to), along_x(k)});
  return samples;
}

TEST_CASE("every reader has the history before a rewrite or after it, never a part of both") {
  constexpr std::int64_t kFrom = 1000;
  constexpr std::int64_t kTo = 1400;
  const int enough_states = 300;
  testing::SharedForest shared;
  Forest& forest = shared.forest;
  REQUIRE(forest.add("world", "", {}));
  REQUIRE(forest.add("odom", "world", along_x(0)));
  REQUIRE(forest.set_timing("odom", long_timing()));
  REQUIRE(forest.update("odom", along_x(1), at(kFrom)));
  REQUIRE(forest.rewrite("odom", between(kFrom, kTo), generation(1, kFrom, kTo)));
  REQUIRE(forest.update("odom", along_x(-1), at(kTo + 500)));

  Forest here;  // of another process, that reads the memory
  REQUIRE(here.put_remote("world", "", 1));
  REQUIRE(here.put_remote("odom", "world", 1));
  RemoteEdges others;
  others.attach(1, shared.seen(), nullptr);
  REQUIRE(here.bind("world", "odom", others) == 1);

  std::atomic<bool> stop{false};
  std::atomic<int> wrong{0};
  std::atomic<int> seen[3] = {{0}, {0}, {0}};  // states, by reader
  const auto judge = [&](int reader, double x, double& last) {
    if (x != std::floor(x) || x < last) wrong = reader + 1;
    if (x > last) ++seen[reader];
    last = std::max(last, x);
  };
  const auto look = [&](int reader, auto lookup) {
    Random random(static_cast<std::uint64_t>(reader) + 1);
    double last = 0;
    while (!stop) {
      const auto t = kFrom + static_cast<std::int64_t>(random.index(kTo - kFrom + 1));
      const auto X = lookup(query(t));
      if (X) judge(reader, X->pose.translation().x(), last);
    }
  };
  std::vector<std::thread> readers;
  readers.emplace_back(
      [&] { look(0, [&](const Query& q) { return forest.lookup("world", "odom", q); }); });
  readers.emplace_back(
      [&] { look(1, [&](const Query& q) { return here.lookup("world", "odom", q, others); }); });
  readers.emplace_back([&] {  // all samples at once
    double last = 0;
    while (!stop) {
      std::vector<EdgeCursor> nothing{{"odom", "world"}};
      auto values = forest.values_since(nothing, {false, at(kFrom)}).values;
      values.pop_back();  // the one after the interval
      for (const PushedValue& value : values) {
        if (value.X.pose.translation().x() != values[0].X.pose.translation().x()) wrong = 4;
      }
      if (values.front().stamp != at(kFrom) || values.back().stamp != at(kTo)) wrong = 5;
      judge(2, values[0].X.pose.translation().x(), last);
    }
  });
  const auto enough = [&] {
    return std::all_of(std::begin(seen), std::end(seen),
                       [&](const auto& n) { return n > enough_states; });
  };
  for (int k = 2; !enough() && wrong == 0 && k < 200'000; ++k) {
    if (!forest.rewrite("odom", between(kFrom, kTo), generation(k, kFrom, kTo))) wrong = 6;
  }
  stop = true;
  for (std::thread& reader : readers) reader.join();
  CHECK(wrong == 0);
  for (const auto& n : seen) CHECK(n > 10);
}

// ---- size

TEST_CASE("ten minutes at 100 Hz are rewritten in 50 ms", "[.measure]") {
  Random random(7);
  Slam slam;
  std::vector<EdgeSample> samples;
  for (int i = 0; i < 60'000; ++i) {
    const Transform X = random.transform();
    slam.sample(10 * i, X);
    samples.push_back({at(10 * i), random.transform()});
  }
  for (const bool own : {true, false}) {
    for (EdgeSample& one : samples) {
      if (!own) one.X_PC.covariance = samples[0].X_PC.covariance;
    }
    double best = 1e9;
    for (int i = 0; i < 10; ++i) {
      const auto begin = std::chrono::steady_clock::now();
      REQUIRE(slam.forest.rewrite("odom", between(0, 600'000), samples));
      const std::chrono::duration<double, std::milli> took =
          std::chrono::steady_clock::now() - begin;
      best = std::min(best, took.count());
      WARN((own ? "each its own covariance: " : "one covariance: ") << took.count() << " ms");
    }
    CHECK(best <= 50);
  }
}

}  // namespace
}  // namespace tfdude
