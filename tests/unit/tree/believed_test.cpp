// What was believed before: the answers of lookups are remembered by the test, and asked for later.

#include <chrono>
#include <cmath>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "tfdude/math/joint.hpp"
#include "tfdude/math/observation.hpp"

#include "support/catch.hpp"
#include "support/forest_support.hpp"
#include "support/pose_diff.hpp"
#include "support/random.hpp"
#include "tree/forest.hpp"

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

EdgeTiming remembering(std::chrono::nanoseconds believed = 30s) {
  EdgeTiming timing;
  timing.max_ahead = std::chrono::nanoseconds::max();
  timing.believed = believed;
  return timing;
}

Query asked(std::optional<Time> instant, std::optional<Time> believed_at = {}) {
  Query query;
  query.at = instant;
  query.believed_at = believed_at;
  return query;
}

/// A forest with a clock that the test sets.
struct Clocked {
  Clocked() { now = at(100'000); }

  Time now;
  Forest forest{[this] { return std::optional(now); }};
};

/// Answers of lookups when they were current.
struct Answer {
  std::string a;
  std::string b;
  Query query;
  Result<StampedTransform> X_AB;
  Result<SegmentValues> edges;
};

std::string difference(const Result<StampedTransform>& found,
                       const Result<StampedTransform>& expected) {
  if (!found || !expected) {
    return outcome(found) == outcome(expected)
               ? ""
               : outcome(found) + " instead of " + outcome(expected) + ": " +
                     (found ? "" : found.error().message);
  }
  if (found->stamp != expected->stamp) return "another stamp";
  if (found->basis.sources != expected->basis.sources) return "other sources";
  if (found->basis.unspecified != expected->basis.unspecified) return "unspecified differs";
  if (found->basis.bound != expected->basis.bound) return "bound differs";
  if (found->covariance.complete() != expected->covariance.complete()) return "complete differs";
  return transform_diff(*found, *expected, 1e-12);
}

std::string difference(const Result<SegmentValues>& found, const Result<SegmentValues>& expected) {
  if (!found || !expected) return outcome(found) == outcome(expected) ? "" : outcome(found);
  if (found->stamp != expected->stamp || found->period != expected->period) return "stamps differ";
  if (found->values.size() != expected->values.size()) return "values differ";
  if (found->correlations.size() != expected->correlations.size()) return "correlations differ";
  for (std::size_t i = 0; i < found->values.size(); ++i) {
    const std::string values = transform_diff(found->values[i], expected->values[i], 1e-12);
    if (!values.empty()) return values;
  }
  for (std::size_t i = 0; i < found->correlations.size(); ++i) {
    if (found->correlations[i].common_errors.size() !=
        expected->correlations[i].common_errors.size()) {
      return "common errors differ";
    }
  }
  return "";
}

/// world -> odom -> tool, world -> mast -> camera, and tool -> finger, which a joint moves, changed
/// at random.
class Changed : public Clocked {
 public:
  explicit Changed(std::uint64_t seed) : random(seed) {
    EdgeTiming timing = remembering();
    timing.count = 40;
    timing.span = 3s;
    REQUIRE(forest.set_default_timing(timing));
    REQUIRE(forest.add("world", "", {}));
    for (const auto& [id, parent] : edges) REQUIRE(forest.add(id, parent, random.transform()));
    timing.process_noise = random.covariance();
    REQUIRE(forest.set_timing("tool", timing));
    timing.drifts = true;
    REQUIRE(forest.set_timing("odom", timing));
    timing.drifts = false;
    timing.moving = true;
    timing.process_noise = {};
    REQUIRE(forest.set_timing("camera", timing));
    joint = revolute_joint(random.transform(), {0, 0, 1});
  }

  /// @return what was done; some is rejected
  std::string change() {
    now += std::chrono::nanoseconds(1 + static_cast<std::int64_t>(random.index(100 * kMs)));
    const std::string& id = edges[random.index(edges.size())].first;
    const Time late = now - std::chrono::nanoseconds(random.index(3000 * kMs));
    switch (random.index(16)) {
      case 0:
      case 1:
        return "late " + id + ": " + outcome(forest.update(id, value(), late));
      case 2:
        return "rewrite " + id + ": " + outcome(rewrite(id, late));
      case 3:
        return random.index(4) > 0 ? "" : "clear " + id + ": " + outcome(forest.clear_history(id));
      case 4:
        if (random.index(8) == 0) (void)forest.clear_histories(late);
        return "clear";
      case 5:
        return "say of " + id + ": " + outcome(forest.correlate(id, said()));
      case 6:
      case 7:
      case 8:
        return "observe: " + outcome(observe(random.index(2) == 0 ? now : late));
      case 9:
        return "unstamped " + id + ": " + outcome(forest.update(id, value()));
      case 10:
        return "turn: " + outcome(turn(random.index(3) == 0 ? late : now));
      default: {
        const std::string& dynamic = edges[1 + random.index(4)].first;
        return "update " + dynamic + ": " + outcome(forest.update(dynamic, value(), now));
      }
    }
  }

  /// What is answered now at a random instant.
  Answer answer() {
    static const std::vector<std::string> ids{"world", "odom", "tool", "mast", "camera", "finger"};
    Answer one;
    one.a = ids[random.index(ids.size())];
    one.b = ids[random.index(ids.size())];
    if (random.index(4) > 0) {
      one.query.at = now - std::chrono::nanoseconds(random.index(4000 * kMs)) + 500ms;
    }
    if (random.index(2) == 0) one.query.extrapolate = std::chrono::milliseconds(random.index(900));
    if (random.index(4) == 0) one.query.age_noise_until = now;
    if (random.index(4) == 0) one.query.order = Order::kFourth;
    one.X_AB = forest.lookup(one.a, one.b, one.query);
    one.edges = forest.lookup_segments(of_edges(), one.query, now - 1s, true);
    one.query.believed_at = now;
    return one;
  }
  std::string compare(const Answer& one) const {
    const std::string differs = difference(forest.lookup(one.a, one.b, one.query), one.X_AB);
    if (!differs.empty()) return differs;
    return difference(
        forest.lookup_segments(of_edges(), one.query, *one.query.believed_at - 1s, true),
        one.edges);
  }

  Random random;

 private:
  Transform value() {
    Transform X = random.transform();
    if (random.index(12) == 0) X.covariance = StatedCovariance::unspecified();
    return X;
  }
  Correlation said() {
    Correlation correlation;
    correlation.unknown = random.index(6) == 0;
    if (random.index(2) == 0) {
      correlation.common_errors.push_back(
          {"supply", false, 0.01 * Matrix6d::Identity().leftCols<2>()});
    }
    return correlation;
  }
  Result<void> rewrite(const std::string& id, Time from) {
    const Time to = from + std::chrono::milliseconds(1 + random.index(1000));
    std::vector<EdgeSample> samples;
    for (Time t = from; t <= to; t += std::chrono::milliseconds(10 + random.index(300))) {
      samples.push_back({t, value()});
    }
    return forest.rewrite(id, {from, to}, samples);
  }
  Result<void> observe(Time stamp) {
    const std::vector<std::string> ids{"odom", "tool"};
    const auto seen =
        forest.lookup_segments({{"world", "odom"}, {"odom", "tool"}}, asked(stamp), {}, true);
    if (!seen) return tl::unexpected(seen.error());
    std::vector<ObservedEdge> observed;
    for (std::size_t i = 0; i < ids.size(); ++i) {
      const PathCorrelation none;
      observed.push_back(
          {belief_of(seen->values[i], seen->correlations.empty() ? none : seen->correlations[i]),
           ObservedEdge::Way::kDown});
    }
    const auto found =
        tfdude::observe(observed, random.transform(),
                        std::string(kObservedPrefix) + std::to_string(++observations), {1.0, true});
    if (!found) return tl::unexpected(found.error());
    std::vector<Revision> revisions;
    for (std::size_t i = 0; i < ids.size(); ++i) {
      const Belief& X = found->edges[i].X_PC;
      revisions.push_back({ids[i], {X.pose, X.own}, {false, X.common_errors, {ids[1 - i]}}});
    }
    return forest.revise(revisions, stamp, seen->commit);
  }
  Result<void> turn(Time stamp) {
    const double position = random.uniform(-3, 3);
    const CorrelatedUpdate update{*forest.find("finger"),
                                  joint_transform(joint, position, 0.01),
                                  nullptr,
                                  {&joint, {position, 0.01}, 0}};
    return forest.update_correlated({update}, stamp);
  }
  std::vector<PathEnds> of_edges() const {
    return {{"world", "odom"}, {"odom", "tool"}, {"mast", "camera"}};
  }

  // Parents first; the first one stays static for a while.
  const std::vector<std::pair<std::string, std::string>> edges{{"mast", "world"},
                                                               {"odom", "world"},
                                                               {"tool", "odom"},
                                                               {"camera", "mast"},
                                                               {"finger", "tool"}};
  Joint joint;
  int observations = 0;
};

}  // namespace

TEST_CASE("believed: what was answered is answered again, whatever came later") {
  const auto seed = GENERATE(range(1, 25));
  Changed owner(static_cast<std::uint64_t>(seed));
  INFO("seed " << owner.random.seed());
  std::vector<Answer> answers;
  std::vector<std::string> done;
  int found = 0;
  for (int step = 0; step < 300; ++step) {
    done.push_back(owner.change());
    for (int i = 0; i < 3; ++i) {
      answers.push_back(owner.answer());
      found += answers.back().X_AB ? 1 : 0;
    }
    const Answer& one = answers[owner.random.index(answers.size())];
    INFO("step " << step << ", of " << one.a << " " << one.b);
    REQUIRE(owner.compare(one) == "");
  }
  CHECK(found > 100);
  for (std::size_t i = 0; i < answers.size(); ++i) {
    const Answer& one = answers[i];
    INFO("after step " << i / 3 << " (" << done[i / 3] << "), of " << one.a << " " << one.b);
    REQUIRE(owner.compare(one) == "");
  }
}

TEST_CASE("believed: an edge that remembers nothing is named, unless it has not changed") {
  Clocked owner;
  Forest& forest = owner.forest;
  REQUIRE(forest.add("world", "", {}));
  REQUIRE(forest.add("odom", "world", along_x(1)));
  REQUIRE(forest.add("hand", "odom", along_x(1)));
  const auto none = forest.lookup("world", "hand", asked({}, owner.now));
  CHECK(outcome(none) == "too_old");
  CHECK_THAT(none.error().message, ContainsSubstring("'hand'") && ContainsSubstring("`believed`"));

  REQUIRE(forest.set_timing("odom", remembering()));
  owner.now += 1s;
  REQUIRE(forest.update("odom", along_x(2)));
  owner.now += 1s;
  CHECK(forest.lookup("world", "hand", asked({}, owner.now - 1500ms))->pose.translation().x() == 2);
  CHECK(forest.lookup("world", "hand", asked({}, owner.now - 1s))->pose.translation().x() == 3);
  REQUIRE(forest.update("hand", along_x(5)));
  const auto changed = forest.lookup("world", "hand", asked({}, owner.now - 1s));
  CHECK(outcome(changed) == "too_old");
  CHECK_THAT(changed.error().message, ContainsSubstring("'hand'"));
  CHECK(changed.error().frame == "hand");
  CHECK(forest.lookup("world", "odom", asked({}, owner.now - 1s))->pose.translation().x() == 2);
  CHECK(forest.lookup("world", "hand", asked({}, owner.now))->pose.translation().x() == 7);
}

TEST_CASE("believed: what is older than configured, or in the future, is an error") {
  Clocked owner;
  Forest& forest = owner.forest;
  REQUIRE(forest.set_default_timing(remembering(2s)));
  REQUIRE(forest.add("world", "", {}));
  REQUIRE(forest.add("odom", "world", along_x(0)));
  for (int i = 0; i < 100; ++i) {
    REQUIRE(forest.update("odom", along_x(i)));
    owner.now += 100ms;
  }
  for (int i = 0; i < 100; ++i) {
    const auto X = forest.lookup("world", "odom", asked({}, at(100'000 + 100 * i)));
    if (i >= 79) {
      CHECK(X->pose.translation().x() == i);
    } else if (i < 78) {
      CHECK(outcome(X) == "too_old");
      CHECK_THAT(X.error().message, ContainsSubstring("'odom'") && ContainsSubstring("since"));
    }
  }
  CHECK(forest.lookup("world", "odom", asked({}, owner.now)));
  CHECK(outcome(forest.lookup("world", "odom", asked({}, owner.now + 1ns))) == "not_yet");
}

TEST_CASE("believed: a clock that is set back ends what is remembered") {
  Clocked owner;
  Forest& forest = owner.forest;
  REQUIRE(forest.set_default_timing(remembering()));
  REQUIRE(forest.add("world", "", {}));
  REQUIRE(forest.add("odom", "world", along_x(0)));
  for (int i = 0; i < 10; ++i) {
    REQUIRE(forest.update("odom", along_x(i), at(1000 + i)));
    owner.now += 1s;
  }
  const Time before = owner.now;
  owner.now -= 5s;
  REQUIRE(forest.update("odom", along_x(10), at(1010)));
  const Time back = owner.now;
  owner.now += 3s;
  REQUIRE(forest.update("odom", along_x(11), at(1011)));
  CHECK(outcome(forest.lookup("world", "odom", asked({}, back - 1ns))) == "too_old");
  CHECK(forest.lookup("world", "odom", asked({}, back))->pose.translation().x() == 10);
  CHECK(forest.lookup("world", "odom", asked(at(1005), back))->pose.translation().x() == 5);
  CHECK(outcome(forest.lookup("world", "odom", asked({}, before))) == "not_yet");
}

TEST_CASE("believed: of a frame that was moved, what it was elsewhere is no answer") {
  Clocked owner;
  Forest& forest = owner.forest;
  REQUIRE(forest.set_default_timing(remembering()));
  REQUIRE(forest.add("world", "", {}));
  REQUIRE(forest.add("odom", "world", along_x(0)));
  REQUIRE(forest.add("hand", "odom", along_x(1)));
  REQUIRE(forest.update("hand", along_x(2), at(1000)));
  REQUIRE(forest.update("hand", along_x(3), at(2000)));
  owner.now += 1s;
  REQUIRE(forest.move("hand", "world", along_x(7)));
  const Time moved = owner.now;
  owner.now += 1s;
  REQUIRE(forest.update("hand", along_x(8)));
  const auto before = forest.lookup("world", "hand", asked({}, moved - 1ns));
  CHECK(outcome(before) == "too_old");
  CHECK_THAT(before.error().message, ContainsSubstring("'hand'"));
  CHECK(forest.lookup("world", "hand", asked({}, moved))->pose.translation().x() == 7);
  REQUIRE(forest.put_remote("foot", "world", 3));
  REQUIRE(forest.put_remote("toe", "foot", 3));
  CHECK(outcome(forest.lookup("hand", "toe", asked({}, moved - 1ns))) == "not_owner");
  REQUIRE(forest.add("island", "", {}));
  CHECK(outcome(forest.lookup("hand", "island", asked({}, moved - 1ns))) == "not_connected");
  CHECK(outcome(forest.lookup("hand", "nobody", asked({}, moved))) == "unknown_end");
}

TEST_CASE("believed: memory is limited, and no sample of now is dropped for what was before") {
  Clocked owner;
  Forest& forest = owner.forest;
  constexpr std::size_t kSamples = 1000;
  EdgeTiming timing = remembering(1h);
  timing.count = kSamples;
  timing.span = 1h;
  REQUIRE(forest.set_default_timing(timing));
  REQUIRE(forest.add("world", "", {}));
  REQUIRE(forest.add("odom", "world", along_x(0)));
  // Its samples take 88 bytes each, and with all that is remembered this would be exceeded.
  forest.limit_history(kSamples * 200);
  const auto began = owner.now;
  for (std::size_t i = 0; i < 10 * kSamples; ++i) {
    REQUIRE(forest.update("odom", along_x(static_cast<double>(i)), owner.now));
    owner.now += 1ms;
  }
  CHECK(forest.dropped_samples() == 0);
  CHECK(forest.histories("odom").at(0).samples == kSamples);
  CHECK(forest.lookup("world", "odom", asked({}, owner.now - 500ms)));
  CHECK(outcome(forest.lookup("world", "odom", asked({}, began + 1s))) == "too_old");
  // Samples that would be too many themselves leave no room for others.
  forest.limit_history(kSamples * 40);
  REQUIRE(forest.update("odom", along_x(0), owner.now));
  CHECK(forest.dropped_samples() > 0);
  CHECK(forest.lookup("world", "odom", asked({}, owner.now)));
}

TEST_CASE("believed: negative times are rejected by name") {
  Forest forest;
  EdgeTiming timing;
  timing.believed = -1ns;
  const auto set = forest.set_default_timing(timing);
  CHECK(outcome(set) == "invalid_input");
  CHECK_THAT(set.error().message, ContainsSubstring("believed"));
}

}  // namespace tfdude
