// Lookups: local edges, and the answers of owners.

#include "runtime/lookups.hpp"

#include <future>
#include <string>
#include <vector>

#include "support/catch.hpp"
#include "support/forest_support.hpp"
#include "support/rig.hpp"

namespace tfdude {
namespace {

using namespace std::chrono_literals;
using testing::along_x;
using testing::ContainsSubstring;
using testing::outcome;
using testing::Rig;
using testing::ScriptedOwner;
using testing::x_of;

struct Seeker : Rig {
  explicit Seeker(LoopbackNetwork& network)
      : Rig(network.join()), watcher(context), lookups(context, watcher) {}
  ~Seeker() override {
    lookups.stop();
    watcher.stop();
  }
  WatchClient watcher;
  Lookups lookups;
};

const std::vector<FrameSpec> kBase{{"world", "", {}}, {"mount", "world", along_x(1)}};
const std::vector<FrameSpec> kArm{{"arm", "mount", along_x(2)}, {"hand", "arm", along_x(4)}};

}  // namespace

TEST_CASE("lookups: each owner of a path is asked exactly once") {
  LoopbackNetwork network;
  const ScriptedOwner base(network, "base", kBase);
  const ScriptedOwner arm(network, "arm", kArm);
  Seeker seeker(network);
  CHECK(x_of(seeker.lookups.lookup<std::string_view>("world", "hand", {})) == 7);
  CHECK(base.asked() == 1);
  CHECK(arm.asked() == 1);
  // For edges of one owner only that owner is asked.
  CHECK(x_of(seeker.lookups.lookup<std::string_view>("arm", "hand", {})) == 4);
  CHECK(base.asked() == 1);
  const auto world = seeker.structure.forest.find("world");
  const auto hand = seeker.structure.forest.find("hand");
  REQUIRE((world && hand));
  CHECK(seeker.lookups.lookup_pose(*world, *hand)->translation().x() == 7);
}

TEST_CASE("lookups: an owner that does not answer is named at the deadline") {
  LoopbackNetwork network;
  const ScriptedOwner base(network, "base", kBase);
  const ScriptedOwner arm(network, "arm", kArm,
                          [](Transport&, const PeerId&, const Request&) { return true; });
  Seeker seeker(network);
  const auto found =
      seeker.lookups.lookup<std::string_view>("world", "hand", Query{}, Deadline(30ms));
  CHECK(outcome(found) == "timeout");
  CHECK_THAT(found.error().message, ContainsSubstring("'arm'"));
}

TEST_CASE("lookups: a waiting lookup is answered when the frame has arrived") {
  LoopbackNetwork network;
  const ScriptedOwner base(network, "base", kBase);
  Seeker seeker(network);
  auto found = seeker.lookups.start("world", "hand", Query{}, 20s);
  CHECK(found.wait_for(5ms) == std::future_status::timeout);
  const ScriptedOwner arm(network, "arm", kArm);
  seeker.lookups.look_again();
  CHECK(x_of(found.get()) == 7);
  CHECK(x_of(seeker.lookups.wait("world", "hand", Query{}, 20s)) == 7);
}

TEST_CASE("lookups: a lookup whose wait is over names what is missing") {
  LoopbackNetwork network;
  const ScriptedOwner base(network, "base", kBase);
  Seeker seeker(network);
  const auto found = seeker.lookups.wait("world", "hand", Query{}, 20ms);
  CHECK(outcome(found) == "unknown_end");
  CHECK_THAT(found.error().message, ContainsSubstring("'hand'"));
}

TEST_CASE("lookups: a cancelled lookup does not run its callback") {
  LoopbackNetwork network;
  const ScriptedOwner base(network, "base", kBase);
  Seeker seeker(network);
  std::atomic<int> calls{0};
  auto pending = seeker.lookups.start("world", "hand", Query{}, 20s,
                                      [&](const Result<StampedTransform>&) { ++calls; });
  pending.reset();
  const ScriptedOwner arm(network, "arm", kArm);
  CHECK(x_of(seeker.lookups.wait("world", "hand", Query{}, 20s)) == 7);
  seeker.lookups.stop();
  CHECK(calls == 0);
}

}  // namespace tfdude
