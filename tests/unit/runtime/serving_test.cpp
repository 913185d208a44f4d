// How a participant becomes the owner of its partition, and what it gives up.

#include "runtime/serving.hpp"

#include <atomic>
#include <string>
#include <unistd.h>
#include <vector>

#include "runtime/yielding.hpp"
#include "support/catch.hpp"
#include "support/forest_support.hpp"
#include "support/process.hpp"
#include "support/replica.hpp"
#include "support/rig.hpp"

namespace tfdude {
namespace {

using namespace std::chrono_literals;
using testing::along_x;
using testing::ContainsSubstring;
using testing::eventually;
using testing::outcome;
using testing::presence_of;
using testing::Rig;
using testing::ScriptedOwner;

struct OwnerRig : Rig {
  explicit OwnerRig(TransportPtr to, const std::string& partition = "arm")
      : Rig(std::move(to), partition),
        yielding(structure, requests, member, options.timeout),
        serving(structure, discovery, *transport, member, options) {
    on_contest = [this] { yielding.ask(); };
  }
  ~OwnerRig() override { yielding.stop(); }
  Result<void> serve(const std::vector<FrameSpec>& frames) {
    yielding.start();
    return serving.serve(frames);
  }
  Yielding yielding;
  Serving serving;
};

const std::vector<FrameSpec> kArm{{"arm", "", {}}, {"hand", "arm", along_x(4)}};

}  // namespace

TEST_CASE("serving: what is configured is owned, stored nowhere, and told") {
  LoopbackNetwork network;
  OwnerRig owner(network.join());
  REQUIRE(owner.serve(kArm));
  Rig other(network.join());
  CHECK(other.structure.forest.exists("hand"));
  CHECK(owner.member.partition()->frame_count() == 2);
  CHECK_FALSE(owner.member.out());
  owner.member.say_goodbye();
  CHECK_FALSE(other.structure.directory.serving("arm"));
}

TEST_CASE("serving: a name that is taken is refused, and its owner named") {
  LoopbackNetwork network;
  const ScriptedOwner first(network, "arm", kArm);
  OwnerRig second(network.join());
  const auto served = second.serve(kArm);
  REQUIRE(outcome(served) == "partition_taken");
  CHECK_THAT(served.error().message,
             ContainsSubstring("'arm' is served already, on host ") &&
                 ContainsSubstring("by process " + std::to_string(getpid())));
}

TEST_CASE("serving: a frame that cannot be is named, and nothing is served") {
  LoopbackNetwork network;
  OwnerRig owner(network.join());
  const auto served = owner.serve({{"arm", "", {}}, {"arm", "", {}}});
  REQUIRE_FALSE(served);
  CHECK_THAT(served.error().message, ContainsSubstring("'arm'"));
  Rig other(network.join());
  CHECK_FALSE(other.structure.forest.exists("arm"));
}

TEST_CASE("member runner: the parts are told of others that come and go") {
  LoopbackNetwork network;
  Rig rig(network.join());
  rig.on_presence(presence_of("leg", 7, 1));
  rig.on_page(Page{"leg", 0, 7, 1, {{"foot", "", 1}}});
  CHECK(rig.routes >= 1);
  CHECK(rig.others == 1);
  rig.on_lost("leg", 7);
  const std::lock_guard lock(rig.mutex);
  CHECK(rig.gone == std::vector<std::string>{"leg"});
  CHECK(rig.others == 2);
}

TEST_CASE("member runner: listeners hear of changes in order, until they are dropped") {
  LoopbackNetwork network;
  Rig rig(network.join());
  std::mutex mutex;
  std::vector<ChangeKind> heard;
  auto subscription = rig.member.on_change([&](const Change& change) {
    const std::lock_guard lock(mutex);
    heard.push_back(change.kind);
  });
  const auto count = [&] {
    const std::lock_guard lock(mutex);
    return heard.size();
  };
  rig.on_presence(presence_of("leg", 7, 1));
  rig.on_page(Page{"leg", 0, 7, 1, {{"foot", "", 1}}});
  rig.on_lost("leg", 7);
  REQUIRE(eventually([&] { return count() >= 2; }));
  subscription.reset();
  const std::size_t before = count();
  rig.on_presence(presence_of("leg", 8, 1));
  CHECK(count() == before);
  CHECK(heard.front() == ChangeKind::kPartitionUp);
}

TEST_CASE("member runner: a participant without a partition stores nothing and refuses nothing") {
  LoopbackNetwork network;
  Rig rig(network.join());
  CHECK(rig.member.partition() == nullptr);
  CHECK(rig.member.still_in());
  rig.member.tell(Deadline(1s));
  const Error error{Errc::kUnknownFrame, "no frame 'hand'"};
  CHECK(rig.member.unless_unsaved(error, "hand").message == error.message);
}

TEST_CASE("yielding: a frame is given up once its other owner has confirmed its older claim") {
  LoopbackNetwork network;
  std::atomic<bool> silent{true};
  // It has claimed the hand first, which the second owner has not heard of as it claims it.
  ScriptedOwner first(network, "first", {{"arm", "", {}}},
                      [&](Transport&, const PeerId&, const Request& request) {
                        return silent && std::holds_alternative<RemoveRequest>(request.body);
                      });
  OwnerRig second(network.join(), "second");
  REQUIRE(second.serve({{"leg", "", {}}, {"hand", "leg", {}}}));
  REQUIRE(second.structure.forest.holds("hand"));
  const auto firsts = second.structure.directory.serving("first");
  REQUIRE(firsts);
  // By a page of the first one, with a claim that is older than any.
  const std::uint64_t epoch =
      second.structure.directory.epoch(*second.structure.directory.owner("first"));
  second.on_page(
      Page{"first", 0, firsts->incarnation, epoch + 1, {{"arm", "", 1}, {"hand", "arm", 1}}});
  // Not as long as the first one has not answered how far it is.
  REQUIRE(eventually([&] { return first.asked() > 0; }));
  CHECK(second.structure.forest.holds("hand"));
  silent = false;
  CHECK(eventually([&] { return !second.structure.forest.holds("hand"); }));
}

}  // namespace tfdude
