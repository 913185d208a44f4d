// Frames that go from one owner to another, over each transport.

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
using testing::outcome;

TEST_CASE("release: another owner takes a frame, and what is below it stays") {
  const Join join = joined_by(GENERATE(from_range(testing::networks())));
  Node base = Node::open(join("base"), "base",
                         {{"world", "", {}},
                          {"arm", "world", along_x(1)},
                          {"hand", "arm", along_x(2)},
                          {"rail", "world", {}}})
                  .value();
  const Node tool = Node::open(join("tool"), "tool", {{"tool", "arm", along_x(4)}}).value();
  Client client = Client::open(join("")).value();
  CHECK(outcome(base.release({"rail", "nobody"})) == "unknown_frame");
  CHECK(outcome(base.release({"rail", "tool"})) == "not_owner");
  CHECK(client.exists("rail"));
  REQUIRE(base.release({"arm", "rail"}));
  CHECK(eventually([&] { return !client.exists("rail") && !client.exists("arm"); }));
  CHECK(outcome(client.lookup("world", "hand")) == "not_connected");
  const Node arm = Node::open(join("arm"), "arm", {{"arm", "world", along_x(8)}}).value();
  CHECK(eventually([&] { return client.lookup("world", "hand").has_value(); }));
  CHECK(client.lookup("world", "hand").value().pose.translation().x() == 10);
  CHECK(client.lookup("world", "tool").value().pose.translation().x() == 12);
}

}  // namespace
}  // namespace tfdude
