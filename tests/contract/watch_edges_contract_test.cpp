// Edges that are watched together, over each transport.

#include <chrono>
#include <limits>
#include <optional>
#include <string>

#include "tfdude/client/client.hpp"
#include "tfdude/client/node.hpp"

#include "support/catch.hpp"
#include "support/forest_support.hpp"
#include "support/networks.hpp"
#include "support/process.hpp"

namespace tfdude {
namespace {

using testing::along_x;
using testing::eventually;
using testing::Join;
using testing::joined_by;
using testing::networks;
using testing::outcome;

Time ms(std::int64_t milliseconds) { return Time(Milliseconds(milliseconds)); }

double x_of(const Result<StampedTransform>& X) {
  return X ? X->pose.translation().x() : std::numeric_limits<double>::quiet_NaN();
}

// A fan of fingers, of one partition, on a base of another.
struct Hand {
  explicit Hand(Join joined) : join(std::move(joined)) {
    base.emplace(
        Node::open(join("base"), "base", {{"world", "", {}}, {"base", "world", {}}}).value());
    hand.emplace(Node::open(join("hand"), "hand",
                            {{"hand", "base", along_x(1)},
                             {"left", "hand", along_x(2)},
                             {"right", "hand", along_x(3)}})
                     .value());
    client.emplace(Client::open(join("")).value());
  }
  Join join;
  std::optional<Node> base;
  std::optional<Node> hand;
  std::optional<Client> client;
};

}  // namespace

TEST_CASE("watched edges: edges beside each other are pushed, and composed here") {
  Hand robot(joined_by(GENERATE(from_range(networks()))));
  const auto edges = robot.client->watch_edges({"left", "right", "hand"});
  REQUIRE(edges);
  CHECK(x_of(edges->lookup("hand", "left")) == 2);
  CHECK(x_of(edges->lookup("left", "right")) == 1);
  CHECK(x_of(edges->lookup("base", "right")) == 4);
  CHECK(!edges->lookup("base", "right").value().stamp);
  CHECK(outcome(edges->lookup("base", "world")) == "unknown_end");
  CHECK(edges->health());

  const auto before = edges->messages();
  REQUIRE(robot.hand->update({{"left", along_x(5)}, {"right", along_x(6)}}, ms(1000)));
  CHECK(edges->wait_for_more(before, testing::in_time()));
  REQUIRE(eventually([&] { return x_of(edges->lookup("hand", "left")) == 5; }));
  CHECK(x_of(edges->lookup("hand", "right")) == 6);
  CHECK(edges->lookup("hand", "right").value().stamp == ms(1000));
}

TEST_CASE("watched edges: a moved edge is followed, and a removed one is named") {
  Hand robot(joined_by(GENERATE(from_range(networks()))));
  const auto edges = robot.client->watch_edges({"left", "right"});
  REQUIRE(edges);
  REQUIRE(robot.client->move("left", "base", along_x(9)));
  CHECK(eventually([&] { return x_of(edges->lookup("base", "left")) == 9; }));
  REQUIRE(robot.client->remove("right"));
  CHECK(eventually([&] { return outcome(edges->lookup("base", "left")) == "unknown_frame"; }));
}

TEST_CASE("watched edges: what is no edge cannot be watched") {
  Hand robot(joined_by(GENERATE(from_range(networks()))));
  CHECK(outcome(robot.client->watch_edges({})) == "invalid_input");
  CHECK(outcome(robot.client->watch_edges({"left", "world"})) == "invalid_input");
  CHECK(outcome(robot.client->watch_edges({"left", "nobody"})) == "unknown_frame");
  WatchOptions options;
  options.composed = true;
  CHECK(outcome(robot.client->watch_edges({"left"}, options)) == "invalid_input");
}

}  // namespace tfdude
