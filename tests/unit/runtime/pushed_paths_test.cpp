// Watched paths: the watcher's side and the owner's.

#include <atomic>
#include <chrono>
#include <limits>
#include <string>
#include <variant>
#include <vector>

#include "runtime/watch_server.hpp"
#include "support/catch.hpp"
#include "support/forest_support.hpp"
#include "support/process.hpp"
#include "support/rig.hpp"

namespace tfdude {
namespace {

using namespace std::chrono_literals;
using testing::along_x;
using testing::ContainsSubstring;
using testing::eventually;
using testing::outcome;
using testing::Rig;
using testing::ScriptedOwner;
using testing::x_of;

struct WatchingRig : Rig {
  explicit WatchingRig(LoopbackNetwork& network) : Rig(network.join()), watcher(context) {
    pushed = [this](const PushedValues& values) { watcher.on_pushed(values); };
  }
  ~WatchingRig() override { watcher.stop(); }
  WatchClient watcher;
};

const std::vector<FrameSpec> kArm{{"arm", "", {}}, {"hand", "arm", along_x(4)}};

double seen(const WatchedPath& path) {
  const auto X = path.lookup(Query{});
  return X ? X->pose.translation().x() : std::numeric_limits<double>::quiet_NaN();
}

/// To watch the edge of the hand.
Request watch_hand() {
  WatchRequest body;
  body.segments.push_back({"arm", "hand"});
  return {1, "hand", body};
}

}  // namespace

TEST_CASE("watcher: a watched path follows what its owner writes") {
  LoopbackNetwork network;
  ScriptedOwner arm(network, "arm", kArm);
  WatchingRig rig(network);
  CHECK_FALSE(rig.watcher.on_pushed({}));
  CHECK_FALSE(rig.watcher.can_answer("arm", "hand", Query{}));
  const auto path = rig.watcher.watch("arm", "hand", {});
  REQUIRE(path);
  CHECK(seen(**path) == 4);
  CHECK(rig.watcher.can_answer("arm", "hand", Query{}));
  REQUIRE(arm.node().update("hand", along_x(5)));
  CHECK(eventually([&] { return seen(**path) == 5; }));
  CHECK(rig.watcher.on_pushed({}));
}

TEST_CASE("watcher: a rate outside the limits is rejected") {
  LoopbackNetwork network;
  const ScriptedOwner arm(network, "arm", kArm);
  WatchingRig rig(network);
  for (const double rate : {-1.0, 1e-9, 1e7, std::numeric_limits<double>::quiet_NaN()}) {
    WatchOptions options;
    options.rate = rate;
    CHECK(outcome(rig.watcher.watch("arm", "hand", options)) == "invalid_input");
  }
  CHECK(arm.asked() == 0);
}

TEST_CASE("watcher: a watch times out and names the owner that does not answer") {
  LoopbackNetwork network;
  const ScriptedOwner arm(network, "arm", kArm,
                          [](Transport&, const PeerId&, const Request&) { return true; });
  WatchingRig rig(network);
  const auto unanswered = rig.watcher.watch("arm", "hand", {});
  CHECK(outcome(unanswered) == "timeout");
  CHECK_THAT(unanswered.error().message, ContainsSubstring("'arm'"));
  CHECK(outcome(rig.watcher.watch("arm", "foot", {})) == "unknown_end");
}

TEST_CASE("watcher: a watched path that its owner denies says why, and is asked for seldom") {
  LoopbackNetwork network;
  std::atomic<bool> denies{false};
  std::atomic<int> denied{0};
  ScriptedOwner arm(network, "arm", kArm,
                    [&](Transport& transport, const PeerId& from, const Request& request) {
                      if (!denies || !std::holds_alternative<WatchRequest>(request.body))
                        return false;
                      ++denied;
                      transport.reply(from, {request.sequence, 0, Error{Errc::kTooMuch, "groups"}});
                      return true;
                    });
  WatchingRig rig(network);
  const auto path = rig.watcher.watch("arm", "hand", {});
  REQUIRE(path);
  CHECK((*path)->health());
  denies = true;
  REQUIRE(eventually([&] { return denied >= 1; }));
  const auto begin = std::chrono::steady_clock::now();
  REQUIRE(eventually([&] { return !(*path)->health(); }));
  CHECK((*path)->health().error().code == Errc::kTooMuch);
  CHECK(seen(**path) == 4);
  REQUIRE(eventually([&] { return denied >= 2; }));
  CHECK(std::chrono::steady_clock::now() - begin > 500ms);
  denies = false;
  CHECK(eventually([&] { return (*path)->health().has_value(); }));
}

TEST_CASE("watcher: a watched path follows a frame that is moved") {
  LoopbackNetwork network;
  ScriptedOwner arm(network, "arm", kArm);
  WatchingRig rig(network);
  const auto path = rig.watcher.watch("arm", "hand", {});
  REQUIRE(path);
  REQUIRE(arm.node().add("wrist", "arm", along_x(1)));
  REQUIRE(arm.node().move("hand", "wrist", along_x(1)));
  rig.watcher.look_again();
  CHECK(eventually([&] { return seen(**path) == 2; }));
}

TEST_CASE("pushing: a watcher gets all values in the reply and later ones pushed") {
  LoopbackNetwork network;
  std::atomic<double> pushed{0};
  Rig owner(network.join(), "arm");
  WatchClient own(owner.context);
  WatchServer pushing(owner.context, own);
  owner.member.with_rules([](Member& member) { member.claim("here", 1, Time(1s), 1); });
  owner.member.open(nullptr, 1s);
  REQUIRE(owner.member.serve(nullptr, kArm));
  REQUIRE(owner.member.publish_all());

  const Reply reply = pushing.answer(watch_hand());
  const auto* values = std::get_if<PushedValues>(&reply.body);
  REQUIRE(values != nullptr);
  CHECK(values->entries.size() == 1);

  Rig listener(network.join());
  listener.pushed = [&](const PushedValues& told) {
    for (const PushedValue& one : told.entries) pushed = one.X.pose.translation().x();
  };
  REQUIRE(listener.transport->watch("here", values->group));
  pushing.on_watcher(values->group);
  CHECK(eventually([&] { return pushed == 4; }));
  REQUIRE(owner.structure.forest.update("hand", along_x(6), std::nullopt));
  CHECK(eventually([&] { return pushed == 6; }));

  pushing.stop();
  const Reply refused = pushing.answer(watch_hand());
  const auto* error = std::get_if<Error>(&refused.body);
  REQUIRE(error != nullptr);
  CHECK(error->code == Errc::kNotOwner);
  CHECK_THAT(error->message, ContainsSubstring("'arm' is leaving"));
}

}  // namespace tfdude
