// Each kind of value crosses each transport unchanged. What is computed from them does not depend
// on the transport, and is checked over loopback only, in the tests of uncertainty, unspecified
// covariances, points and velocities.

#include <algorithm>
#include <optional>
#include <string>
#include <vector>

#include "tfdude/client/client.hpp"
#include "tfdude/client/node.hpp"

#include "support/catch.hpp"
#include "support/networks.hpp"
#include "support/pose_diff.hpp"
#include "support/random.hpp"

namespace tfdude {
namespace {

using testing::Join;
using testing::Random;

Time ms(std::int64_t milliseconds) { return Time(Milliseconds(milliseconds)); }

// world ─ base ─ cart of one owner, arm ─ hand of another one, and below it far and lid. The cart
// moves. An observation correlates the edges of the second owner, a source is common to base and
// cart, the errors of base and far are of unknown correlation, and the lid has no covariance.
struct Robot {
  Robot(const Join& join, Random& random) {
    const Loading loading =
        Loading::NullaryExpr(6, 2, [&](auto, auto) { return 0.01 * random.normal(); });
    const CommonError common{"calibration", false, loading};
    const Transform X_hand_lid{random.pose(), StatedCovariance::unspecified()};
    const auto edge = [&] { return random.transform(1.0, 0.01, 0.01); };
    base.emplace(
        Node::open(join("base"), "base",
                   {{"world", "", {}}, {"base", "world", edge()}, {"cart", "base", edge()}})
            .value());
    arm.emplace(
        Node::open(join("arm"), "arm",
                   {{"arm", "cart", edge()}, {"hand", "arm", edge()}, {"lid", "hand", X_hand_lid}})
            .value());
    client.emplace(Client::open(join("")).value());
    for (const int at : {0, 100, 200}) REQUIRE(client->update({{"cart", edge()}}, ms(at)));
    // The arm and the hand are correlated with each other by this, and each with the source.
    const Transform X_cart_hand = client->lookup("cart", "hand").value().transform();
    REQUIRE(client->observe("cart", "hand", {X_cart_hand.pose, random.covariance(0.001, 0.001)}));
    REQUIRE(client->correlate("base", {false, {common}, {}}));
    REQUIRE(client->correlate("cart", {false, {common}, {}}));
    REQUIRE(client->add("far", "hand", edge(), "arm"));
    REQUIRE(client->correlate("far", {true, {}, {}}));
    REQUIRE(client->correlate("base", {true, {common}, {}}));
  }

  std::optional<Node> base;
  std::optional<Node> arm;
  std::optional<Client> client;
};

// What a client of the robot is told.
std::vector<StampedTransform> answers(Robot& robot) {
  std::vector<StampedTransform> all;
  for (const char* end : {"base", "cart", "arm", "hand", "far", "lid"}) {
    for (const auto order : {Order::kSecond, Order::kFourth}) {
      for (const std::optional<Time>& at : {std::optional<Time>(), std::optional(ms(130))}) {
        Query query;
        query.at = at;
        query.order = order;
        CAPTURE(end);
        const auto X = robot.client->lookup("world", end, query);
        REQUIRE(X);
        all.push_back(*X);
      }
    }
  }
  return all;
}

// The source of an observation has the time and the process in its name.
std::vector<std::string> kinds_of(std::vector<std::string> sources) {
  for (std::string& source : sources) source.resize(std::min(source.find(':'), source.size()));
  return sources;
}

}  // namespace

TEST_CASE("values: all kinds of values and answers are equal over each transport") {
  constexpr std::uint64_t kSeed = 977;
  INFO("seed " << kSeed);
  Random first(kSeed);
  Robot here(testing::join_loopback(), first);
  const auto expected = answers(here);
  Random second(kSeed);
  Robot there(testing::joined_by(testing::networks().back()), second);
  const auto actual = answers(there);
  REQUIRE(actual.size() == expected.size());
  std::size_t bounds = 0;
  std::size_t sources = 0;
  std::size_t unspecified = 0;
  for (std::size_t i = 0; i < actual.size(); ++i) {
    CHECK(testing::transform_diff(actual[i], expected[i], 1e-12) == "");
    CHECK(actual[i].stamp == expected[i].stamp);
    CHECK(actual[i].basis.bound == expected[i].basis.bound);
    CHECK(kinds_of(actual[i].basis.sources) == kinds_of(expected[i].basis.sources));
    CHECK(actual[i].basis.unspecified == expected[i].basis.unspecified);
    if (actual[i].basis.bound) ++bounds;
    sources += actual[i].basis.sources.size();
    unspecified += actual[i].basis.unspecified.size();
  }
  // Otherwise the test has shown nothing.
  CHECK(bounds > 0);
  CHECK(sources > 0);
  CHECK(unspecified > 0);
  const auto velocity_here = here.client->velocity("world", "hand", {ms(100)});
  const auto velocity_there = there.client->velocity("world", "hand", {ms(100)});
  REQUIRE(velocity_here);
  REQUIRE(velocity_there);
  CHECK((velocity_here->linear - velocity_there->linear).norm() < 1e-12);
  CHECK((velocity_here->angular - velocity_there->angular).norm() < 1e-12);
}

}  // namespace tfdude
