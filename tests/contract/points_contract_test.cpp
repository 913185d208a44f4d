// Points and poses of one frame in another over partitions.

#include "tfdude/client/client.hpp"
#include "tfdude/client/node.hpp"

#include "support/catch.hpp"
#include "support/networks.hpp"
#include "support/pose_diff.hpp"
#include "support/random.hpp"

namespace tfdude {
namespace {

using testing::ContainsSubstring;
using testing::Random;
using testing::transform_diff;

TEST_CASE("points: a client transforms as the transform that it looks up") {
  const auto join = testing::join_loopback();
  Random random(821);
  INFO("seed " << random.seed());
  auto base =
      Node::open(join("base"), "base", {{"world", "", {}}, {"arm", "world", random.transform()}});
  auto hand = Node::open(join("hand"), "hand", {{"hand", "arm", random.transform()}});
  auto client = Client::open(join(""));
  REQUIRE(base);
  REQUIRE(hand);
  REQUIRE(client);
  const auto X_WH = client->lookup("world", "hand", Query{});
  REQUIRE(X_WH);
  const std::vector<Point> points = {{random.vector(1)},
                                     {random.vector(1), Eigen::Matrix3d::Zero(), true}};
  const auto seen = client->transform("world", "hand", points);
  REQUIRE(seen);
  REQUIRE(seen->points.size() == 2);
  CHECK(transform_diff(seen->X_AB, *X_WH, 1e-15) == "");
  for (std::size_t i = 0; i < points.size(); ++i) {
    const TransformedPoint expected = transform(*X_WH, points[i]);
    CHECK((seen->points[i].coordinates - expected.coordinates).norm() < 1e-14);
    REQUIRE(seen->points[i].covariance() != nullptr);
    CHECK((*seen->points[i].covariance() - *expected.covariance()).norm() < 1e-14);
  }
  const Transform X_HO = random.transform();
  const auto X_WO = client->transform("world", "hand", X_HO);
  REQUIRE(X_WO);
  CHECK(transform_diff(*X_WO, compose(*X_WH, X_HO), 1e-12) == "");
  Query fourth;
  fourth.order = Order::kFourth;
  const auto X_WO4 = client->transform("world", "hand", X_HO, fourth);
  REQUIRE(X_WO4);
  CHECK(transform_diff(*X_WO4, *X_WO, 1e-12) != "");

  Point wrong;
  wrong.covariance(0, 0) = -1;
  const auto refused = client->transform("world", "hand", {points[0], wrong});
  REQUIRE_FALSE(refused);
  CHECK(refused.error().code == Errc::kInvalidInput);
  CHECK_THAT(refused.error().message, ContainsSubstring("point 1 of frame 'hand'"));
  CHECK(client->transform("world", "nowhere", points).error().code == Errc::kUnknownEnd);
}

TEST_CASE("points: through an unspecified edge no covariance is claimed") {
  const auto join = testing::join_loopback();
  auto base = Node::open(join("base"), "base", {{"world", "", {}}, {"arm", "world", {}}});
  auto client = Client::open(join(""));
  REQUIRE(base);
  REQUIRE(client);
  const auto seen = client->transform("world", "arm", {Point{}});
  REQUIRE(seen);
  CHECK(seen->points[0].covariance() == nullptr);
  CHECK(seen->X_AB.basis.unspecified == std::vector<std::string>{"arm"});
  CHECK_FALSE(client->transform("world", "arm", Transform::exact({}))->covariance.complete());
}

}  // namespace
}  // namespace tfdude
