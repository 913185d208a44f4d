#include <string>
#include <vector>

#include "support/catch.hpp"
#include "support/forest_support.hpp"
#include "support/pose_diff.hpp"
#include "support/random.hpp"
#include "tree/forest.hpp"

namespace tfdude {
namespace {

using testing::ContainsSubstring;
using testing::outcome;
using testing::Random;
using testing::transform_diff;

struct Arm {
  explicit Arm(Random& random) : before(random.transform()), given(random.transform()) {
    REQUIRE(forest.add("world", "", {}));
    REQUIRE(forest.add("arm", "world", before));
  }
  Transform arm() const { return forest.lookup("world", "arm")->transform(); }

  Transform before;
  Transform given;
  Forest forest;
};

}  // namespace

TEST_CASE("a partial update keeps the parts that are not given") {
  Random random(0x9a71);
  INFO("seed " << random.seed());
  for (int parts = 0; parts < 8; ++parts) {
    INFO("parts " << parts);
    Arm arm(random);
    PartialUpdate update{"arm"};
    if ((parts & 1) != 0) update.X_PC.translation = arm.given.pose.translation();
    if ((parts & 2) != 0) update.X_PC.rotation = arm.given.pose.rotation();
    if ((parts & 4) != 0) update.X_PC.covariance = arm.given.covariance;
    REQUIRE(arm.forest.update_partial({update}));
    const Transform& p = (parts & 1) != 0 ? arm.given : arm.before;
    const Transform& q = (parts & 2) != 0 ? arm.given : arm.before;
    const Transform& c = (parts & 4) != 0 ? arm.given : arm.before;
    const Transform expected{*Pose::create(q.pose.rotation(), p.pose.translation()), c.covariance};
    CHECK(transform_diff(arm.arm(), expected, 1e-12) == "");
  }
}

TEST_CASE("a partial update of a dynamic edge keeps the other parts of its newest sample") {
  Random random(0x9a72);
  Arm arm(random);
  REQUIRE(arm.forest.update("arm", arm.given, time_of(1000)));
  const Eigen::Vector3d there(1, 2, 3);
  REQUIRE(arm.forest.update_partial({{"arm", {there}}}, time_of(2000)));
  const Transform newest{*Pose::create(arm.given.pose.rotation(), there), arm.given.covariance};
  CHECK(transform_diff(arm.arm(), newest, 1e-12) == "");
  CHECK(arm.forest.histories("arm").front().samples == 2);
  CHECK(outcome(arm.forest.update_partial({{"arm", {there}}}, time_of(2000))) == "stamp_taken");
}

TEST_CASE("partial updates are applied in order in one commit or not at all") {
  Random random(0x9a73);
  Arm arm(random);
  REQUIRE(arm.forest.add("hand", "arm", {}));
  int commits = 0;
  arm.forest.on_commit([&commits] { ++commits; });
  const Eigen::Vector3d there(1, 2, 3);
  // The second of the same edge builds on the first.
  REQUIRE(arm.forest.update_partial(
      {{"arm", {there}}, {"hand", {there}}, {"arm", {std::nullopt, arm.given.pose.rotation()}}}));
  CHECK(commits == 1);
  const Transform both{*Pose::create(arm.given.pose.rotation(), there), arm.before.covariance};
  CHECK(transform_diff(arm.arm(), both, 1e-12) == "");
  const auto refused = [&](const std::vector<PartialUpdate>& edges, const std::string& what) {
    const auto updated = arm.forest.update_partial(edges);
    REQUIRE_FALSE(updated);
    CHECK_THAT(updated.error().message, ContainsSubstring(what));
  };
  const Eigen::Vector3d away(1, 2, std::nan(""));
  refused({{"hand", {Eigen::Vector3d(9, 9, 9)}}, {"arm", {away}}}, "'arm': translation.z");
  refused({{"hand", {Eigen::Vector3d(9, 9, 9)}}, {"arm", {{}, Eigen::Quaterniond(0, 0, 0, 0)}}},
          "'arm': rotation");
  refused({{"hand", {Eigen::Vector3d(9, 9, 9)}}, {"nobody"}}, "'nobody'");
  CHECK(commits == 1);
  CHECK(arm.forest.lookup("arm", "hand")->pose.translation() == there);
  CHECK(check_parts({"arm", {there}}).has_value());
  CHECK_FALSE(check_parts({"arm", {away}}).has_value());
}

TEST_CASE("a partial update of an observed edge keeps its whole covariance") {
  Random random(0x9a74);
  Arm arm(random);
  Correlation observed;
  observed.common_errors.push_back({"observed:1.2.3", false, 0.1 * Loading::Ones(6, 1)});
  REQUIRE(arm.forest.revise({{"arm", arm.given, observed}}, std::nullopt, UINT64_MAX));
  const Transform whole = *arm.forest.value("arm");
  REQUIRE(arm.forest.update_partial({{"arm", {Eigen::Vector3d(1, 2, 3)}}}));
  CHECK(testing::covariance_diff(arm.arm().covariance, whole.covariance, 1e-12) == "");
}

}  // namespace tfdude
