// Queries about frames and partitions, except for their values.

#include "runtime/queries.hpp"

#include <string>
#include <vector>

#include "support/catch.hpp"
#include "support/forest_support.hpp"
#include "support/rig.hpp"

namespace tfdude {
namespace {

using namespace std::chrono_literals;
using testing::along_x;
using testing::outcome;
using testing::Rig;
using testing::ScriptedOwner;

struct Asker : Rig {
  explicit Asker(LoopbackNetwork& network) : Rig(network.join()), queries(context) {}
  Queries queries;
};

}  // namespace

TEST_CASE("queries: frames have their parents and children and owners") {
  LoopbackNetwork network;
  const ScriptedOwner base(network, "base", {{"world", "", {}}, {"mount", "world", {}}});
  const ScriptedOwner arm(network, "arm", {{"hand", "mount", {}}});
  Asker asker(network);
  const auto frames = asker.queries.frames();
  REQUIRE(frames);
  REQUIRE(frames->size() == 3);
  CHECK(frames->at(0).id == "hand");
  CHECK(frames->at(0).partition == "arm");
  CHECK(frames->at(0).parent == "mount");
  CHECK(asker.queries.roots() == std::vector<std::string>{"world"});
  CHECK(asker.queries.children("mount") == std::vector<std::string>{"hand"});
  CHECK(asker.queries.info("hand")->parent == "mount");
  CHECK(asker.queries.find("hand"));
  const auto path = asker.queries.path("world", "hand");
  REQUIRE(path);
  REQUIRE(path->size() == 2);
  CHECK(path->at(0).partition == "base");
  CHECK(path->at(1).partition == "arm");
  CHECK(asker.queries.own_frames() == 0);
}

TEST_CASE("queries: a frame is called unknown only after all owners are known") {
  LoopbackNetwork network;
  const ScriptedOwner base(network, "base", {{"world", "", {}}});
  Asker asker(network);
  CHECK(outcome(asker.queries.info("hand")) == "unknown_frame");
  CHECK(outcome(asker.queries.find("hand")) == "unknown_frame");
  CHECK(outcome(asker.queries.path("world", "hand")) == "unknown_end");
  CHECK(outcome(asker.queries.history("hand")) == "unknown_frame");
  // The owner has announced two pages, and none has arrived.
  asker.on_presence({"arm", 1, "host", 1, 2, true});
  Asker joiner(network);
  joiner.on_presence({"arm", 1, "host", 1, 2, true});
  CHECK(outcome(joiner.queries.info("hand", Deadline(10ms))) == "timeout");
}

TEST_CASE("queries: partitions and histories are listed") {
  LoopbackNetwork network;
  ScriptedOwner arm(network, "arm", {{"arm", "", {}}, {"hand", "arm", {}}});
  REQUIRE(arm.node().update("hand", along_x(1), Time(1s)));
  REQUIRE(arm.node().update("hand", along_x(1), Time(2s)));
  Asker asker(network);
  const auto partitions = asker.queries.partitions();
  REQUIRE(partitions);
  REQUIRE(partitions->size() == 1);
  CHECK(partitions->front().name == "arm");
  CHECK(partitions->front().reachable);
  const auto history = asker.queries.history("hand");
  REQUIRE(history);
  REQUIRE(history->size() == 1);
  CHECK(history->front().samples == 2);
  CHECK(asker.queries.histories("arm")->size() == 1);
  arm.leave();
  CHECK_FALSE(asker.queries.partitions()->front().reachable);
}

TEST_CASE("queries: the clock of a host is known by the stamps of replies") {
  LoopbackNetwork network;
  const ScriptedOwner arm(network, "arm", {{"arm", "", {}}});
  Asker asker(network);
  CHECK(outcome(asker.queries.clock_difference("leg", asker.deadline(), 2)) == "unknown_partition");
  // Messages inside a process have none.
  CHECK(outcome(asker.queries.clock_difference("arm", asker.deadline(), 2)) == "unsupported");
}

}  // namespace tfdude
