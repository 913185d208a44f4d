#include <chrono>

#include "support/catch.hpp"
#include "support/pose_diff.hpp"
#include "support/random.hpp"
#include "tree/forest.hpp"

namespace tfdude {
namespace {

using namespace std::chrono_literals;
using testing::ContainsSubstring;
using testing::covariance_diff;
using testing::Random;
using testing::transform_diff;

Time at(std::chrono::milliseconds since) { return Time(1'000'000s + since); }

CommonError common_error(Random& random, const std::string& source) {
  const Loading loading =
      Loading::NullaryExpr(6, 2, [&](auto, auto) { return 0.01 * random.normal(); });
  return {source, false, loading};
}

Correlation shared(const CommonError& common_error) { return {false, {common_error}, {}}; }

// world ─ a ─ b, and world ─ c.
class Robot {
 public:
  explicit Robot(Random& random) {
    add("world", "", {});
    X_WA = add("a", "world", random.transform());
    X_AB = add("b", "a", random.transform());
    X_WC = add("c", "world", random.transform());
  }
  Transform add(const std::string& id, const std::string& parent, const Transform& X) {
    REQUIRE(forest.add(id, parent, X));
    return X;
  }

  Forest forest{[] { return at(0ms); }};
  Transform X_WA;
  Transform X_AB;
  Transform X_WC;
};

Belief with(const Transform& X, std::vector<CommonError> common_errors) {
  return {X.pose, X.covariance.of_specified(), std::nullopt, std::move(common_errors)};
}

TEST_CASE("A lookup counts a common source once in any direction") {
  Random random(651);
  INFO("seed " << random.seed());
  Robot robot(random);
  const CommonError s = common_error(random, "s");
  const CommonError t = common_error(random, "s");
  REQUIRE(robot.forest.correlate("a", shared(s)));
  REQUIRE(robot.forest.correlate("c", shared(t)));
  const Belief expected =
      compose(inverse(with(robot.X_WA, {s})), with(robot.X_WC, {t}), Order::kSecond);
  const auto X_AC = robot.forest.lookup("a", "c");
  REQUIRE(X_AC);
  CHECK(transform_diff(*X_AC, collapse(expected), 1e-12) == "");
  const auto with_basis = robot.forest.lookup("a", "c", Query{});
  REQUIRE(with_basis);
  CHECK(transform_diff(*with_basis, *X_AC, 1e-12) == "");
  CHECK(with_basis->basis.sources == std::vector<std::string>{"s"});
  CHECK_FALSE(with_basis->basis.bound);
  // The same error on both sides of a mounting is none between them.
  REQUIRE(robot.forest.update("c", robot.X_WA));
  REQUIRE(robot.forest.correlate("c", shared(s)));
  const auto X_exact = robot.forest.lookup("a", "c");
  REQUIRE(X_exact);
  const Transform own = between(robot.X_WA, robot.X_WA);
  CHECK(covariance_diff(X_exact->covariance, own.covariance, 1e-12) == "");
  // A path without the source does not list it.
  const auto X_AB = robot.forest.lookup("a", "b", Query{});
  REQUIRE(X_AB);
  CHECK(X_AB->basis.sources.empty());
  CHECK(transform_diff(*X_AB, robot.X_AB, 1e-12) == "");
}

TEST_CASE("A path with unknown correlation gets a bound and reports it") {
  Random random(652);
  INFO("seed " << random.seed());
  Robot robot(random);
  REQUIRE(robot.forest.correlate("a", {true, {}, {}}));
  REQUIRE(robot.forest.correlate("b", {true, {}, {}}));
  const auto X_WB = robot.forest.lookup("world", "b", Query{});
  REQUIRE(X_WB);
  CHECK(X_WB->basis.bound);
  const Covariance moved =
      robot.X_WA.covariance.of_specified().transported(robot.X_AB.pose.inverse());
  CHECK(covariance_diff(X_WB->covariance, bound(moved, robot.X_AB.covariance.of_specified()),
                        1e-12) == "");
  REQUIRE(robot.forest.correlate("a", {}));
  REQUIRE(robot.forest.correlate("b", {}));
  const auto independent = robot.forest.lookup("world", "b", Query{});
  REQUIRE(independent);
  CHECK_FALSE(independent->basis.bound);
  CHECK(transform_diff(*independent, compose(robot.X_WA, robot.X_AB), 1e-12) == "");
}

TEST_CASE("A lookup to fourth order composes the beliefs and reports its order") {
  Random random(653);
  INFO("seed " << random.seed());
  Forest forest;
  const Transform X_WA = random.transform(1.0, 0.3, 0.3);
  const Transform X_WB = random.transform(1.0, 0.3, 0.3);
  REQUIRE(forest.add("world", "", {}));
  REQUIRE(forest.add("a", "world", X_WA));
  REQUIRE(forest.add("b", "world", X_WB));
  Query query;
  query.order = Order::kFourth;
  const auto X_AB = forest.lookup("a", "b", query);
  REQUIRE(X_AB);
  CHECK(X_AB->basis.order == Order::kFourth);
  const Belief expected = compose(inverse(with(X_WA, {})), with(X_WB, {}), Order::kFourth);
  CHECK(transform_diff(*X_AB, collapse(expected), 1e-12) == "");
  const auto second = forest.lookup("a", "b", Query{});
  REQUIRE(second);
  CHECK(covariance_diff(X_AB->covariance, second->covariance, 0.01) != "");
}

TEST_CASE("A source is counted also at an instant between samples") {
  Random random(654);
  INFO("seed " << random.seed());
  Robot robot(random);
  const CommonError s = common_error(random, "s");
  REQUIRE(robot.forest.correlate("a", shared(s)));
  REQUIRE(robot.forest.correlate("b", shared(s)));
  const Transform still = Transform::exact(robot.X_WA.pose);
  REQUIRE(robot.forest.update("a", still, at(0ms)));
  REQUIRE(robot.forest.update("a", still, at(10ms)));
  REQUIRE(robot.forest.update("b", still, at(0ms)));
  REQUIRE(robot.forest.update("b", still, at(10ms)));
  Query query;
  query.at = at(3ms);
  const auto then = robot.forest.lookup("world", "b", query);
  const auto newest = robot.forest.lookup("world", "b");
  const Transform expected = collapse(compose(with(still, {s}), with(still, {s}), Order::kSecond));
  REQUIRE(then);
  REQUIRE(newest);
  CHECK(transform_diff(*then, expected, 1e-9) == "");
  CHECK(transform_diff(*newest, expected, 1e-9) == "");
}

TEST_CASE("Segments have their correlation so a caller can compose the whole path") {
  Random random(655);
  INFO("seed " << random.seed());
  Robot robot(random);
  REQUIRE(robot.forest.correlate("a", shared(common_error(random, "s"))));
  REQUIRE(robot.forest.correlate(
      "b", {true, {common_error(random, "s"), common_error(random, "t")}, {}}));
  const auto parts = robot.forest.lookup_segments({{"c", "world"}, {"world", "a"}, {"a", "b"}});
  REQUIRE(parts);
  REQUIRE(parts->correlations.size() == 3);
  CHECK(parts->correlations[0].empty());
  Belief X;
  for (std::size_t i = 0; i < 3; ++i) {
    X = compose(X, belief_of(parts->values[i], parts->correlations[i]), Order::kSecond);
  }
  const auto whole = robot.forest.lookup("c", "b");
  REQUIRE(whole);
  CHECK(transform_diff(collapse(X), *whole, 1e-9) == "");
  const auto uncorrelated = robot.forest.lookup_segments({{"c", "world"}});
  REQUIRE(uncorrelated);
  CHECK(uncorrelated->correlations.empty());
}

// At the centre of the Earth, the errors before the observation are as large as 100,000 km.
TEST_CASE("What was observed is as certain seen from the centre of the Earth") {
  Random random(663);
  INFO("seed " << random.seed());
  Forest forest{[] { return at(0ms); }};
  Pose far = random.pose();
  far = Pose::trusted(far.rotation(), 6.4e6 * random.direction());
  REQUIRE(forest.add("earth", "", {}));
  REQUIRE(forest.add("map", "earth", Transform::exact(far)));
  std::vector<ObservedEdge> edges;
  Pose X_MB;
  for (const auto& [id, parent] : {std::pair("a", "map"), {"b", "a"}}) {
    const Transform X{random.pose(), random.covariance(0.05, 0.05)};
    REQUIRE(forest.add(id, parent, X));
    edges.push_back({with(X, {}), ObservedEdge::Way::kDown});
    X_MB = X_MB * X.pose;
  }
  const Covariance R = random.covariance(1e-3, 1e-4);
  const auto found = observe(edges, {X_MB, R}, "observed:1", {1.0, true});
  REQUIRE(found);
  std::vector<Revision> revisions;
  for (const std::size_t i : {0U, 1U}) {
    const Belief& X = found->edges[i].X_PC;
    revisions.push_back({i == 0 ? "a" : "b", {X.pose, X.own}, {false, X.common_errors, {}}});
  }
  REQUIRE(forest.revise(revisions, std::nullopt, UINT64_MAX));
  // Of one pose, whose prior is that of both edges: P - P (P + R)⁻¹ P, in the axes of b.
  const Matrix6d back = adjoint(edges[1].X_PC.pose.inverse());
  const Matrix6d P =
      edges[1].X_PC.own.matrix() + back * edges[0].X_PC.own.matrix() * back.transpose();
  const Matrix6d left = P - P * (P + R.matrix()).inverse() * P;
  const auto X = forest.lookup("b", "earth");
  REQUIRE(X);
  const Matrix6d in_b = inverse(*X).covariance.of_specified().matrix();
  const Twist scale = left.diagonal().cwiseSqrt().cwiseInverse();
  CHECK((scale.asDiagonal() * (in_b - left) * scale.asDiagonal()).norm() < 1e-3);
}

TEST_CASE("A revision of static edges holds until their next update") {
  Random random(656);
  INFO("seed " << random.seed());
  Robot robot(random);
  const CommonError said = common_error(random, "s");
  REQUIRE(robot.forest.correlate("a", shared(said)));
  const auto edges = std::vector<PathEnds>{{"world", "a"}, {"a", "b"}};
  const auto seen = robot.forest.lookup_segments(edges, {}, std::nullopt, true);
  REQUIRE(seen);
  CommonError observed = common_error(random, "observed:1");
  observed.subtracts = true;
  observed.loading *= 0.01;
  const Correlation now{false, {said, observed}, {"a", "b"}};
  REQUIRE(robot.forest.revise({{"a", robot.X_WA, now}, {"b", robot.X_AB, now}}, std::nullopt,
                              seen->commit));
  const auto after = robot.forest.lookup_segments(edges, {}, std::nullopt, true);
  REQUIRE(after);
  CHECK(after->correlations[0].common_errors.size() == 2);
  CHECK(after->correlations[1].observed_with == std::vector<std::string>{"a", "b"});
  // The edge has changed since it was looked up.
  const auto again = robot.forest.revise({{"a", robot.X_WA, now}}, std::nullopt, seen->commit);
  REQUIRE_FALSE(again);
  CHECK(again.error().code == Errc::kChangedMeanwhile);
  REQUIRE(robot.forest.update("a", robot.X_WA));
  const auto updated = robot.forest.lookup_segments(edges, {}, std::nullopt, true);
  REQUIRE(updated);
  CHECK(updated->correlations[0].common_errors.size() == 1);
  CHECK(updated->correlations[0].observed_with.empty());
  CHECK(updated->correlations[1].common_errors.size() == 2);
}

TEST_CASE("The last sample that was observed is a row, until a later one is observed without it") {
  Random random(658);
  INFO("seed " << random.seed());
  Robot robot(random);
  std::vector<Transform> given;
  for (int i = 0; i < 4; ++i) {
    given.push_back(random.transform());
    REQUIRE(robot.forest.update("a", given.back(), at(10ms * i)));
  }
  const Transform X = random.transform();
  const CommonError observed = common_error(random, "observed:1");
  REQUIRE(robot.forest.revise({{"a", X, {false, {observed}, {"a", "b"}}}}, at(20ms), UINT64_MAX));
  const auto asked = [&](std::chrono::microseconds since, Rows rows) {
    Query query;
    query.at = Time(1'000'000s + since);
    return robot.forest.lookup_segments({{"world", "a"}}, query, std::nullopt, true, rows).value();
  };
  for (const Rows rows : {Rows::kOfPath, Rows::kAll}) {
    // On a path the value is the row, or stands for it.
    for (const auto since : {20ms, 25ms}) {
      CHECK(asked(since, rows).rows.size() == (rows == Rows::kAll ? 1 : 0));
    }
    const SegmentValues before = asked(10ms, rows);
    REQUIRE(before.rows.size() == 1);
    CHECK(before.rows[0].stamp == at(20ms));
    CHECK(transform_diff(before.rows[0].X_PC, X, 1e-12) == "");
    CHECK(before.rows[0].correlation.common_errors == std::vector<CommonError>{observed});
    CHECK(transform_diff(before.values[0], given[1], 1e-12) == "");
  }
  CHECK(asked(10ms, Rows::kNone).rows.empty());
  // Between both, a part of the value's error is that of the row, to the last digit.
  const SegmentValues between = asked(15ms, Rows::kOfPath);
  const SegmentValues alone = asked(15ms, Rows::kNone);
  const auto whole = [](const SegmentValues& found) {
    return collapse(belief_of(found.values[0], found.correlations[0]));
  };
  CHECK(covariance_diff(whole(between).covariance.of_specified(),
                        whole(alone).covariance.of_specified(), 1e-12) == "");
  REQUIRE(between.rows.size() == 1);
  CHECK(between.rows[0].X_PC.covariance.of_specified().matrix().isZero(0));
  const auto& shared_now = between.correlations[0].common_errors;
  REQUIRE(shared_now.size() == 2);
  CHECK(shared_now.back().source == between.rows[0].correlation.common_errors.back().source);
  // A later one is observed without it.
  const CommonError then = common_error(random, "observed:2");
  REQUIRE(robot.forest.revise({{"a", X, {false, {then}, {"a", "c"}}}}, at(30ms), UINT64_MAX));
  const SegmentValues left_out = asked(20ms, Rows::kOfPath);
  REQUIRE(left_out.rows.size() == 1);
  CHECK(left_out.rows[0].stamp == at(30ms));
  CHECK(left_out.correlations[0].common_errors.empty());
  REQUIRE(left_out.correlations[0].unknown);
  CHECK(covariance_diff(*left_out.correlations[0].unknown,
                        whole(asked(20ms, Rows::kNone)).covariance.of_specified(), 1e-12) == "");
  CHECK(left_out.correlations[0].observed_with == std::vector<std::string>{"a", "a", "b", "c"});
}

TEST_CASE("What an observation has corrected is left out once its newest sample is another one") {
  Random random(659);
  INFO("seed " << random.seed());
  Robot robot(random);
  for (int i = 0; i < 4; ++i) REQUIRE(robot.forest.update("a", random.transform(), at(10ms * i)));
  // A late sighting corrects the sample that it is of, and the last one.
  const CommonError observed = common_error(random, "observed:1");
  const Correlation tied{false, {observed}, {"a", "b"}};
  REQUIRE(robot.forest.revise(
      {{"a", random.transform(), tied}, {"a", random.transform(), tied, at(30ms)}}, at(10ms),
      UINT64_MAX));
  const auto asked = [&] {
    Query query;
    query.at = at(10ms);
    return robot.forest.lookup_segments({{"world", "a"}}, query, std::nullopt, true, Rows::kOfPath)
        .value();
  };
  CHECK_FALSE(asked().correlations[0].unknown);
  SECTION("its partners are told to forget the edge") {
    REQUIRE(robot.forest.rewrite("a", {at(25ms), at(35ms)}, {{at(30ms), random.transform()}}));
  }
  SECTION("it may come nearer, to those that take part") {
    REQUIRE(robot.forest.rewrite("a", {at(5ms), at(25ms)}, {{at(10ms), random.transform()}}));
    Query query;
    query.at = at(30ms);
    const auto last =
        robot.forest.lookup_segments({{"world", "a"}}, query, std::nullopt, true, Rows::kOfPath)
            .value();
    CHECK(last.correlations[0].unknown);
    return;
  }
  CHECK(asked().correlations[0].unknown);
}

// To tell them may take a walk over all samples of the edge.
TEST_CASE(
    "The rows of an edge are told once a request, and its value as often as it is asked for") {
  Forest forest;
  REQUIRE(forest.add("world", "", {}));
  REQUIRE(forest.add("a", "world", {}));
  const std::vector<PathEnds> twice{{"world", "a"}, {"a", "world"}, {"world", "a"}};
  const auto refused = forest.lookup_segments(twice, {}, std::nullopt, true, Rows::kOfPath);
  REQUIRE_FALSE(refused);
  CHECK(refused.error().code == Errc::kInvalidInput);
  CHECK(refused.error().message == "the edge of frame 'a' is asked for twice");
  CHECK(forest.lookup_segments(twice, {}, std::nullopt, true));
  CHECK(forest.lookup_segments({{"world", "a"}}, {}, std::nullopt, true, Rows::kOfPath));
  // Nor is it told once for each other end that a segment may have.
  REQUIRE(forest.add("b", "a", {}));
  REQUIRE(forest.add("c", "world", {}));
  for (const PathEnds& longer : std::vector<PathEnds>{{"world", "b"}, {"c", "b"}, {"b", "b"}}) {
    INFO("from " << longer.from);
    const auto none = forest.lookup_segments({{"a", "b"}, longer}, {}, std::nullopt, true);
    REQUIRE_FALSE(none);
    CHECK(none.error().code == Errc::kNotOwner);
    CHECK(none.error().message ==
          "there is no edge between '" + longer.from + "' and '" + longer.to + "'");
  }
}

TEST_CASE("A revision of a dynamic edge is a sample, or replaces the one with its stamp") {
  Random random(657);
  INFO("seed " << random.seed());
  Robot robot(random);
  for (int i = 0; i < 20; ++i) {
    REQUIRE(robot.forest.update("a", random.transform(), at(10ms * i)));
  }
  const Transform X = random.transform();
  for (const auto stamp : {at(190ms), at(50ms), at(55ms), at(195ms)}) {
    REQUIRE(robot.forest.revise({{"a", X, {}}}, stamp, UINT64_MAX));
    Query query;
    query.at = stamp;
    const auto found = robot.forest.lookup("world", "a", query);
    REQUIRE(found);
    CHECK(transform_diff(*found, X, 1e-12) == "");
  }
  const auto history = robot.forest.histories("a");
  REQUIRE(history.size() == 1);
  CHECK(history[0].samples == 22);
  const auto undated = robot.forest.revise({{"a", X, {}}}, std::nullopt, 1'000'000);
  REQUIRE_FALSE(undated);
  CHECK(undated.error().code == Errc::kChangedMeanwhile);
  REQUIRE(robot.forest.update("a", X, at(200ms)));
}

TEST_CASE("What is said of an edge later is said of the samples that were observed, too") {
  Random random(662);
  INFO("seed " << random.seed());
  Robot robot(random);
  const Transform X = random.transform();
  for (const auto stamp : {10ms, 20ms, 30ms}) REQUIRE(robot.forest.update("a", X, at(stamp)));
  const CommonError left = common_error(random, std::string(kObservedPrefix) + "arm.1");
  for (const auto stamp : {20ms, 30ms}) {
    REQUIRE(robot.forest.revise({{"a", X, shared(left)}}, at(stamp), UINT64_MAX));
  }
  for (const char* source : {"supply", "load"}) {
    const CommonError said = common_error(random, source);
    REQUIRE(robot.forest.correlate("a", shared(said)));
    for (const auto stamp : {10ms, 20ms, 30ms}) {
      INFO(source << " at " << stamp.count() << " ms");
      std::vector<CommonError> expected{said};
      if (stamp > 10ms) expected.push_back(left);
      Query query;
      query.at = at(stamp);
      const auto found = robot.forest.lookup("world", "a", query);
      REQUIRE(found);
      CHECK(covariance_diff(found->covariance, collapse(with(X, expected)).covariance, 1e-12) ==
            "");
    }
  }
  // Partners of the last observation are still tied to its sample alone.
  const auto rows = robot.forest.lookup_segments({{"world", "a"}}, Query{}, {}, true, Rows::kAll);
  REQUIRE(rows);
  REQUIRE(rows->rows.size() == 1);
  CHECK(rows->rows[0].stamp == at(30ms));
}

TEST_CASE("An invalid correlation or revision is rejected and changes nothing") {
  Random random(658);
  Robot robot(random);
  CommonError bad = common_error(random, "s");
  bad.loading(0, 0) = std::nan("");
  const auto refused = robot.forest.correlate("a", shared(bad));
  REQUIRE_FALSE(refused);
  CHECK_THAT(refused.error().message, ContainsSubstring("'a'") && ContainsSubstring("'s'"));
  CHECK_FALSE(robot.forest.correlate("nobody", {true, {}, {}}));
  const Transform X = random.transform();
  CHECK_FALSE(robot.forest.revise({{"a", X, {}}, {"nobody", X, {}}}, std::nullopt, 1'000'000));
  const auto X_WA = robot.forest.value("a");
  REQUIRE(X_WA);
  CHECK(transform_diff(*X_WA, robot.X_WA, 0) == "");
}

TEST_CASE("Sources that do not fit beside what an observation has left are rejected") {
  Random random(660);
  Robot robot(random);
  const CommonError left = common_error(random, std::string(kObservedPrefix) + "arm.1");
  REQUIRE(robot.forest.revise({{"a", random.transform(), shared(left)}}, std::nullopt, 1'000'000));
  Correlation said;
  for (std::size_t i = 0; i < kMaxCommonErrors; ++i) {
    said.common_errors.push_back(common_error(random, "s" + std::to_string(i)));
  }
  const auto refused = robot.forest.correlate("a", said);
  REQUIRE_FALSE(refused);
  CHECK(refused.error().code == Errc::kInvalidInput);
  CHECK_THAT(refused.error().message,
             ContainsSubstring("'a'") && ContainsSubstring("128 sources and 1 "));
  said.common_errors.pop_back();
  REQUIRE(robot.forest.correlate("a", said));
  const auto kept = robot.forest.kept("a");
  REQUIRE(kept);
  REQUIRE(kept->correlation.observed);
  CHECK(kept->correlation.observed->common_errors.size() == kMaxCommonErrors);
}

TEST_CASE("Pushed values of an edge have its correlation") {
  Random random(659);
  Robot robot(random);
  std::vector<EdgeCursor> cursors{{"a", robot.forest.info("a")->parent}};
  CHECK(robot.forest.values_since(cursors, {true}).values.at(0).correlation.empty());
  REQUIRE(robot.forest.correlate("a", {true, {}, {}}));
  const auto values = robot.forest.values_since(cursors, {true}).values;
  REQUIRE(values.size() == 1);
  CHECK(values[0].correlation.unknown);
}

}  // namespace
}  // namespace tfdude
