// Edges whose covariance is unspecified, in lookups of a forest.

#include <chrono>
#include <string>
#include <vector>

#include "support/catch.hpp"
#include "support/forest_support.hpp"
#include "support/pose_diff.hpp"
#include "support/random.hpp"
#include "tree/forest.hpp"

namespace tfdude {
namespace {

using namespace std::chrono_literals;
using testing::covariance_diff;
using testing::Random;
using testing::transform_diff;
using Names = std::vector<std::string>;

Time at(std::chrono::milliseconds since) { return Time(1'000'000s + since); }

Query query_at(std::chrono::milliseconds since, std::chrono::nanoseconds extrapolate = 0ns) {
  Query query;
  query.at = at(since);
  query.extrapolate = extrapolate;
  return query;
}

Transform unspecified(const Pose& X) { return {X, StatedCovariance::unspecified()}; }

// world ─ a ─ b ─ c, and world ─ d ─ e, with the same poses in a forest without covariance of the
// unspecified ones.
class Pair {
 public:
  explicit Pair(Random& random) {
    add("world", "", Transform{Pose(), Covariance()});
    add("a", "world", random.transform());
    add("b", "a", unspecified(random.pose()));
    add("c", "b", random.transform());
    add("d", "world", random.transform());
    add("e", "d", unspecified(random.pose()));
  }
  void add(const std::string& id, const std::string& parent, const Transform& X) {
    REQUIRE(forest.add(id, parent, X));
    REQUIRE(as_if.add(id, parent, {X.pose, X.covariance.of_specified()}));
  }
  void update(const std::string& id, const Transform& X, std::optional<Time> stamp = std::nullopt) {
    REQUIRE(forest.update(id, X, stamp));
    REQUIRE(as_if.update(id, {X.pose, X.covariance.of_specified()}, stamp));
  }
  // Checks a path of which these edges are unspecified.
  void check(const std::string& from, const std::string& to, const Query& query,
             const Names& names) const {
    INFO(from << " to " << to);
    const auto found = forest.lookup(from, to, query);
    REQUIRE(found);
    const auto expected = as_if.lookup(from, to, query);
    REQUIRE(expected);
    CHECK(found->basis.unspecified == names);
    CHECK(found->covariance.complete() == names.empty());
    Transform same = expected->transform();
    same.covariance.set_complete(names.empty());
    CHECK(transform_diff(*found, same, 1e-12) == "");
  }
  void check(const std::string& from, const std::string& to, const Names& names) const {
    check(from, to, {}, names);
    const auto plain = forest.lookup(from, to);
    REQUIRE(plain);
    CHECK(plain->covariance.complete() == names.empty());
    const auto by_handle = forest.lookup(*forest.find(from), *forest.find(to));
    REQUIRE(by_handle);
    CHECK(by_handle->covariance == plain->covariance);
    CHECK(forest.lookup_pose(from, to));
  }

  Forest forest{[] { return at(0ms); }};
  Forest as_if{[] { return at(0ms); }};
};

}  // namespace

TEST_CASE("a lookup names the unspecified edges and has the covariance of the others") {
  Random random(821);
  INFO("seed " << random.seed());
  const Pair pair(random);
  pair.check("world", "a", {});
  pair.check("world", "b", {"b"});
  pair.check("b", "world", {"b"});
  pair.check("b", "c", {});
  pair.check("a", "b", {"b"});
  pair.check("c", "e", {"b", "e"});
  pair.check("e", "c", {"e", "b"});
  pair.check("a", "d", {});
  pair.check("b", "b", {});
  Query fourth;
  fourth.order = Order::kFourth;
  pair.check("c", "e", fourth, {"b", "e"});
}

TEST_CASE("a path of more edges than one batch says that one of them is unspecified") {
  for (const int which : {1, 16, 17, 40}) {
    Forest forest;
    for (int i = 0; i <= 40; ++i) {
      Transform X = testing::along_x(1);
      if (i == which) X.covariance = StatedCovariance::unspecified();
      REQUIRE(forest.add(std::to_string(i), i == 0 ? "" : std::to_string(i - 1), X));
    }
    const auto X = forest.lookup("0", "40");
    REQUIRE(X);
    CHECK_FALSE(X->covariance.complete());
    CHECK(forest.lookup("40", "0", Query{})->basis.unspecified == Names{std::to_string(which)});
  }
}

TEST_CASE("an update makes an edge unspecified and specified") {
  Random random(822);
  Pair pair(random);
  pair.update("a", unspecified(random.pose()));
  pair.check("world", "b", {"a", "b"});
  pair.update("b", random.transform());
  pair.check("world", "b", {"a"});
  REQUIRE(pair.forest.update_partial({{"a", {{}, {}, random.covariance()}}}));
  CHECK(pair.forest.lookup("world", "b")->covariance.complete());
  // A part that is not given stays what it is.
  REQUIRE(pair.forest.update_partial({{"e", {Eigen::Vector3d(1, 2, 3)}}}));
  CHECK_FALSE(pair.forest.lookup("d", "e")->covariance.complete());
  REQUIRE(pair.forest.update_partial({{"e", {{}, {}, StatedCovariance::exact()}}}));
  CHECK(pair.forest.lookup("d", "e")->covariance == StatedCovariance::exact());
  REQUIRE(pair.forest.move("e", "a", {{}, {}, StatedCovariance::unspecified()}));
  CHECK(pair.forest.lookup("a", "e", Query{})->basis.unspecified == Names{"e"});
}

TEST_CASE("a sample is unspecified at its instant and between its neighbours") {
  Random random(823);
  INFO("seed " << random.seed());
  Pair pair(random);
  const Transform first = random.transform();
  const auto near = [&] { return first.pose * exp(random.twist(0.02, 0.02)); };
  const Covariance known = random.covariance();
  pair.update("a", {near(), known}, at(100ms));
  pair.update("a", {near(), known}, at(200ms));
  pair.update("a", unspecified(near()), at(300ms));
  pair.update("a", {near(), known}, at(400ms));
  pair.update("a", {near(), known}, at(500ms));
  const auto names = [&](const Query& query) {
    const auto X = pair.forest.lookup("world", "c", query);
    REQUIRE(X);
    CHECK_FALSE(X->covariance.complete());
    return X->basis.unspecified;
  };
  CHECK(names({}) == Names{"b"});
  CHECK(names(query_at(100ms)) == Names{"b"});
  CHECK(names(query_at(150ms)) == Names{"b"});
  CHECK(names(query_at(200ms)) == Names{"b"});
  CHECK(names(query_at(250ms)) == Names{"a", "b"});
  CHECK(names(query_at(300ms)) == Names{"a", "b"});
  CHECK(names(query_at(350ms)) == Names{"a", "b"});
  CHECK(names(query_at(400ms)) == Names{"b"});
  CHECK(names(query_at(550ms, 1s)) == Names{"b"});
  // Nothing of the specified neighbour is left.
  CHECK(pair.forest.lookup("world", "a", query_at(250ms))->covariance ==
        StatedCovariance::unspecified());
  pair.update("a", unspecified(near()), at(600ms));
  CHECK(names({}) == Names{"a", "b"});
  CHECK(names(query_at(650ms, 1s)) == Names{"a", "b"});
  pair.update("a", {near(), known}, at(700ms));
  CHECK(names(query_at(750ms, 1s)) == Names{"a", "b"});
  // A late sample counts as well.
  pair.update("a", unspecified(near()), at(450ms));
  CHECK(names(query_at(475ms)) == Names{"a", "b"});
}

TEST_CASE("process noise is not added to an unspecified sample") {
  Random random(824);
  Forest forest([] { return at(0ms); });
  REQUIRE(forest.add("world", "", Transform::exact({})));
  REQUIRE(forest.add("a", "world", Transform::exact({})));
  EdgeTiming noisy;
  noisy.process_noise = random.covariance();
  REQUIRE(forest.set_timing("a", noisy));
  REQUIRE(forest.update("a", unspecified(random.pose()), at(0ms)));
  REQUIRE(forest.update("a", unspecified(random.pose()), at(100ms)));
  for (const Query& query : {query_at(50ms), query_at(150ms, 1s)}) {
    const auto X = forest.lookup("world", "a", query);
    REQUIRE(X);
    CHECK(X->covariance == StatedCovariance::unspecified());
    CHECK(X->basis.unspecified == Names{"a"});
  }
}

TEST_CASE("a correlated path names its unspecified edges") {
  Random random(825);
  Pair pair(random);
  const CommonError shared{"s", false, Loading::Constant(6, 1, 0.1)};
  for (Forest* forest : {&pair.forest, &pair.as_if}) {
    REQUIRE(forest->correlate("a", {false, {shared}, {}}));
    REQUIRE(forest->correlate("c", {false, {shared}, {}}));
  }
  pair.check("world", "c", {"b"});
  pair.check("a", "world", {});
  CHECK(pair.forest.lookup("world", "c", Query{})->basis.sources == Names{"s"});
}

TEST_CASE("segments of others name their unspecified edges") {
  Random random(826);
  Pair pair(random);
  const auto found = pair.forest.lookup_segments({{"a", "c"}, {"world", "d"}, {"d", "e"}});
  REQUIRE(found);
  REQUIRE(found->unspecified.size() == 2);
  CHECK(found->unspecified[0].segment == 0);
  CHECK(found->unspecified[0].id == "b");
  CHECK(found->unspecified[1].segment == 2);
  CHECK(found->unspecified[1].id == "e");
  CHECK_FALSE(found->values[0].covariance.complete());
  CHECK(found->values[1].covariance.complete());
  pair.update("d", random.transform(), at(100ms));
  pair.update("d", unspecified(random.pose()), at(200ms));
  const auto hinted = pair.forest.lookup_segments({{"world", "d"}}, {}, at(100ms));
  REQUIRE(hinted);
  CHECK(hinted->unspecified.size() == 1);
  REQUIRE(hinted->at_hint.values.size() == 1);
  CHECK(hinted->at_hint.values[0].covariance.complete());
  CHECK(hinted->at_hint.unspecified.empty());
}

TEST_CASE("values that are pushed to another forest stay unspecified there") {
  Random random(827);
  Forest owner([] { return at(0ms); });
  Forest watcher([] { return at(0ms); });
  for (Forest* forest : {&owner, &watcher}) {
    REQUIRE(forest->add("world", "", Transform::exact({})));
    REQUIRE(forest->add("a", "world", random.transform()));
  }
  const std::vector<Handle> edges{*watcher.find("a")};
  std::vector<EdgeCursor> cursors{{"a", "world"}};
  const auto push = [&] { watcher.take(edges, owner.values_since(cursors, {}).values); };
  push();
  const Pose same = owner.value("a")->pose;
  REQUIRE(owner.update("a", unspecified(same)));
  push();
  CHECK_FALSE(watcher.lookup("world", "a")->covariance.complete());
  REQUIRE(owner.update("a", {same, Covariance()}));
  push();
  CHECK(watcher.lookup("world", "a")->covariance == StatedCovariance::exact());
  REQUIRE(owner.update("a", unspecified(same), at(100ms)));
  push();
  CHECK(watcher.lookup("world", "a", Query{})->basis.unspecified == Names{"a"});
}

}  // namespace tfdude
