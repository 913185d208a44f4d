#include <optional>
#include <vector>

#include "runtime/watch_mirror.hpp"
#include "support/catch.hpp"
#include "support/forest_support.hpp"
#include "support/pose_diff.hpp"

namespace tfdude {
namespace {

using testing::along_x;

constexpr std::uint64_t kGroup = 11;

Time ms(std::int64_t milliseconds) { return Time(Milliseconds(milliseconds)); }

Query at(std::int64_t milliseconds) {
  Query query;
  query.at = ms(milliseconds);
  return query;
}

}  // namespace

// The error of the shoulder moves a hand that is far away by more than one that is near.
TEST_CASE("composed watch: a sample has the common errors of its instant") {
  const bool asked = GENERATE(false, true);
  INFO("as an answer " << asked);
  Forest owner;
  REQUIRE(owner.add("base", "", {}));
  REQUIRE(owner.add("shoulder", "base", along_x(0)));
  REQUIRE(owner.add("hand", "shoulder", along_x(1)));
  CommonError of_shoulder{"supply", false, Loading::Zero(6, 1)};
  of_shoulder.loading(5, 0) = 0.004;
  CommonError of_hand{"camera", false, Loading::Zero(6, 1)};
  of_hand.loading(0, 0) = 0.001;
  REQUIRE(owner.correlate("shoulder", {false, {of_shoulder}, {}}));
  REQUIRE(owner.correlate("hand", {false, {of_hand}, {}}));
  WatchRoute one;
  one.edges = {{"hand", "base"}};
  one.sources = {{"arms", 1, kGroup, {"hand"}}};
  WatchMirror mirror("base", "hand", one, {});
  WatchedGroup group(kGroup, {{{"base", "hand"}}, true});
  REQUIRE(owner.update("hand", along_x(1), ms(10)));
  if (!asked) mirror.take(group.snapshot(owner, {}).value());
  REQUIRE(owner.update("hand", along_x(0.55), ms(20)));
  if (!asked) mirror.take(group.next_push(owner));
  REQUIRE(owner.update("hand", along_x(0.1), ms(30)));
  mirror.take(asked ? group.snapshot(owner, ms(0)).value() : group.next_push(owner));
  const auto check_as_looked_up = [&](const std::vector<int>& instants) {
    for (const int t : instants) {
      INFO("at " << t << " ms");
      const auto expected = owner.lookup("base", "hand", at(t));
      REQUIRE(expected);
      const auto watched = mirror.lookup(at(t));
      REQUIRE(watched);
      CHECK(testing::transform_diff(*watched, *expected, 1e-9) == "");
    }
  };
  check_as_looked_up({10, 20, 30});
  // Between samples it is a bound, and beyond them errors grow as those of an edge.
  for (const int t : {14, 25, 35}) {
    INFO("at " << t << " ms");
    Query query = at(t);
    query.extrapolate = Milliseconds(10);
    const auto expected = owner.lookup("base", "hand", query);
    REQUIRE(expected);
    const auto watched = mirror.lookup(query);
    REQUIRE(watched);
    const Matrix6d exact = expected->covariance.of_specified().matrix();
    const Matrix6d more = watched->covariance.of_specified().matrix() - exact;
    CHECK(more.diagonal().minCoeff() >= -1e-9 * exact.norm());
    if (t < 30) CHECK(more.norm() < 0.02 * exact.norm());
  }
  // What is said of an edge holds for its past, too.
  mirror.take(group.next_push(owner));
  of_hand.loading *= 3;
  REQUIRE(owner.correlate("hand", {false, {of_hand}, {}}));
  mirror.take(group.next_push(owner));
  check_as_looked_up({10, 20, 30});
  REQUIRE(owner.correlate("shoulder", {true, {}, {}}));
  REQUIRE(owner.update("hand", along_x(2), ms(40)));
  mirror.take(group.next_push(owner));
  check_as_looked_up({10, 20, 30, 40});
  REQUIRE(owner.correlate("shoulder", {}));
  REQUIRE(owner.correlate("hand", {}));
  REQUIRE(owner.update("hand", along_x(3), ms(50)));
  mirror.take(group.next_push(owner));
  check_as_looked_up({10, 20, 30, 40, 45, 50});
}

}  // namespace tfdude
